"""Real instruments' files."""

import functools
import os
from pathlib import Path

import pytest

from tests.support.instrument_files import EXAMPLES
from underskin.recordings import Reading, read_file, rig_description
from underskin.recordings.rig_description import RigDescription


def real(pattern: str) -> list[Path]:
    folder = os.environ.get("UNDERSKIN_RECORDINGS")
    if folder is None:
        pytest.skip("UNDERSKIN_RECORDINGS names no folder of recordings")
    files = sorted(Path(folder).glob(pattern))
    assert files
    return files


@functools.cache
def example_rig(name: str) -> RigDescription:
    file = EXAMPLES / "rigs" / f"{name}.yaml"
    return rig_description.parse(file.read_bytes(), file.name)


def read(file: Path, rig_name: str) -> Reading:
    reading = read_file(file, file.name, example_rig(rig_name))
    assert not reading.problems
    return reading
