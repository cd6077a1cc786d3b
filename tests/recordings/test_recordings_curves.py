"""Indentation curves from what instruments record: a stage's travel, a spring's deflection, several curves a file."""

from typing import Any

import numpy as np
import pytest

from underskin.errors import FileError, InvalidInput
from underskin.recordings import Reading, read_file, rig_description
from underskin.recordings.campaign import IndentationRecording

DEPTH_UM = np.concatenate([np.linspace(-0.5, 1.5, 9), np.linspace(1.25, -0.5, 8)])
FORCE_UN = np.where(DEPTH_UM > 0, 20 * np.abs(DEPTH_UM) ** 1.5, 0.0)
SPRING_N_PER_M = 50.0  # 1 um of deflection is 50 uN
DEFLECTION_UM = FORCE_UN / SPRING_N_PER_M
TRAVEL_UM = DEPTH_UM + DEFLECTION_UM

SPRING = {
    "displacement_mm": {"channel": "Piezo (um)", "deflection": {"channel": "Deflection (nm)"}},
    "force_n": {"channel": "Deflection (nm)", "spring_constant_n_per_m": SPRING_N_PER_M},
}
SIMPLE = {"displacement_mm": {"channel": "Depth (um)"}, "force_n": {"channel": "Force (uN)"}}


def table(columns: dict[str, Any], above: tuple[str, ...] = ()) -> str:
    rows = zip(*columns.values(), strict=True)
    return "\n".join([*above, ";".join(columns), *(";".join(f"{value:.9g}" for value in row) for row in rows), ""])


def read(text: str, channels: dict[str, Any], **more: Any) -> Reading:
    recording = {"indenter_radius_mm": 0.0075, **more.pop("recording", {})}
    common = {"schema": "rig/1", "kind": "indentation", "skin": {"poisson_ratio": 0.5}, "units_checked": True}
    document = {**common, "recording": recording, "channels": channels, **more}
    reading = read_file(text.encode(), "curve.txt", rig_description.from_dict(document))
    assert not reading.problems
    return reading


def the_curve(reading: Reading) -> IndentationRecording:
    (recording,) = reading.campaign.recordings
    assert isinstance(recording, IndentationRecording)
    assert recording.displacement_mm == pytest.approx(DEPTH_UM * 1e-3, abs=1e-9)
    assert recording.force_n == pytest.approx(FORCE_UN * 1e-6, abs=1e-12)
    return recording


RAW = {"Piezo (um)": TRAVEL_UM, "Deflection (nm)": 1e3 * DEFLECTION_UM}


def test_force_and_depth_from_travel_deflection_and_spring_constant() -> None:
    recording = the_curve(read(table(RAW), SPRING))
    assert recording.stage_stiffness_n_per_mm == pytest.approx(0.05)  # 50 N/m: contact that sticks comes off by it
    stated = the_curve(read(table(RAW), SPRING, recording={"stage_stiffness_n_per_mm": 0.2}))
    assert stated.stage_stiffness_n_per_mm == 0.2


def spring_from(name: str) -> dict[str, Any]:
    """The same channels, with the spring constant in a property of the file."""
    return {**SPRING, "force_n": {"channel": "Deflection (nm)", "spring_constant_n_per_m": {"property": name}}}


def test_the_file_may_state_the_spring_constant_in_a_unit_of_its_own() -> None:
    for name, value in (("k (N/m)", "50"), ("k [N/mm]", "0.05"), ("spring constant", "50")):
        the_curve(read(table(RAW, (f"{name};{value}", "")), spring_from(name)))
    with pytest.raises(FileError, match=r"property 'k \(N\)': its unit 'N' is not one of force/length, such as N/m"):
        read(table(RAW, ("k (N);50", "")), spring_from("k (N)"))
    with pytest.raises(FileError, match=r"property 'k': is 'soft': must be a number greater than 0"):
        read(table(RAW, ("k;soft", "")), spring_from("k"))


def test_travel_and_deflection_have_signs_and_sensitivities_of_their_own() -> None:
    """A height that falls when pressing, and a photodiode whose volts fall: 25 nm/V is 0.04 V/nm."""
    raw = {"Height (um)": -TRAVEL_UM, "Diode (V)": -1e3 * DEFLECTION_UM / 25}
    for sensitivity, unit in ((25, "nm/V"), (0.04, "V/nm")):
        diode = {"channel": "Diode (V)", "sign": -1, "sensitivity": sensitivity, "sensitivity_unit": unit}
        channels = {
            "displacement_mm": {"channel": "Height (um)", "sign": -1, "deflection": diode},
            "force_n": {**diode, "spring_constant_n_per_m": SPRING_N_PER_M},
        }
        the_curve(read(table(raw), channels))


