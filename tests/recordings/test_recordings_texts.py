"""Text tables as instruments write them: what is above the numbers, what is between them, how they are separated."""

import numpy as np
import pytest

from tests.recordings.contents_of_files import contents
from underskin.errors import FileError
from underskin.recordings import read_contents, read_file, rig_description
from underskin.recordings.campaign import CompressionRecording
from underskin.recordings.channels import Contents
from underskin.recordings.rig_description import Property, spring_constant

DEPTH = np.concatenate([np.linspace(-0.5, 1.5, 9), np.linspace(1.25, -0.5, 8)])
FORCE = np.where(DEPTH > 0, 0.25 * np.abs(DEPTH) ** 1.5, 0.0).round(6)


def rows(separator: str, decimal: str = ".", extra: str = "", part: slice = slice(None)) -> list[str]:
    """The curve, a line a sample, with cells more at its end."""
    numbers = [f"{depth:.4f}{separator}{force:.6f}" for depth, force in zip(DEPTH[part], FORCE[part], strict=True)]
    return [line.replace(".", decimal) + extra for line in numbers]


BOTH = [("Depth", "um"), ("Force", "mN")]
LABELLED = [("Depth (um)", "um"), ("Force (mN)", "mN")]

TEXTS = {
    "labview, names above the end of the header": (
        ["Operator\tmb", "Depth (um)\tForce (mN)", "Date\t2025/05/12", "***End_of_Header***", *rows("\t")],
        LABELLED,
    ),
    "a marker between names and numbers": (["Version 4", "Depth (um)\tForce (mN)", "eoh", *rows("\t")], LABELLED),
    "a marker under the units": (["Version 4", "Depth;Force", "um;mN", "eoh", *rows(";")], BOTH),
    "units in brackets under the names": (["TriboScan", "Depth\tForce", "(um)\t(mN)", "", *rows("\t")], BOTH),
    "decimal commas and semicolons": (
        ["Prüfer;Müller", "Depth / um;Force / mN", *rows(";", ",")],
        [("Depth / um", "um"), ("Force / mN", "mN")],
    ),
    "blanks, one in each name": (["Indentation of PDMS", "Depth (um) Force (mN)", *rows(" ")], LABELLED),
    "blanks, two between names": (["PDMS, 10:1", "Depth (um)   Force (mN)", *rows("   ")], LABELLED),
    "blanks and decimal commas": (
        ["Depth[um] Force[mN]", *rows(" ", ",")],
        [("Depth[um]", "um"), ("Force[mN]", "mN")],
    ),
    "comments as a header": (
        [
            "# JPK export",
            "# columns: height vDeflection",
            '# fancyNames: "Depth" "Force"',
            "# units: um mN",
            *rows(" "),
        ],
        BOTH,
    ),
    "names in a comment": (["% Depth (um), Force (mN)", *rows(", ")], LABELLED),
    "labelled lines of names and units": (["Names: Depth, Force", "Units: um, mN", *rows(",")], BOTH),
    "an empty last column": (["Depth (um);Force (mN);", *rows(";", extra=";")], LABELLED),
    "a section's name in brackets first": (["[Header]", "Depth (um),Force (mN)", *rows(",")], LABELLED),
    "numbers in the header": (
        ["Scan\t1\tX\t2", "k (N/m)\t0.019", "", "Depth (um)\tForce (mN)", *rows("\t")],
        LABELLED,
    ),
}


def the_curve(found: Contents, names: list[tuple[str, str]]) -> None:
    (block,) = found.blocks
    assert [(one.name, one.unit) for one in block.channels] == names
    depth, force = block.channels
    assert depth.values == pytest.approx(DEPTH)
    assert force.values == pytest.approx(FORCE)


@pytest.mark.parametrize("ends", ["\n", "\r\n", "\r", "\r\r\n"], ids=["LF", "CRLF", "CR", "CRCRLF"])
@pytest.mark.parametrize("what", TEXTS)
def test_names_units_and_numbers_are_found(what: str, ends: str) -> None:
    lines, names = TEXTS[what]
    the_curve(contents(ends.join(lines).encode(), "curve.txt"), names)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_a_byte_order_mark_is_no_part_of_a_name(encoding: str) -> None:
    lines = ["Depth (µm)\tForce (mN)", *rows("\t")]
    the_curve(contents("\r".join(lines).encode(encoding), "curve.txt"), [("Depth (µm)", "µm"), LABELLED[1]])


