"""Binary files are parsed in a process of their own; what it must not do, and how its end is told."""

import io
import os
import signal
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

import h5py
import numpy as np
import pytest

from tests.recordings.fuzz.test_fuzz_readers import sound_files
from tests.support.campaign_documents import EVERYTHING, INDENTATION, document
from tests.support.cases import first
from tests.support.instrument_files import hdf5, tdms
from underskin.errors import FileError
from underskin.recordings import read_contents, read_file
from underskin.recordings.channels import Contents, Document
from underskin.recordings.readers import formats
from underskin.recordings.readers.parsing_limits import ParsingLimits
from underskin.recordings.readers.sandbox import call_apart, parse_apart

pytestmark = pytest.mark.slow  # each file is read in a process of its own


@pytest.fixture
def stream() -> Iterator[BinaryIO]:
    with tempfile.TemporaryFile() as opened:
        opened.write(tdms(1))
        opened.flush()
        yield opened


def matlab_73(fill: Callable[[Any], None]) -> bytes:
    """A file that begins as MATLAB 7.3 does, with what `fill` puts into it."""
    buffer = io.BytesIO()
    with h5py.File(buffer, "w", userblock_size=512) as target:
        fill(target)
    return b"MATLAB 7.3 MAT-file".ljust(512, b"\0") + buffer.getvalue()[512:]


