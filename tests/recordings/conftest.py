"""Files understood in the test's own process."""

import importlib
from typing import Any, BinaryIO

import pytest

from underskin.errors import FileError

CALLERS = ("readers.sandbox", "reading", "rig_description")


@pytest.fixture
def understood_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Readers run in the test's own process: for each file one of its own would take half a second to start.

    That a reader there gives the same, within limits, is of test_recordings_sandbox.py and the fuzzing.
    """
    for caller in CALLERS:
        monkeypatch.setattr(f"underskin.recordings.{caller}.call_apart", _call_here)


def _call_here(function: str, stream: BinaryIO, file: str, *given: str, **_options: Any) -> Any:
    module, _, name = function.partition(":")
    stream.seek(0)
    try:
        return getattr(importlib.import_module(module), name)(stream, *given)
    except FileError as error:
        raise FileError(file, error.place, error.reason, code=error.code) from error
