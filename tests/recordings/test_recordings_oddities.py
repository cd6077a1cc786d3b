"""Text files and rig descriptions at the edge: what is read all the same, and what is refused and why."""

import pytest

from tests.support.instrument_files import COMMON, rig
from underskin.errors import FileError
from underskin.recordings import Reading, read_contents, read_file
from underskin.recordings.channels import Contents

CURVES = "schema,campaign/1\nname,x\nskin.poisson_ratio,0.5\n\n"


def wide_then_narrow(width: int, header: str = "") -> bytes:
    """An LVM file of one wide row, then as many rows of one cell."""
    head = [
        "LabVIEW Measurement",
        "Separator\tTab",
        "X_Columns\tNo",
        "***End_of_Header***",
        f"Channels\t{width}",
        header,
    ]
    rows = ["\t" + "\t".join(["1"] * width), *["\t1"] * width]
    return "\n".join([*head, "***End_of_Header***", "X_Value", *rows]).encode()


def test_channels_that_few_rows_hold_cost_no_more_than_their_numbers() -> None:
    contents = read_contents(wide_then_narrow(10_000), "wide.lvm")
    assert isinstance(contents, Contents)
    lengths = [len(channel.values) for channel in contents.blocks[0].channels]
    assert lengths == [10_001] + 9_999 * [1]


def csv(table: str) -> Reading:
    return read_file((CURVES + table).encode(), "a.csv")


@pytest.mark.parametrize("again", ["force_n", "Force [kN]"])
def test_a_heading_that_comes_twice_is_refused(again: str) -> None:
    with pytest.raises(FileError, match=r"a\.csv: line 5, column 6: .* is a second column of force_n"):
        csv(f"id,kind,indenter_radius_mm,displacement_mm,force_n,{again}\nb,indentation,4,0,0,0\n,,,1,5,1\n")


def test_numbers_of_different_rows_are_never_taken_for_a_pair() -> None:
    table = "id,kind,indenter_radius_mm,displacement_mm,force_n\n"
    good = "a,indentation,4,0,0\n,,,1,5\n"
    reading = csv(f"{table}{good}b,indentation,4,0,\n,,,,0.5\n,,,1,\n,,,,1.5\n")
    assert [recording.id for recording in reading.campaign.recordings] == ["a"]
    assert [(problem.recording, problem.field, problem.value) for problem in reading.problems] == [
        ("b", "displacement_mm[1]", None),
        ("b", "force_n[0]", None),
    ]


def test_load_cycles_that_a_text_header_states_are_a_number() -> None:
    text = "cycles;1200\n\nforce;amplifier\nmN;V\n" + "\n".join(f"{n};{n}" for n in range(1, 6))
    described = rig(recording={**COMMON, "sample_rate_hz": 10, "load_cycles": {"property": "cycles"}})
    reading = read_file(text.encode(), "run.csv", described)
    assert not reading.problems
    assert [recording.load_cycles for recording in reading.campaign.recordings] == [1200]


def test_an_empty_file_is_said_to_be_empty() -> None:
    for name in ("monday.csv", "skin.h5"):
        with pytest.raises(FileError) as refusal:
            read_file(b"", name)
        assert str(refusal.value) == f"{name}: the file is empty (0 bytes)"


UNITS = """schema,campaign/1
name,x
skin.thickness [m],{}
skin.poisson_ratio,0.5
{}
id,kind,sample_height_mm,sample_diameter_mm,time_s,force_n,displacement_mm
c1,compression,5,20,0,0,0
,,,,1,1,0.1
,,,,2,2,0.2
"""


def test_a_unit_that_a_heading_says_and_its_value_contradicts_is_named_by_both() -> None:
    asked = r"^x\.csv: line 3: skin\.thickness \[m\] = 2\.5: 2\.5 m is 2500 mm: was 2\.5 mm meant\?"
    with pytest.raises(FileError, match=asked):
        read_file(UNITS.format("2.5", "").encode(), "x.csv")
    said = read_file(UNITS.format("2.5", "units_checked,true").encode(), "x.csv")
    right = read_file(UNITS.format("0.0025", "").encode(), "x.csv")
    assert isinstance(said, Reading)
    assert isinstance(right, Reading)
    assert [found.campaign.skin.thickness_mm for found in (said, right)] == [2500.0, 2.5]


def table(*last: str, ends: str = "\n", separator: str = ",") -> str:
    """Four columns of numbers, as an instrument writes them."""
    rows = [["0.001", "0.100", "-1.5e-03", number] for number in ("0.981", "0.972", "0.990", "0.952", *last)]
    return "time [s],force [N],charge [pC],coherence\n".replace(",", separator) + "\n".join(
        separator.join(row) for row in rows
    ) + ends  # fmt: skip


@pytest.mark.parametrize("cut", ["0.9", "0.", "0", "-0.9"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_a_last_number_that_may_be_cut_is_told(cut: str, encoding: str) -> None:
    contents = read_contents(table(cut, ends="").encode(encoding), "cut.csv")
    assert any(f"in {cut!r}, which has fewer digits" in warning for warning in contents.warnings)
    german = table(cut, ends="", separator=";").replace(".", ",").encode(encoding)
    assert any("it may be cut there" in warning for warning in read_contents(german, "cut.csv").warnings)


@pytest.mark.parametrize(
    "text", [table("0.9"), table("0.961", ends=""), table("0.9").replace("0.952", "1") + "0,0,0,1"]
)
def test_a_file_that_ends_with_a_line_or_a_whole_number_is_not_said_to_be_cut(text: str) -> None:
    assert not any("cut" in warning for warning in read_contents(text.encode(), "whole.csv").warnings)


def test_an_exponent_that_may_be_cut_is_told_in_the_template_too() -> None:
    above = "schema,campaign/1\nname,x\nskin.poisson_ratio,0.5\n\nid,frequency_hz,frf_re_pc_per_n,frf_im_pc_per_n\n"
    rows = "".join(f"{'r1' if number == 1 else ''},{number}.5,7.1e+00,-1.5e-01\n" for number in range(1, 6))
    cut = above + rows + ",6.5,7.1e+00,-1.5e-0"
    assert any("'-1.5e-0'" in warning for warning in read_contents(cut.encode(), "cut.csv").warnings)
    assert read_contents((above + rows).encode(), "whole.csv").warnings == ()
