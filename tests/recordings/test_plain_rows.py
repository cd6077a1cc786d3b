"""Rows read by the bytes of a block are those that are read line by line, and the others are left to that."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tests.recordings.test_recordings_cells import ABOVE
from underskin.recordings import read_file
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.readers.table import Table, plain_numbers

NUMBERS = ("1", "-2.5", "+.5", "7.", "1e-3", "1E5", "nan", "-inf", "Infinity", "−4", "0.1234567890123456789", "1e999")
OTHERS = ("", " ", "1 2", "1.2.3", "0x10", "1_0", "n/a", "nan(1)", "1e", "-", "1,5", "٣", "12:30", "#3", '"', "a;b")
CELLS = st.sampled_from([*NUMBERS, *OTHERS]) | st.floats().map(repr) | st.text('0123456789.,-+eE "n;\xa0', max_size=6)
LINES = st.lists(st.lists(CELLS, max_size=4).map(",".join) | st.lists(CELLS, max_size=4).map(";".join), max_size=12)


MARKS = st.sampled_from([(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ",")])


@given(LINES, MARKS)
@example(['"1","2"', '1,"2'], (",", "."))
@example(["1,2", ",2"], (",", "."))
@example(["1,", "2,3"], (",", "."))
@example(["1,,2", "3"], (",", "."))
@example(["1, ", "2,3"], (",", "."))
@example(["1,-", "+,3"], (",", "."))
def test_numbers_are_those_of_single_lines(lines: list[str], marks: tuple[str, str]) -> None:
    """Lines that are read at once hold the numbers that each of them has alone."""
    separator, decimal = marks
    lines = [line.replace(";", separator) if decimal == "," else line.replace(",", separator) for line in lines]
    at_once = plain_numbers(lines, separator, decimal, 2)
    single = [Table(0, separator, decimal, (0, 1), 2).row(line) for line in lines]
    if at_once is not None:
        assert None not in single
        np.testing.assert_array_equal(at_once.reshape(-1, 2), np.array(single, float))


ROWS = st.lists(st.lists(CELLS | st.sampled_from(['"1.5"', '"a"', ' "2" ', '"', '""']), max_size=4), max_size=8)


@given(ROWS, st.sampled_from([",", ";", "\t", " "]))
@example([['"1', '2"', "3"]], ";")
@example([['""', '"', '""']], ";")
@example([["1", "2", "approach"], ["1", "2"]], ",")
def test_cells_are_those_of_single_lines(rows: list[list[str]], separator: str) -> None:
    """The cells of lines that are split at once are those of each line alone, with the empty ones at its end."""
    lines = [separator.join(row) for row in rows]
    table = Table(0, separator, ".", (0, 1), 3)
    at_once = table.cells_of_columns(lines) if lines else None
    if at_once is not None:
        single = [table.cells(line) for line in lines]
        padded = [[*cells, *[""] * (3 - len(cells))] for cells in single]
        several = [number for number, cells in enumerate(single) if cells]  # else too few numbers for a row
        rows_at_once = list(zip(*at_once, strict=True))
        assert [list(rows_at_once[number]) for number in several] == [padded[number] for number in several]


@pytest.mark.parametrize(("separator", "decimal"), [(",", "."), (";", ","), ("\t", "."), ("\t", ",")])
def test_plain_numbers_are_taken_at_once(separator: str, decimal: str) -> None:
    numbers = ["1", "-2.5", "+.5", "7.", "1e-3", "1E5", "0.1234567890123456789", "1e999"]
    lines = [f"{one}{separator}{other}".replace(".", decimal) for one in numbers for other in numbers]
    assert plain_numbers(lines, separator, decimal, 2) is not None


def test_an_index_and_trailing_separators_of_a_long_template_are_passed_over() -> None:
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
