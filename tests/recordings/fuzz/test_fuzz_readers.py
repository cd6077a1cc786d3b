"""Every reader on damaged files: cut, shuffled, overwritten, random. An error that names the file, never another one.

40 files a format, and one of the formats that libraries in C read in the process apart that real files are read in;
100,000 and 2,000 of each format with UNDERSKIN_SOAK=1.
"""

import functools
import io
import os
import signal
import struct
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from functools import partial

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st

from bench.figures import Figure
from bench.soak import SOAK, record
from tests.recordings.test_recordings_workbooks import with_values, workbook
from tests.support import instrument_files as examples
from tests.support.campaign_documents import EVERYTHING
from tests.support.repository import ROOT
from underskin.errors import FileError
from underskin.recordings.campaign import parse
from underskin.recordings.readers import json_file
from underskin.recordings.readers.formats import MODULES
from underskin.recordings.readers.sandbox import parse_apart

pytestmark = [
    pytest.mark.slow,
    # pyuff leaves the files open that it has written
    pytest.mark.filterwarnings(
        "ignore:unclosed file:ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning"
    ),
]

# In parts, so that an interrupted soak goes on with the next one.
PARTS = 10 if SOAK else 1
COUNT = 10_000 if SOAK else 40
COUNT_APART = 200 if SOAK else 1
# Read by libraries in C, which damage can make crash, loop or ask for all memory: what the process apart is for.
FOREIGN = ("HDF5", "MATLAB")
_SIGNALS = (signal.SIGSEGV, signal.SIGBUS, signal.SIGABRT, signal.SIGALRM)
CONTAINED = ("no memory", *(f"died: {-number}" for number in _SIGNALS))


@functools.cache
def sound_files() -> dict[str, list[bytes]]:
    """Small files without a fault, by format."""
    csv = b"Sample,palm\n\nforce,amplifier\n1000,0\n1100,-0.007\n900,0.007\n1000,-0.001\n"
    sheet: list[list[object]] = [["force", "amplifier"], [1000, 0], [1100, -0.007], [900, 0.007], [1000, -0.001]]
    structure = {**examples.matlab_variables(), "run": {"force": examples.FORCE, "fs": 2.0}, "cell": [{"a": 1}, "x"]}
    datasets = examples.time_datasets()
    columns = zip(examples.FORCE, examples.CHARGE, strict=True)
    records = np.array(list(columns), [("force", "f8"), ("amplifier", "f4")])
    return {
        "JSON": [json_file.write(parse(EVERYTHING))],
        "CSV template": [(examples.EXAMPLES / "template.csv").read_bytes()],
        "CSV": [csv, csv.replace(b",", b"\t"), csv.replace(b",", b";").replace(b".", b",")],
        "LVM": [examples.lvm().encode(), examples.lvm(separator=",").encode()],
        "TDMS": [examples.tdms(1), examples.tdms(3)],
        "UFF": [examples.uff(0, datasets), examples.uff(1, datasets)],
        "MATLAB": [
            examples.matlab_5(structure),
            examples.matlab_5(structure, compressed=False),
            examples.matlab_73(examples.matlab_variables()),
        ],
        "HDF5": [
            examples.hdf5(EVERYTHING),
            without_checksums(examples.hdf5(EVERYTHING)),
            examples.plain_hdf5(
                {"run": structure["run"] | examples.matlab_variables(), "who": np.array(["a"], object)}
            ),
        ],
        "XLSX": [workbook({"run": sheet}), with_values(workbook({"run": [*sheet, ["=500+500", 0]]}), "1000")],
        "NumPy": [examples.numpy_file(records), examples.numpy_file(examples.matlab_variables())],
        "WAV": [examples.wav(examples.FORCE, np.float32), examples.wav(examples.CHARGE, np.int16)],
    }


