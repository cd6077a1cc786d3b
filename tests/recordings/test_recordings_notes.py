"""Words under the table of a CSV template are a note, and those of a recording are not taken for one."""

import pytest

from tests.recordings.test_recordings_cells import PLAIN, ROWS, read
from tests.recordings.test_recordings_spreadsheets import same_as_plain


def test_a_note_under_the_table_is_left_out_and_told() -> None:
    reading = same_as_plain(PLAIN + "\nmeasured by mb\n")
    assert reading.warnings == ["line 13 under the table, 'measured by mb', is left out"]


@pytest.mark.parametrize(
    "note",
    [
        "\nmeasured in the cold room, air conditioning off",
        "measured in the cold room, air conditioning off",
        "\nby mb, in the cold room, air, conditioning, off, all, day, long, too",
        "by mb, in the cold room, air at 23 °C",
    ],
)
def test_words_with_separators_under_the_table_are_a_note(note: str) -> None:
    (warning,) = same_as_plain(f"{PLAIN}{note}\n").warnings
    assert warning == f"line {12 + note.count(chr(10))} under the table, {note.strip()!r}, is left out"


def test_words_between_recordings_are_not_taken_for_a_note() -> None:
    reading = read(PLAIN + "\nin the cold room, air off\n" + ROWS.replace("r1", "r2"))
    assert {problem.recording for problem in reading.problems} == {"in the cold room"}
    cut = read(PLAIN + "r2,s01,four\n")
    assert {problem.recording for problem in cut.problems} == {"r2"}
