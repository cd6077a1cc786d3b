"""Cells and lines of text files that would be lost or misread without a word: read as meant, or refused by place."""

import re

import pytest

from underskin.errors import FileError, InvalidInput
from underskin.recordings import Reading, read_contents, read_file
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.channels import Contents

HEADINGS = "id,sensor,indenter_radius_mm,preload_n,dynamic_force_n,frequency_hz,frf_re_pc_per_n,frf_im_pc_per_n\n"
ABOVE = """schema,campaign/1
name,palm 3
skin.thickness_mm,2.5
skin.youngs_modulus_mpa,16
skin.poisson_ratio,0.5
skin.sensor_radius_mm,1.5
sensor,s01,0,0

"""
ROWS = "r1,s01,4,1.0,0.09,10,7.1,-0.5\n,,,,,20,7.2,-0.6\n"
PLAIN = ABOVE + HEADINGS + ROWS


def read(text: str) -> Reading:
    return read_file(text.encode(), "a.csv")


def changed(old: str, new: str, text: str = PLAIN) -> str:
    assert old in text
    return text.replace(old, new, 1)


def refusal(text: str) -> FileError:
    with pytest.raises(FileError) as refused:
        read(text)
    return refused.value


@pytest.mark.parametrize(
    ("old", "new", "place", "reason"),
    [
        ("skin.thickness_mm,2.5", "skin.thickness_mm,2,5", "line 3, column 3", "'5' is a cell too many under"),
        ("name,palm 3", "name,palm 3, May", "line 2, column 3", "'May' is a cell too many under name"),
        ("sensor,s01,0,0", "sensor,s01,0,0,8", "line 7, column 5", "'8' is a cell too many under sensor"),
        ("sensor,s01,0,0", "sensor,s01,0,,5,0", "line 7, column 5", "'5' is a cell too many under sensor"),
        (",7.1,-0.5", ",7.1,-0.5,3", "line 10, column 9", "has 9 cells under 8 headings"),
        ("0.5\n", "0.5\nskin.thickness_mm,5\n", "line 6, column 1", "skin.thickness_mm is given on line 3 already"),
        ("0.5\n", "0.5\nskin.thickness [µm],2500\n", "line 6, column 1", "thickness_mm is given on line 3 already"),
        ("0.5\n", "0.5\nname,palm 4\n", "line 6, column 1", "name is given on line 2 already"),
        ("0.5\n", "0.5\nschema,campaign/1\n", "line 6, column 1", "schema is given on line 1 already"),
        ("name,palm 3\n", "name,a\nunits_checked,false\nunits_checked,true\n", "line 4", "units_checked is given on"),
        ("skin.youngs_modulus_mpa,16", 'skin.youngs_modulus_mpa,"16,000"', "line 4, column 2", "16000 or 16.000"),
        ('10,7.1', '"1,000",7.1', "line 10, column 6", "'1,000' can be 1000 or 1.000"),
        ("name,palm 3", 'name,"palm 3', "line 2", "in quotes must end on its line"),
        ("name,palm 3", 'name,"palm" 3', "line 2", "in quotes must end on its line"),
    ],
)  # fmt: skip
def test_what_would_be_lost_is_refused_by_line_and_column(old: str, new: str, place: str, reason: str) -> None:
    found = refusal(changed(old, new))
    assert found.place.startswith(place)
    assert reason in found.reason


def test_cells_in_quotes_hold_separators_and_quotes() -> None:
    quoted = changed("name,palm 3", 'name,"palm 3, ""May"""')
    assert read(quoted).campaign.name == 'palm 3, "May"'
    assert read(quoted.replace("preload_n", '"preload_n"')).campaign.recordings[0].id == "r1"


@pytest.mark.parametrize(
    "text",
    [
        PLAIN.replace(",", ";").replace(".", ",").replace("skin,", "skin."),
        PLAIN.replace(",", "\t").replace(".", ",").replace("skin,", "skin."),
        "\n".join(
            ",".join(f'"{cell.replace(".", ",")}"' if cell[-1:].isdigit() else cell for cell in line.split(","))
            for line in PLAIN.splitlines()
        ),
    ],
)
def test_decimal_commas_beside_other_separators_and_in_quotes(text: str) -> None:
    skin = read(text).campaign.skin
    assert (skin.thickness_mm, skin.poisson_ratio, skin.sensor_radius_mm) == (2.5, 0.5, 1.5)


