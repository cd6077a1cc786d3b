"""Decimal marks of columns: one for all numbers, and no number a thousand times too small."""

import pytest

from underskin.errors import InvalidInput
from underskin.prediction.columns import CsvError, from_csv

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
        (
            "preload_n,frf_pc_per_n\n1,x\n2,7\n3,y\n",
            r"\[0\] = 'x': must be a number \(line 2, and 1 more in this column\)",
        ),
        ("preload_n;frf_pc_per_n\n0,5;7.5\n", r"frf_pc_per_n\[0\] = '7.5': must be a number \(line 2\)"),
    ],
)
def test_a_number_that_may_have_its_thousands_apart_is_refused(text: str, says: str) -> None:
    with pytest.raises(InvalidInput, match=says):
        numbers(text)


@pytest.mark.parametrize(
    ("headings", "phase"),
    [
        ("frf_magnitude_pc_per_n,frf_phase_deg", "60"),
        ("frf_magnitude_pc_per_n,FRF phase [rad]", "1.0471975511965976"),
        ("FRF magnitude [pC/N],Phase [deg]", "60"),
        ("FRF magnitude [pC/N],phase [°]", "60"),
        ("frf_magnitude_pc_per_n,frf_phase", "60"),
    ],
)
def test_magnitude_and_phase_are_taken_as_the_real_part(headings: str, phase: str) -> None:
    found = from_csv(f"preload_n,{headings}\n1,7,{phase}\n".encode(), FIELDS)
    assert found.fields["frf_pc_per_n"].numbers("frf_pc_per_n") == pytest.approx([3.5])
    assert found.unknown == {}
    assert "the real part is taken as frf_pc_per_n" in found.notes[-1]
    unnamed = from_csv(f"preload_n,{headings}\n1,7,{phase}\n".encode(), ("preload_n",))
    assert "frf_pc_per_n" not in unnamed.fields


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("frf_magnitude_pc_per_n\n7\n", "needs frf_phase_deg or frf_phase_rad with it"),
        ("frf_phase_deg\n7\n", "needs frf_magnitude_pc_per_n with it"),
        (
            "frf_magnitude_pc_per_n,frf_phase\n7,1\n",
            "may be degrees or radians: call it frf_phase_deg or frf_phase_rad",
        ),
        ("frf_magnitude_pc_per_n,frf_phase_deg,frf_pc_per_n\n7,1,7\n", "its header has 'frf_pc_per_n' twice"),
        ("frf_magnitude_pc_per_n,frf_phase_deg,FRF phase [°]\n7,1,7\n", "its header has 'frf_phase_rad' twice"),
    ],
)
def test_magnitude_and_phase_that_are_not_clear_are_refused(text: str, says: str) -> None:
    with pytest.raises(CsvError, match=says):
        from_csv(text.encode(), FIELDS)


@pytest.mark.parametrize("row", ['"0,5"', '"a,b"'])
def test_separators_in_quotes_part_no_cells(row: str) -> None:
    """A row of one quoted cell under two headings is too short, though the cell holds a separator."""
    with pytest.raises(CsvError, match="1 on line 2, 2 in the header"):
        numbers(f"preload_n,frf_pc_per_n\n{row}\n1,7.5\n")
    assert numbers("preload_n,frf_pc_per_n,\n0.5,1200\n1,7.5,,\n") == [[0.5, 1.0], [1200.0, 7.5]]