@pytest.mark.filterwarnings("ignore:unclosed file:ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("kind", formats.BINARY)
def test_what_the_child_reads_arrives_unchanged(kind: str) -> None:
    """Of each format that is read there as a rule; pyuff leaves the files open that it has written."""
    with tempfile.TemporaryFile() as stream:
        stream.write(sound_files()[kind][0])
        stream.seek(0)
        here = formats.parse(kind, stream, "a")
        apart = parse_apart(kind, stream, "a")
    if isinstance(here, Document):
        assert isinstance(apart, Document)
        assert apart.warnings == here.warnings
        np.testing.assert_equal(apart.campaign, here.campaign)
        return
    assert isinstance(apart, Contents)
    assert (apart.properties, apart.warnings, apart.layout) == (here.properties, here.warnings, here.layout)
    for own, other in zip(here.blocks, apart.blocks, strict=True):
        assert {**vars(own), "channels": ()} == {**vars(other), "channels": ()}
        for mine, theirs in zip(own.channels, other.channels, strict=True):
            assert {**vars(mine), "values": ()} == {**vars(theirs), "values": ()}
            assert np.array_equal(mine.values, theirs.values)


def test_a_small_file_that_unfolds_beyond_the_memory_limit_is_refused() -> None:
    data = matlab_73(lambda target: target.create_dataset("force", data=np.zeros(20_000_000), compression="gzip"))
    assert len(data) < 1_000_000
    with tempfile.TemporaryFile() as stream:
        stream.write(data)
        stream.flush()
        with pytest.raises(
            FileError, match=r"bomb\.mat: .*more than 107\.374 MB of memory \(UNDERSKIN_READING_MEMORY_MB\)"
        ):
            parse_apart("MATLAB", stream, "bomb.mat", ParsingLimits(memory_bytes=107_374_182))


def test_a_small_file_cannot_become_a_large_campaign() -> None:
    data = matlab_73(lambda target: target.create_dataset("force", data=np.zeros(3_000_000), compression="gzip"))
    with pytest.raises(FileError, match=r"bomb\.mat: it unfolds to more than \d+ MB, too much for a file of its size"):
        read_contents(data, "bomb.mat")


@pytest.mark.usefixtures("understood_here")
def test_a_dataset_that_was_never_written_is_refused() -> None:
    def declare(target: Any) -> None:
        del target["recordings/000000/force_n"]
        target.create_dataset("recordings/000000/force_n", (1_000_000,), "f8", fillvalue=1.0)

    with pytest.raises(FileError, match=r"force_n: declares 8000000 bytes of data, of which the file stores 0"):
        read_contents(altered_hdf5(declare), "bomb.h5")


def altered_hdf5(change: Callable[[Any], None]) -> bytes:
    buffer = io.BytesIO(hdf5(document(INDENTATION)))
    with h5py.File(buffer, "r+") as target:
        change(target)
    return buffer.getvalue()


@pytest.mark.usefixtures("understood_here")
def test_references_are_no_values() -> None:
    buffer = io.BytesIO(hdf5(EVERYTHING))
    with h5py.File(buffer, "r+") as target:
        target["recordings/000000"].attrs["sensor"] = target["skin"].ref
    problems = read_file(buffer.getvalue(), "a.h5").problems
    assert [(problem.recording, problem.field) for problem in problems] == [("r1", "sensor")]


def test_a_file_that_takes_too_long_is_refused(stream: BinaryIO) -> None:
    with pytest.raises(FileError, match=r"slow\.tdms: reading it as TDMS took more than 0\.02 s"):
        parse_apart("TDMS", stream, "slow.tdms", ParsingLimits(seconds=0.02))


def compute(_stream: BinaryIO) -> None:
    while True:
        pass


def wait(_stream: BinaryIO) -> dict[str, Any]:
    time.sleep(5)
    return {}


def test_time_on_a_processor_counts_and_waiting_for_one_does_not(stream: BinaryIO) -> None:
    assert call_apart(f"{__name__}:wait", stream, "a", what="TDMS", limits=ParsingLimits(seconds=4.0)) == {}
    with pytest.raises(FileError, match=r"a: reading it as TDMS took more than 1 s and was stopped"):
        call_apart(f"{__name__}:compute", stream, "a", what="TDMS", limits=ParsingLimits(seconds=1.0))


def die(_stream: BinaryIO) -> None:
    os.kill(os.getpid(), signal.SIGSEGV)


def fail(_stream: BinaryIO) -> None:
    raise RuntimeError("something unforeseen")


def write_much(_stream: BinaryIO) -> dict[str, Any]:
    part = np.zeros(10_000_000)
    return {str(number): part for number in range(5)}


def see_environment(_stream: BinaryIO) -> dict[str, str]:
    return dict(os.environ)


@pytest.mark.parametrize(
    ("function", "message"),
    [("die", "was killed by signal 11"), ("fail", "ended with status 1: RuntimeError: something unforeseen")],
)
def test_the_childs_death_is_an_error_that_names_the_file(stream: BinaryIO, function: str, message: str) -> None:
    with pytest.raises(FileError, match=message) as refusal:
        call_apart(f"{__name__}:{function}", stream, "palm.tdms", what="TDMS")
    assert refusal.value.file == "palm.tdms"


def test_the_child_cannot_answer_more_than_it_may_hold(stream: BinaryIO) -> None:
    with pytest.raises(FileError, match=r"a: it unfolds to more than 16 MB"):
        call_apart(f"{__name__}:write_much", stream, "a", what="TDMS")


def test_the_child_knows_no_secrets(stream: BinaryIO, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("UNDERSKIN_DATABASE_URL", "postgresql://lab:secret@host/db")
    seen = call_apart(f"{__name__}:see_environment", stream, "a", what="TDMS")
    assert "PYTHONPATH" in seen
    assert not any("secret" in value for value in seen.values())


def link_outside(target: Any, secret: Path) -> None:
    target["force"] = h5py.ExternalLink(str(secret), "/data")


def link_inside(target: Any, _secret: Path) -> None:
    target["force"] = h5py.SoftLink("/elsewhere")


def store_outside(target: Any, secret: Path) -> None:
    target.create_dataset("force", (4,), "f8", external=[(str(secret), 0, 32)])


def map_outside(target: Any, secret: Path) -> None:
    layout = h5py.VirtualLayout((4,), "f8")
    layout[:] = h5py.VirtualSource(str(secret), "data", (4,))
    target.create_virtual_dataset("force", layout)


def lead_back(target: Any, _secret: Path) -> None:
    target.create_group("run")["again"] = target


def same_twice(target: Any, _secret: Path) -> None:
    target["a"] = np.zeros(3)
    target["b"] = target["a"]


@pytest.mark.usefixtures("understood_here")
@pytest.mark.parametrize(
    ("kind", "fill"),
    [
        *(("HDF5", fill) for fill in (link_outside, link_inside, store_outside, map_outside, lead_back, same_twice)),
        *(("MATLAB", fill) for fill in first(2, (link_outside, map_outside, store_outside, link_inside, lead_back))),
    ],
)
def test_hdf5_that_leads_out_of_the_file_is_refused(kind: str, fill: Any, tmp_path: Path) -> None:
    with h5py.File(tmp_path / "secret.h5", "w") as secret:
        secret["data"] = np.arange(4.0)
    if kind == "MATLAB":
        data = matlab_73(lambda target: fill(target, tmp_path / "secret.h5"))
    else:
        buffer = io.BytesIO(hdf5(EVERYTHING))
        with h5py.File(buffer, "r+") as target:
            fill(target["recordings/000000"], tmp_path / "secret.h5")
        data = buffer.getvalue()
    with pytest.raises(FileError, match=r"somewhere else|another file|same object"):
        read_file(data, "a.h5")


@pytest.mark.usefixtures("understood_here")
def test_a_name_given_by_a_client_never_becomes_a_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("../../escape.h5", str(tmp_path / "absolute.h5"), "\0", "x" * 5000, "-rf"):
        assert read_file(hdf5(EVERYTHING), name).campaign.recordings
    assert list(tmp_path.iterdir()) == []