@pytest.mark.parametrize("cells", [("mb", "mb"), ("begin", ""), ("12:00:01", "12:00:02")])
@pytest.mark.parametrize("place", ["first", "last"])
def test_columns_of_text_are_left_out_with_a_warning(cells: tuple[str, str], place: str) -> None:
    said = [cells[0], *[cells[1]] * (len(DEPTH) - 1)]
    names = "Depth (um);Force (mN)"
    lines = [f"Note;{names}" if place == "first" else f"{names};Note"]
    lines += [
        f"{note};{row}" if place == "first" else f"{row};{note}" for note, row in zip(said, rows(";"), strict=True)
    ]
    found = contents("\n".join(lines).encode(), "curve.txt")
    the_curve(found, LABELLED)
    rig = rig_description.from_dict(
        {
            "schema": "rig/1",
            "kind": "indentation",
            "units_checked": True,
            "skin": {"poisson_ratio": 0.5},
            "recording": {"indenter_radius_mm": 1},
            "channels": {"displacement_mm": {"channel": "Depth"}, "force_n": {"channel": "Force"}},
        }
    )
    warnings = read_file("\n".join(lines).encode(), "curve.txt", rig).warnings
    assert f"column 'Note' holds text, such as {cells[0]!r}, and is left out" in warnings


def test_text_among_a_columns_numbers_is_refused_by_line() -> None:
    lines = ["Time;Depth (um);Force (mN)", *(f"{number};{row}" for number, row in enumerate(rows(";")))]
    for place in (5, 12):
        wrong = [*lines[:place], "x" + lines[place], *lines[place + 1 :]]
        with pytest.raises(FileError, match=rf"line {place + 1}: must be a row of 3 numbers.*found 'x{place - 1};"):
            read_contents("\n".join(wrong).encode(), "curve.txt")


def test_comments_may_part_the_rows_and_state_properties() -> None:
    there, back = slice(9), slice(9, None)
    lines = ["# springConstant: 0.05", "# k (N/m) = 3", "# segment: extend", "# columns: Depth Force", "# units: um mN"]
    text = [*lines, *rows(" ", part=there), "", "# segment: retract", *lines[3:], *rows(" ", part=back)]
    found = contents("\n".join(text).encode(), "curve.txt")
    the_curve(found, BOTH)
    assert found.blocks[0].group_starts == (0, 9)
    assert found.properties["springConstant"] == "0.05"
    assert found.properties["k (N/m)"] == "3"


@pytest.mark.parametrize(("separator", "decimal"), [("\t", "."), ("\t", ","), (";", ","), (" ", "."), (",", ".")])
@pytest.mark.parametrize(
    ("line", "name"),
    [
        ("Spring constant (N/m){separator}3{decimal}5", "Spring constant (N/m)"),
        ("Spring constant (N/m): 3{decimal}5", "Spring constant (N/m)"),
        ("# k=3{decimal}5 N/m", "k (N/m)"),
        ("Spring constant: 3{decimal}5 N/m", "Spring constant (N/m)"),
        ("Spring constant{separator}3{decimal}5{separator}N/m", "Spring constant (N/m)"),
    ],
)
def test_a_spring_constant_above_the_numbers_is_a_property(line: str, name: str, separator: str, decimal: str) -> None:
    if separator == " " and "{separator}" in line:
        line = line.replace("{separator}", ": ", 1).replace("{separator}", " ")
    stated = line.format(separator=separator, decimal=decimal)
    text = [f"Sample{separator}PDMS", stated, "", f"Depth (um){separator}Force (mN)", *rows(separator, decimal)]
    found = contents("\n".join(text).encode(), "curve.txt")
    assert found.properties[name] == f"3{decimal}5"
    assert spring_constant(Property(name), found.properties, "curve.txt") == 3.5


def test_curves_under_headings_of_their_own_are_parts() -> None:
    text = [line for name in ("a", "b") for line in (f"Curve;{name}", "Depth (um);Force (mN)", *rows(";"), "")]
    found = contents("\n".join(text).encode(), "curves.txt")
    assert [block.name for block in found.blocks] == ["1", "2"]
    assert found.properties == {"Curve": "a", "1.Curve": "a", "2.Curve": "b"}
    for block in found.blocks:
        the_curve(Contents((block,)), LABELLED)


@pytest.mark.parametrize(
    ("line", "stiffness"),
    [("k (N/mm): 50", 50.0), ("k (N/m): 50000", 50.0), ("k: 50", 50.0), ("Rahmensteifigkeit [kN/mm];0,05", 50.0)],
)
def test_a_machine_states_its_stiffness(line: str, stiffness: float) -> None:
    """The force over the stiffness that the file states is taken off the displacement."""
    rig = rig_description.from_dict(
        {
            "schema": "rig/1",
            "kind": "compression",
            "skin": {"poisson_ratio": 0.5},
            "recording": {"sample_height_mm": 10, "sample_diameter_mm": 10},
            "channels": {
                "displacement_mm": {
                    "channel": "Travel",
                    "stiffness_n_per_mm": {"property": line.replace(";", ":").partition(":")[0]},
                },
                "force_n": {"channel": "Force"},
            },
        }
    )
    text = f"{line}\n\nTravel [mm];Force [N]\n" + "".join(
        f"{0.1 * row:.1f};{row}\n".replace(".", ",") for row in range(9)
    )
    (recording,) = read_file(text.encode(), "block.csv", rig).campaign.recordings
    assert isinstance(recording, CompressionRecording)
    assert recording.displacement_mm == pytest.approx(np.arange(9) * (0.1 - 1 / stiffness))
