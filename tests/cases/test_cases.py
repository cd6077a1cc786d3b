"""Everyday measurements with known answers, from the folder that UNDERSKIN_CASES names."""

import os
from pathlib import Path

import pytest

from tests.cases.outcomes import Outcome, Right, report_in
from tests.cases.rows import ROWS
from tests.cli.commands import run

CASES = os.environ.get("UNDERSKIN_CASES")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CASES is None, reason="UNDERSKIN_CASES names no folder of cases"),
    pytest.mark.usefixtures("understood_here"),
]


def said(command: str, folder: str, given: str, output: Path | None = None) -> Outcome:
    """What `underskin COMMAND` says of the files of a row."""
    place = Path(CASES or "") / folder
    arguments = [str(place / part) if (place / part).is_file() else part for part in given.split()]
    more = [] if output is None else ["--output-dir", str(output)]
    answer = run(command, *arguments, *more, COLUMNS="200")
    names = (*arguments, *(Path(part).stem for part in arguments))
    return Outcome(answer.stdout + answer.stderr, names, {} if output is None else report_in(output))


@pytest.mark.parametrize(
    ("folder", "given", "right"), [pytest.param(*row[:3], id=f"{row[0]} {row[1]}") for row in ROWS if row[2]]
)
def test_d33(folder: str, given: str, right: Right) -> None:
    """`underskin d33` gives the right number, or says what is wrong."""
    assert right.departures(said("d33", folder, given)) == []


@pytest.mark.soak
@pytest.mark.parametrize(
    ("folder", "given", "right"), [pytest.param(*row[:2], row[3], id=f"{row[0]} {row[1]}") for row in ROWS if row[3]]
)
def test_diagnose(folder: str, given: str, right: Right, tmp_path: Path) -> None:
    """`underskin diagnose` states no false verdict or number."""
    assert right.departures(said("diagnose", folder, given, tmp_path)) == []
