"""Decimal marks of columns: one for all numbers, and no number a thousand times too small."""

import io

import openpyxl
import pytest

from underskin.errors import InvalidInput
from underskin.prediction.csv_columns import from_csv
from underskin.recordings.reading import sheet_text

FIELDS = ("preload_n", "frf_pc_per_n")


def numbers(text: str) -> list[list[float]]:
    """The numbers of each field."""
    fields = from_csv(text.encode(), FIELDS).fields
    return [fields[name].numbers(name) for name in FIELDS]


@pytest.mark.parametrize(
    "text",
    [
        "preload_n\tfrf_pc_per_n\n0.5\t1200\n1\t7.5\n",
        "preload_n\tfrf_pc_per_n\n0,5\t1200\n1\t7,5\n",
        "preload_n;frf_pc_per_n\n0,5;1200,0\n1;7,500\n",
        "preload_n;frf_pc_per_n\n0.5;1.2e3\n1;7.5\n",
        'preload_n,frf_pc_per_n\n"0,5",1200\n1,"7,5"\n',
        "sensor;preload_n;frf_pc_per_n\n3,1;0.5;1200\n3,2;1;7.5\n",  # a sensor's name decides nothing
    ],
)
def test_points_or_commas_are_the_decimal_mark(text: str) -> None:
    assert numbers(text) == [[0.5, 1.0], [1200.0, 7.5]]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("preload_n\tfrf_pc_per_n\n1,000\t7\n", "1,000 can be 1000 or 1.000: write it without a comma"),
        ("preload_n\tfrf_pc_per_n\n1,000\t7.5\n", "1,000 can be 1000 or 1.000: write it without a comma"),
        ('preload_n,frf_pc_per_n\n"1,000",7.5\n', "1,000 can be 1000 or 1.000: write it without a comma"),
        ("preload_n;frf_pc_per_n\n0,5;7\n1.200;7\n", r"preload_n\[1\] = '1.200': must be a number \(line 3\)"),
        ("preload_n;frf_pc_per_n\n0,5;7.5\n", r"frf_pc_per_n\[0\] = '7.5': must be a number \(line 2\)"),
    ],
)
def test_a_number_that_may_have_its_thousands_apart_is_refused(text: str, says: str) -> None:
    with pytest.raises(InvalidInput, match=says):
        numbers(text)


def test_a_text_in_a_workbook_that_may_have_its_thousands_apart_is_refused() -> None:
    book, content = openpyxl.Workbook(), io.BytesIO()
    assert book.active is not None
    for row in (FIELDS, (0.5, "7,5"), (1, "1,000")):
        book.active.append(row)
    book.save(content)
    with pytest.raises(InvalidInput, match=r"frf_pc_per_n\[1\] = '1,000': .*1,000 can be 1000 or 1.000"):
        numbers(sheet_text(content.getvalue(), "measured.xlsx"))