def test_a_headings_wrong_unit_is_overridden_by_the_rig_that_names_it() -> None:
    """Its heading says nm and means um."""
    text = table({"Depth (nm)": DEPTH_UM, "Force (uN)": FORCE_UN})
    confirmed = read(text, {**SIMPLE, "displacement_mm": {"channel": "Depth (nm)", "unit": "um"}})
    the_curve(confirmed)
    said = "channel 'Depth (nm)' is labelled 'nm', but the rig description says 'um', whose units_checked confirms it"
    assert confirmed.warnings == [said]
    known = {**SIMPLE, "displacement_mm": {"channel": "Depth (nm)", "unit": "um", "labelled": "nm"}}
    reading = read(text, known)
    the_curve(reading)
    assert reading.warnings == ["channel 'Depth (nm)' is labelled 'nm'; the rig description says 'um'"]
    odd = text.replace("Depth (nm)", "Depth (measured)")
    assert read(odd, {**SIMPLE, "displacement_mm": {"channel": "Depth (measured)", "unit": "um"}}).warnings == []


ONE = {"Depth (um)": DEPTH_UM, "Force (uN)": FORCE_UN}
LINES = table(ONE).splitlines()


def each_is_the_curve(reading: Reading, ids: list[str]) -> None:
    assert [one.id for one in reading.campaign.recordings] == ids
    for one in reading.campaign.recordings:
        the_curve(Reading(type(reading.campaign)("x", reading.campaign.skin, (one,)), [], []))


def test_curves_apart_by_blank_lines_are_so_many_recordings_where_the_rig_says_so() -> None:
    text = "\n".join([LINES[0], *LINES[1:], "", *LINES[1:], "", *LINES[1:]])
    reading = read(text, SIMPLE, curves="groups")
    each_is_the_curve(reading, ["curve 1", "curve 2", "curve 3"])
    assert reading.warnings == []
    (whole,) = read(text, SIMPLE, curves="file").campaign.recordings
    assert isinstance(whole, IndentationRecording)
    assert len(whole.force_n) == 3 * len(FORCE_UN)
    unsaid = read(text, SIMPLE)
    assert len(unsaid.campaign.recordings) == 1
    assert "3 groups of rows" in unsaid.warnings[0]
    assert "say curves: groups" in unsaid.warnings[0]


def test_curves_under_headings_of_their_own_are_recordings_and_may_be_one() -> None:
    text = "\n".join(line for point in ("p1", "p2") for line in (f"Point;{point}", *LINES, ""))
    recording = {"id": {"property": "Point"}}
    each_is_the_curve(read(text, SIMPLE, recording=recording), ["p1", "p2"])
    halves = "\n".join([*LINES[:10], "", "Back", LINES[0], *LINES[10:]])
    assert len(read(halves, SIMPLE).campaign.recordings) == 2
    the_curve(read(halves, SIMPLE, curves="file"))


def test_a_channel_may_tell_curves_or_segments_apart() -> None:
    length = len(DEPTH_UM)
    twice = {name: np.tile(values, 2) for name, values in ONE.items()}
    numbered = table({"Cycle": np.repeat([4.0, 7.0], length), **twice})
    each_is_the_curve(read(numbered, SIMPLE, curves={"channel": "Cycle"}), ["curve 4", "curve 7"])
    segments = np.tile(np.repeat([0.0, 1.0], [9, length - 9]), 2)
    by_segment = table({"Segment": segments, **twice})
    each_is_the_curve(read(by_segment, SIMPLE, curves={"segments": "Segment"}), ["curve 1", "curve 2"])
    with pytest.raises(FileError, match=r"channel 'Force \(uN\)': changes \d+ times in 34 samples: it must tell"):
        read(by_segment, SIMPLE, curves={"channel": "Force (uN)"})
    with pytest.raises(FileError, match="no part holds all channels that the rig description names: it lacks Cycle"):
        read(by_segment, SIMPLE, curves={"channel": "Cycle"})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"curves": "rows"}, r"curves = 'rows': must be one of file, groups, \{channel: NAME\}"),
        ({"curves": {}}, "curves.*must name either a channel or segments"),
        ({"curves": {"channel": "a", "segments": "b"}}, "must name either a channel or segments"),
        ({"force_n": {"channel": "F", "deflection": {"channel": "d"}}}, "force_n.deflection.*is for displacement_mm"),
        (
            {"displacement_mm": {"channel": "z", "spring_constant_n_per_m": 3}},
            "displacement_mm.spring_constant_n_per_m = 3.0: is for force_n",
        ),
        (
            {"displacement_mm": {"channel": "z", "stiffness_n_per_mm": 3, "deflection": {"channel": "d"}}},
            "must not be given with a deflection",
        ),
        ({"displacement_mm": {"channel": "z", "deflection": {"channel": "d", "k": 3}}}, r"deflection\.k = 3: unknown"),
        (
            {"displacement_mm": {"channel": "z", "deflection": {"channel": "d", "sensitivity": 3}}},
            "displacement_mm.deflection.sensitivity = 3.0: needs a sensitivity_unit",
        ),
        ({"force_n": {"channel": "F", "spring_constant_n_per_m": 0}}, "must be greater than 0"),
    ],
)
def test_a_rig_that_contradicts_itself_is_refused_by_field(change: dict[str, Any], message: str) -> None:
    curves = {"curves": change.pop("curves")} if "curves" in change else {}
    with pytest.raises(InvalidInput, match=message):
        read(table(ONE), {**SIMPLE, **change}, **curves)