def without_checksums(data: bytes) -> bytes:
    """The same objects as older HDF5 libraries write them, where damage is not found out at once."""
    buffer = io.BytesIO()
    with h5py.File(io.BytesIO(data), "r") as source, h5py.File(buffer, "w", libver="earliest") as target:
        for name, value in source.attrs.items():
            target.attrs[name] = value
        for name in source:
            source.copy(name, target)
    return buffer.getvalue()


LIKE_ALL = partial(settings, database=None, suppress_health_check=list(HealthCheck))


class Reader:
    """A worker that reads one file after another, and is started again when one ends it."""

    def __init__(self) -> None:
        self.process = self._start()

    def _start(self) -> "subprocess.Popen[bytes]":
        command = [sys.executable, "-m", "tests.recordings.fuzz.worker"]
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])}
        return subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment
        )

    def said(self, kind: str, data: bytes) -> str:
        """What the worker says of a file of a format, or how it died."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(struct.pack("<16sQ", kind.encode(), len(data)) + data)
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if line:
            return line.decode().strip()
        self.close()
        status = self.process.returncode
        self.process = self._start()
        return f"died: {status}"

    def close(self) -> None:
        for pipe in (self.process.stdin, self.process.stdout):
            assert pipe is not None
            pipe.close()
        self.process.wait()


@pytest.fixture(scope="module")
def reader() -> Iterator[Reader]:
    worker = Reader()
    yield worker
    worker.close()


@st.composite
def damaged(draw: st.DrawFn, files: list[bytes]) -> bytes:
    data = draw(st.sampled_from(files))
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(data)))
        end = min(len(data), start + draw(st.integers(0, 16) | st.integers(0, len(data))))
        noise = draw(
            st.binary(max_size=24) | st.sampled_from([b"\xff" * 8, b"\0" * 8, b"\n", b"9" * 12, b"nan", b"-1"])
        )
        data = draw(
            st.sampled_from(
                [
                    data[:end],
                    data[:start] + noise + data[start + len(noise) :],
                    data[:start] + noise + data[start:],
                    data[:start] + data[end:],
                    data[end:] + data[start:end] + data[:start],
                    data[:end] + data[start:],
                    data[:16] + noise,
                    noise,
                ]
            )
        )
    return data


@pytest.mark.parametrize("part", range(PARTS))
@pytest.mark.parametrize("kind", sorted(MODULES))
def test_damaged_files_are_refused_with_their_name(reader: Reader, kind: str, part: int) -> None:
    files = sound_files()[kind]
    for sound in files:
        assert reader.said(kind, sound) == ("refused" if kind == "WAV" else "read")  # sound has no channel `force`

    allowed = ["read", "refused", *(CONTAINED if kind in FOREIGN else ())]

    @seed(part)
    @LIKE_ALL(max_examples=COUNT)
    @given(data=damaged(files))
    def try_it(data: bytes) -> None:
        said = reader.said(kind, data)
        assert said in allowed, said

    try_it()
    record(Figure(f"Damaged files read, {kind}", COUNT, "", 100_000))


@pytest.mark.parametrize("part", range(PARTS))
@pytest.mark.parametrize("kind", sorted(MODULES) if SOAK else FOREIGN)
def test_damaged_files_are_refused_by_the_process_apart(kind: str, part: int) -> None:
    @seed(part)
    @LIKE_ALL(max_examples=COUNT_APART)
    @given(data=damaged(sound_files()[kind]))
    def try_it(data: bytes) -> None:
        said = said_apart(kind, data)
        assert said == "read" or said.startswith("fuzz.dat"), said

    try_it()
    record(Figure(f"Damaged files read apart, {kind}", COUNT_APART, "", 2000))


def said_apart(kind: str, data: bytes) -> str:
    """What reading a file in the process apart ends with."""
    with tempfile.TemporaryFile() as stream:
        stream.write(data)
        stream.flush()
        try:
            parse_apart(kind, stream, "fuzz.dat")
        except FileError as error:
            return str(error)
    return "read"