def test_three_decimals_after_a_decimal_comma_are_no_thousands() -> None:
    semicolons = PLAIN.replace(",", ";").replace(".", ",").replace("skin,", "skin.")
    assert read(changed(";16\n", ";16,000\n", semicolons)).campaign.skin.youngs_modulus_mpa == 16
    tabs = PLAIN.replace(",", "\t")
    assert refusal(changed("\t16\n", "\t16,000\n", tabs)).place == "line 4, column 2"
    commas = tabs.replace(".", ",").replace("skin,", "skin.")
    assert read(changed("\t16\n", "\t16,000\n", commas)).campaign.skin.youngs_modulus_mpa == 16


def test_thousands_before_a_decimal_mark() -> None:
    """With a decimal mark behind them separated thousands leave no doubt, in either style."""
    semicolons = PLAIN.replace(",", ";").replace(".", ",").replace("skin,", "skin.")
    tabs = PLAIN.replace(",", "\t")
    for text, mark, cell in ((semicolons, ";", "16.016,25"), (tabs, "\t", "16,016.25")):
        in_kpa = changed(f"skin.youngs_modulus_mpa{mark}16\n", f"skin.youngs_modulus [kPa]{mark}{cell}\n", text)
        assert read(in_kpa).campaign.skin.youngs_modulus_mpa == pytest.approx(16.01625)
    for cell in ("1.01,25", "0.016,25", "016.016,25"):  # no thousands begin with 0
        with pytest.raises(InvalidInput, match=rf"'{re.escape(cell)}': must be a number"):
            read(changed(";16\n", f";{cell}\n", semicolons))


def test_a_decimal_point_among_decimal_commas_is_refused_with_what_is_written() -> None:
    semicolons = PLAIN.replace(",", ";").replace(".", ",").replace("skin,", "skin.")
    found = read(semicolons + "r2;s01;4;1.5;0,09;10;7,1;-0,5\n")
    assert [recording.id for recording in found.campaign.recordings] == ["r1"]
    (problem,) = found.problems
    assert (problem.recording, problem.field, problem.value) == ("r2", "preload_n", "1.5")
    assert "line 12, column 4; decimals of this file are written with a comma" in problem.allowed


def test_a_recording_that_begins_twice_is_refused() -> None:
    other = "r2,s01,4,2.0,0.09,10,7.1,-0.5\n"
    apart = refusal(PLAIN + other + "r1,,,,,40,7.1,-0.5\n")
    assert apart.place == "line 13, column 1"
    assert apart.reason == "recording 'r1' began on line 10 already"
    at_once = refusal(PLAIN + "r1,,,,,40,7.1,-0.5\n")
    assert at_once.place == "line 12, column 1"


@pytest.mark.parametrize("heading", ["preload_n", "position_x_mm"])
def test_a_value_that_changes_within_a_recording_is_refused(heading: str) -> None:
    headings = HEADINGS.replace("preload_n", "preload_n,position_x_mm,position_y_mm")
    table = ABOVE + headings + "r1,s01,4,1.0,0,0,0.09,10,7.1,-0.5\n{},20,7.2,-0.6\n"
    cells = {"preload_n": ",,,2,,,", "position_x_mm": ",,,,1,,"}
    found = refusal(table.format(cells[heading]))
    assert found.place == "line 11"
    assert found.reason.startswith(heading)
    (recording,) = read(table.format(",,,1,0,0,")).campaign.recordings
    assert isinstance(recording, FrfRecording)
    assert recording.position_mm == (0, 0)


def channels(text: str) -> Contents:
    found = read_contents(text.encode(), "run.csv")
    assert isinstance(found, Contents)
    return found


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ('a,b\n1,2\n2,3\n"1,000",4\n', "line 4"),
        ('a,b\n"1,000",4\n999,3\n998,2\n', "line 2"),
        ('a,"b\n1,2\n2,3\n', "line 1"),
        ('"1,5","2,5"\n"3,5","4,5"\n', ""),
    ],
)
def test_quoted_numbers_of_instruments_are_never_split(text: str, place: str) -> None:
    with pytest.raises(FileError) as refused:
        read_contents(text.encode(), "run.csv")
    assert refused.value.place == place
