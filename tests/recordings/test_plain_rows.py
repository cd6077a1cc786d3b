"""Rows read by the bytes of a block are those that are read line by line, and the others are left to that."""

import io
import time
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tests.recordings.contents_of_files import contents
from tests.recordings.test_recordings_cells import ABOVE
from underskin.recordings import read_file
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.readers import csv_file, text
from underskin.recordings.readers.cells import PlainRows, RowStyle, Table

NUMBERS = ("1", "-2.5", "+.5", "7.", "1e-3", "1E5", "nan", "-inf", "Infinity", "−4", "0.1234567890123456789", "1e999")
OTHERS = ("", " ", "1 2", "1.2.3", "0x10", "1_0", "n/a", "nan(1)", "1e", "-", "1,5", "٣", "12:30", "#3", '"', "a;b")
CELLS = st.sampled_from([*NUMBERS, *OTHERS]) | st.floats().map(repr) | st.text('0123456789.,-+eE "n;\xa0', max_size=6)
LINES = st.lists(st.lists(CELLS, max_size=4).map(",".join) | st.lists(CELLS, max_size=4).map(";".join), max_size=12)


def by_line(lines: Sequence[str], style: RowStyle) -> dict[int, list[float]]:
    """The numbers of the rows among some lines, read one by one."""
    table = Table(0, style.separator, style.decimal, tuple(style.columns), style.width)
    return {index: row for index, line in enumerate(lines) if (row := table.row(line)) is not None}


def at_once(lines: Sequence[str], style: RowStyle) -> dict[int, list[float]]:
    """The same by blocks."""
    rows = PlainRows(lines, style)
    return {
        line + row - start: [float(column[row]) for column in rows.numbers]
        for line, start, end in rows.runs()
        for row in range(start, end)
    }


@given(LINES, st.sampled_from([(",", "."), (";", "."), (";", ","), ("\t", "."), (" ", "."), (" ", ",")]))
@example(['"1","2"', '1,"2', '"1",2,"x,y"', "1,2,,,"], (",", "."))
@example(["1, ", " ,2", "1,"], (",", "."))
@example(["  1   2 ", "1 2 x", "1"], (" ", "."))
def test_numbers_are_those_of_single_lines(lines: list[str], marks: tuple[str, str]) -> None:
    style = RowStyle(*marks, (0, 1), 3)
    if marks[0] in "\t ":
        lines = [line.replace(",", marks[0]) if marks[1] == "." else line.replace(";", marks[0]) for line in lines]
    single = by_line(lines, style)
    for line, row in at_once(lines, style).items():
        np.testing.assert_array_equal(row, single[line])


def test_all_kinds_of_numbers_are_taken_at_once() -> None:
    lines = [f"{one},{other}" for one in NUMBERS for other in NUMBERS]
    assert len(at_once(lines, RowStyle(",", ".", (0, 1), 2))) == len(lines)


@pytest.mark.parametrize("cells", [['"a,b"', '"c"'], ["x", '"y"'], ["", "z"]])
def test_texts_beside_numbers_without_quotes(cells: list[str]) -> None:
    """Texts beside numbers are without their quotes."""
    lines = [f"{cell},1,2" for cell in cells]
    rows = PlainRows(lines, RowStyle(",", ".", (1, 2), 3))
    assert rows.texts(0, 0, 2) == [text.cells(line, ",")[0] for line in lines]


def seconds(lines: list[str]) -> float:
    start = time.process_time()
    csv_file.read(io.BytesIO("\n".join(["Time [s],Force [N]", *lines]).encode()), "a.csv")
    return time.process_time() - start


@pytest.mark.slow
def test_lines_rows_hardly_cost_rows() -> None:
    """Lines between the rows hardly cost more than rows.

    Blank lines, which part groups, cost eight times as much while blocks were halved to find them.
    """
    rows = [f"{number * 1e-4:.4f},{number % 97 / 7:.6f}" for number in range(200_000)]
    parted = [line for number, row in enumerate(rows) for line in ((row, "") if number % 500 == 499 else (row,))]
    assert seconds(parted) < 3 * seconds(rows)


def test_cells_end_lines_without_holding() -> None:
    """Cells that end lines without holding anything change nothing."""
    rows = [f"{number},{number / 8}" for number in range(100)]
    lines = ["Time [s],Force [N]", *rows[:50], *(f"{row},,," for row in rows[50:])]
    (block,) = contents("\n".join(lines).encode(), "a.csv").blocks
    assert block.channels[1].values.tolist() == [number / 8 for number in range(100)]


def test_index_trailing_separators_long_template() -> None:
    """An index and trailing separators of a long template are passed over."""
    columns = "indenter_radius_mm,preload_n,dynamic_force_n,frequency_hz,frf_re_pc_per_n,frf_im_pc_per_n"
    lines = [*ABOVE.splitlines(), f"Unnamed: 0,id,sensor,{columns}"]
    for number in range(300):
        once = "r1,s01,4,1.5,0.09" if number == 0 else ",,,,"
        lines.append(f"{number},{once},{number + 1},{7 + number / 64},{-number / 64},,")
    reading = read_file("\n".join(lines).encode(), "a.csv")
    assert (reading.problems, reading.warnings) == ([], [])
    (recording,) = reading.campaign.recordings
    assert isinstance(recording, FrfRecording)
    assert recording.frf_re_pc_per_n is not None
    assert recording.frf_re_pc_per_n.tolist() == [7 + number / 64 for number in range(300)]
