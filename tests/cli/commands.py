"""The command `underskin` as a user runs it."""

import os
import subprocess
import sys
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from io import BytesIO, TextIOWrapper
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, TextIO
from unittest.mock import patch

import pytest

from underskin.cli.app import app, main

COMMAND = Path(sys.executable).with_name("underskin")
PRESSED: dict[str, Any] = {
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16.0,
    "sensor_radius_mm": 1.5,
    "indenter_radius_mm": 4.0,
}
SKIN = [part for name, value in PRESSED.items() for part in ("--" + name.replace("_", "-"), str(value))]
FRF = ["frf", *SKIN, "--d33-pc-per-n", "14"]


def run(*arguments: str | Path, given: str = "", **environment: str) -> subprocess.CompletedProcess[str]:
    """The command's result; `given` is its standard input.

    In this process, where a new one would spend most of its time on imports, but with variables that Python reads as
    it starts.
    """
    words, plain = [str(word) for word in arguments], {"COLUMNS": "120", **environment}
    if any(name.startswith("PYTHON") for name in environment):
        return subprocess.run([COMMAND, *words], input=given, env=os.environ | plain, capture_output=True, text=True)
    with TemporaryFile("w+", encoding="utf-8") as stdin, ExitStack() as patched:
        stdin.write(given)
        stdin.seek(0)
        told = {"stdout": BytesIO(), "stderr": BytesIO()}
        patched.enter_context(patch.object(sys, "stdin", stdin))
        for name, stream in told.items():
            patched.enter_context(patch.object(sys, name, TextIOWrapper(stream, "utf-8", write_through=True)))
        patched.enter_context(patch.object(sys, "argv", [str(COMMAND), *words]))
        patched.enter_context(patch.dict(os.environ, plain))
        patched.enter_context(patch.object(app, "registered_commands", list(app.registered_commands)))
        patched.enter_context(_warnings_told())
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = (stream.getvalue().decode() for stream in told.values())
    return subprocess.CompletedProcess(words, int(ended.value.code or 0), out, err)


@contextmanager
def _warnings_told() -> Iterator[None]:
    """Warnings on standard error, of the kinds that Python shows by itself."""
    with warnings.catch_warnings():
        warnings.resetwarnings()
        for kind in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
            warnings.simplefilter("ignore", kind)
        warnings.showwarning = _write_warning
        yield


def _write_warning(  # as `warnings.showwarning`, whose other arguments are for messages that go elsewhere
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,  # noqa: ARG001
    line: str | None = None,  # noqa: ARG001
) -> None:
    sys.stderr.write(warnings.formatwarning(message, category, filename, lineno))


def refused(*arguments: str, given: str = "", **environment: str) -> str:
    """The one line on stderr of a command that ends with status 2."""
    answer = run(*arguments, given=given, **environment)
    assert (answer.returncode, answer.stdout) == (2, "")
    (line,) = answer.stderr.splitlines()
    return line
