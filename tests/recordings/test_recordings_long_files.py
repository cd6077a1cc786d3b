"""Long texts are read in blocks of lines, and say the same as short ones; their limits are settings."""

import re
from collections.abc import Iterator

import numpy as np
import pytest

from tests.recordings.contents_of_files import contents
from tests.recordings.test_recordings_cells import ABOVE, HEADINGS
from underskin.errors import FileError, InvalidInput
from underskin.recordings import read_file
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.channels import Contents
from underskin.recordings.readers import text

RANDOM = np.random.default_rng(20251224)
VALUES = RANDOM.normal(size=(3, 900)).round(9)


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A block is a few lines, so that a text of some thousand lines is a long one."""
    monkeypatch.setattr(text, "BLOCK", 500)
    return iter(())


def template(per_recording: int, *, every_id: bool = False) -> list[str]:
    """Lines of a template whose recordings r0, r1, … have so many lines of FRF each."""
    lines = (ABOVE + HEADINGS).splitlines()
    for place, (real, imaginary) in enumerate(VALUES[:2].T.tolist()):
        number, line = divmod(place, per_recording)
        own = f"r{number}" if every_id or line == 0 else ""
        once = "s01,4,1.5,0.09" if line == 0 else ",,,"
        lines.append(f"{own},{once},{line + 1},{real!r},{imaginary!r}")
    return lines


def read(lines: list[str], end: str = "\n") -> list[FrfRecording]:
    found = read_file(end.join(lines).encode(), "a.csv")
    assert found.problems == []
    return [entry for entry in found.campaign.recordings if isinstance(entry, FrfRecording)]


def values_of(recordings: list[FrfRecording]) -> np.ndarray:
    real = np.concatenate([np.asarray(entry.frf_re_pc_per_n) for entry in recordings])
    return np.stack([real, np.concatenate([np.asarray(entry.frf_im_pc_per_n) for entry in recordings])])


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("every_id", [False, True])
def test_every_number_of_a_long_template_arrives(end: str, *, every_id: bool) -> None:
    recordings = read(template(300, every_id=every_id), end)
    assert [
        (entry.id, entry.preload_n, len([] if entry.frequency_hz is None else entry.frequency_hz))
        for entry in recordings
    ] == [(f"r{number}", 1.5, 300) for number in range(3)]
    assert np.array_equal(values_of(recordings), VALUES[:2])


def test_what_stands_between_the_rows_of_a_long_template_changes_nothing() -> None:
    lines = template(300)
    start = len((ABOVE + HEADINGS).splitlines())
    lines[start + 400] = lines[start + 400].replace(",,,,,", ' , ,"", , ,')
    for place, between in ((800, ",,,,"), (650, "# by hand"), (500, "")):
        lines.insert(start + place, between)
    recordings = read([*lines, "", "measured by mb"])
    assert np.array_equal(values_of(recordings), VALUES[:2])


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (("^", "r0"), "recording 'r0' began on line 10 already"),
        ((",,,,,", ",s02,,,,"), "sensor = 's02', but 's01' above it"),
        (("$", ",7"), "has 9 cells under 8 headings"),
        ((",,,,,", ',"s02,,,,'), "a cell in quotes must end on its line"),
    ],
)
def test_what_is_wrong_in_a_long_template_is_named_by_its_line(change: tuple[str, str], reason: str) -> None:
    lines = template(300)
    lines[717] = re.sub(*change, lines[717], count=1)
    with pytest.raises(FileError, match=re.escape(reason)) as refused:
        read(lines)
    assert refused.value.place.split(",")[0] == "line 718"


@pytest.mark.parametrize("per_recording", [2, 300])
def test_a_number_that_is_none_is_refused_by_its_recording_or_its_line(per_recording: int) -> None:
    lines = template(per_recording)
    start = len((ABOVE + HEADINGS).splitlines())
    lines[start] = lines[start].replace("1.5", "nan")
    again = lines[start + 1].replace(",,,,", ",,,nan,")
    (problem,) = read_file("\n".join([*lines[: start + 1], again, *lines[start + 2 :]]).encode(), "a.csv").problems
    assert (problem.recording, problem.field) == ("r0", "preload_n")
    other = lines[start + 1].replace(",,,,", ",,,1.5,")
    with pytest.raises(FileError, match=re.escape(f"line {start + 2}: preload_n = 1.5, but nan above it")):
        read([*lines[: start + 1], other, *lines[start + 2 :]])


def test_an_empty_cell_in_a_long_template_is_refused_with_its_recording() -> None:
    lines = template(300)
    lines[717] = lines[717].rpartition(",")[0] + ","
    problems = read_file("\n".join(lines).encode(), "a.csv").problems
    assert [(problem.recording, problem.field) for problem in problems] == [("r2", "frf_im_pc_per_n[108]")]


def table(separator: str, decimal: str) -> list[str]:
    rows = [separator.join(map(repr, row)).replace(".", decimal) for row in VALUES.T.tolist()]
    return ["Operator: mb", separator.join(["Time [s]", "Force [N]", "Charge [pC]"]), *rows]


@pytest.mark.parametrize(("separator", "decimal"), [(",", "."), (";", ","), ("\t", ","), (" ", ".")])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "latin-1"])
def test_every_number_of_a_long_table_arrives(separator: str, decimal: str, encoding: str) -> None:
    lines = table(separator, decimal)
    lines[0] = "Operator: Jürgen"
    held = contents("\r\n".join(lines).encode(encoding), "a.csv")
    (block,) = held.blocks
    assert held.properties["Operator"] == "Jürgen"
    assert np.array_equal([channel.values for channel in block.channels], VALUES)


def test_text_far_down_in_a_long_table_is_named_by_its_line() -> None:
    lines = table(",", ".")
    lines[750] = "0.1,broken,0.3"
    with pytest.raises(FileError, match=r"found '0\.1,broken,0\.3'") as refused:
        contents("\n".join(lines).encode(), "a.csv")
    assert refused.value.place == "line 751"


@pytest.mark.slow
def test_a_long_text_takes_little_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()  # blocks as they are
    rows = "".join(f"{number * 1e-4:.4f},{number % 97 / 7:.6f}\n" for number in range(1_300_000))
    data = ("Time [s],Force [N]\n" + rows).encode()
    assert len(data) > 20_000_000
    monkeypatch.setenv("UNDERSKIN_READING_MEMORY_MB", "100")
    held = contents(data, "long.csv")
    assert isinstance(held, Contents)
    assert [channel.values.size for channel in held.blocks[0].channels] == [1_300_000] * 2


@pytest.mark.parametrize(("name", "value"), [("SECONDS", "soon"), ("MEMORY_MB", "1"), ("EXPANSION", "nan")])
def test_a_limit_that_cannot_be_used_is_named(monkeypatch: pytest.MonkeyPatch, name: str, value: str) -> None:
    monkeypatch.setenv(f"UNDERSKIN_READING_{name}", value)
    with pytest.raises(InvalidInput, match=f"UNDERSKIN_READING_{name} = '{value}': must be"):
        read_file(b"TDSm" + bytes(60), "a.tdms")
