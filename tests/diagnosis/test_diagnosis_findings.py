"""Bad input by name: what is wrong with recordings themselves is found before physics is blamed for it."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import underskin
from tests.support.cases import first
from tests.support.diagnosis_campaigns import Made, added, campaign
from tests.support.slip_campaigns import MADE, looked_at
from underskin.recordings.campaign import Campaign, FrfRecording, frf_recordings, from_dict, to_dict
from underskin.recordings.reading import Reading
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Complexes, Floats

LINES = ("frf_re_pc_per_n", "frf_im_pc_per_n")
Which = Callable[[FrfRecording], bool]
Change = Callable[[FrfRecording], FrfRecording]


@pytest.fixture(scope="module")
def good(table: SigmaTable) -> Campaign:
    return campaign(MADE, table)


def noise(size: float) -> Change:
    random = np.random.default_rng(5)

    def change(entry: FrfRecording) -> FrfRecording:
        re, im = size * random.normal(size=(2, MADE.lines))
        return replace(entry, frf_re_pc_per_n=re, frf_im_pc_per_n=im)

    return change


def times(factor: float, *fields: str) -> Change:
    def change(entry: FrfRecording) -> FrfRecording:
        return replace(entry, **{name: factor * getattr(entry, name) for name in fields})

    return change


def away(times_as_far: float) -> Change:
    def change(entry: FrfRecording) -> FrfRecording:
        assert entry.position_mm is not None
        x, y = entry.position_mm
        return replace(entry, position_mm=(times_as_far * x, times_as_far * y))

    return change


def changed(good: Campaign, change: Change, which: Which) -> Campaign:
    entries = frf_recordings(good)
    return replace(good, recordings=tuple(change(entry) if which(entry) else entry for entry in entries))


def of_all(entry: FrfRecording) -> bool:
    return entry.id != ""


def of_r3(entry: FrfRecording) -> bool:
    return entry.id == "r3"


def of_r9(entry: FrfRecording) -> bool:
    return entry.id == "r9"


def of_s1(entry: FrfRecording) -> bool:
    return entry.sensor == "s1"


def codes(report: dict[str, Any]) -> set[tuple[str, str, str]]:
    told = [entry for entry in report["findings"] if entry["code"] != "constant_axis"]
    return {(entry["code"], entry["recording"], entry["field"]) for entry in told}


ONE = [
    (noise(1e-2), of_s1, ("no_response", "", "frf_re_pc_per_n"), 1.0),
    (times(1e-3, "dynamic_force_n"), of_all, ("units_off_by_1000", "", "dynamic_force_n"), 1.0),
    (times(1e-3, *LINES), of_all, ("units_off_by_1000", "", "frf_re_pc_per_n"), 1e-3),
    (times(1000.0, "preload_n"), of_r3, ("units_off_by_1000", "r3", "preload_n"), 1.0),
    (times(1000.0, "dynamic_force_n"), of_r3, ("units_off_by_1000", "r3", "dynamic_force_n"), 1.0),
    (times(1000.0, "frequency_hz"), of_r3, ("units_off_by_1000", "r3", "frequency_hz"), 1.0),
    (times(1e-3, "indenter_radius_mm"), of_r3, ("units_off_by_1000", "r3", "indenter_radius_mm"), 1.0),
    (away(1e3), of_r9, ("units_off_by_1000", "r9", "position_mm"), 1.0),
    (times(1000.0, *LINES), of_r3, ("units_off_by_1000", "r3", "frf_re_pc_per_n"), 1.0),
    (times(-1.0, *LINES), of_r3, ("sign_flipped", "r3", "frf_re_pc_per_n"), 1.0),
    (times(0.0, *LINES), of_r3, ("no_response", "r3", "frf_re_pc_per_n"), 1.0),
    (times(np.nan, *LINES), of_r3, ("no_finite_line", "r3", "frf_re_pc_per_n"), 1.0),
    (noise(1e-2), of_r3, ("no_response", "r3", "frf_re_pc_per_n"), 1.0),
    (times(1e-3, "preload_n"), of_r3, ("units_off_by_1000", "r3", "preload_n"), 1.0),
    (away(1e-3), of_r9, ("units_off_by_1000", "r9", "position_mm"), 1.0),
    (times(1000.0, *LINES), of_s1, ("units_off_by_1000", "r8", "frf_re_pc_per_n"), 1.0),
    (times(1e-3, *LINES), of_r3, ("units_off_by_1000", "r3", "frf_re_pc_per_n"), 1.0),
]


@pytest.mark.slow
@pytest.mark.parametrize(("change", "which", "finding", "scale"), first(9, ONE))
def test_what_is_wrong_is_named_and_does_not_count(
    change: Change, which: Which, finding: tuple[str, str, str], scale: float, good: Campaign, table: SigmaTable
) -> None:
    """The rest agrees with the model, at the d33 that it has without; of lines a thousandth, at a thousandth of it."""
    report = looked_at(changed(good, change, which), table)
    assert finding in codes(report)
    assert {code for code, _, _ in codes(report)} - {"implausible_d33"} == {finding[0]}
    assert report["verdict"] == "no_mismatch"
    assert report["d33"]["low"] < 15.0 * scale < report["d33"]["high"]


ALL = [
    (noise(1e-3), "no_response", "frf_re_pc_per_n"),
    (noise(30.0), "no_response", "frf_re_pc_per_n"),
    (times(np.nan, *LINES), "no_finite_line", "frf_re_pc_per_n"),
    (times(1e-3, "preload_n"), "units_off_by_1000", "preload_n"),
    (times(1000.0, "preload_n"), "units_off_by_1000", "preload_n"),
    (times(1000.0, "frequency_hz"), "units_off_by_1000", "frequency_hz"),
    (times(1e-3, "frequency_hz"), "units_off_by_1000", "frequency_hz"),
    (times(1000.0, "dynamic_force_n"), "units_off_by_1000", "dynamic_force_n"),
    (away(1e-3), "units_off_by_1000", "position_mm"),
    (away(1e3), "units_off_by_1000", "position_mm"),
    (times(600.0, "preload_n"), "units_off_by_1000", "preload_n"),
    (times(1000.0, "indenter_radius_mm"), "units_off_by_1000", "indenter_radius_mm"),
]


@pytest.mark.parametrize(("change", "code", "field"), ALL)
def test_where_all_is_wrong_nothing_is_concluded(
    change: Change, code: str, field: str, good: Campaign, table: SigmaTable
) -> None:
    report = looked_at(changed(good, change, of_all), table)
    assert report["verdict"] == "insufficient_data"
    assert report["mechanisms"] == []
    assert (code, field) in {(code, field) for code, _, field in codes(report)}


@pytest.mark.parametrize(
    ("sensor_radius_mm", "thickness_mm", "field"),
    [(15.0, 2.0, "skin.sensor_radius_mm"), (1.0, 0.2, "skin.thickness_mm")],
)
def test_impossible_geometry_is_named(
    sensor_radius_mm: float, thickness_mm: float, field: str, good: Campaign, table: SigmaTable
) -> None:
    skin = replace(good.skin, sensor_radius_mm=sensor_radius_mm, thickness_mm=thickness_mm)
    report = looked_at(replace(good, skin=skin), table)
    assert report["verdict"] == "insufficient_data"
    (told,) = (entry for entry in report["findings"] if entry["code"] == "impossible_geometry")
    assert told["field"] == field
    assert told["statement"][1:] in report["statement"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "factor"),
    first(
        2,
        [("youngs_modulus_mpa", 1e3), ("sensor_radius_mm", 1e-3), ("youngs_modulus_mpa", 1e-3), ("thickness_mm", 1e3)],
    ),
)
def test_skin_units_named_tells_nothing(name: str, factor: float, good: Campaign, table: SigmaTable) -> None:
    """A skin in other units is named and tells nothing.

    Also where the units are said to be checked, so that the diagnosis goes on.
    """
    wrong = replace(good, skin=replace(good.skin, **{name: factor * getattr(good.skin, name)}))
    report = looked_at(wrong, table)
    assert report["verdict"] == "insufficient_data"
    assert ("units_off_by_1000", "", f"skin.{name}") in codes(report)
    assert "units_checked" in report["statement"]
    meant = looked_at(replace(wrong, units_checked=True), table)
    assert ("units_off_by_1000", "", f"skin.{name}") in codes(meant)
    assert "units_checked" not in meant["statement"]


@pytest.mark.slow
def test_units_that_were_checked_are_believed(good: Campaign, table: SigmaTable) -> None:
    slow = replace(changed(good, times(1e-3, "frequency_hz"), of_all), units_checked=True)
    assert looked_at(slow, table)["verdict"] == "no_mismatch"
    stiff = replace(good, skin=replace(good.skin, youngs_modulus_mpa=3000.0), units_checked=True)
    report = looked_at(stiff, table)
    assert report["verdict"] != "insufficient_data"
    told = {(entry["code"], entry["field"]): entry["statement"] for entry in report["findings"]}
    assert "kPa" in told["units_off_by_1000", "skin.youngs_modulus_mpa"]


@pytest.mark.parametrize("factor", [1e3, 1e-3])
def test_sensors_in_other_units_are_named(factor: float, good: Campaign, table: SigmaTable) -> None:
    sensors = tuple(
        replace(sensor, x_mm=factor * sensor.x_mm, y_mm=factor * sensor.y_mm) for sensor in good.skin.sensors
    )
    wrong = replace(changed(good, away(factor), of_all), skin=replace(good.skin, sensors=sensors))
    report = looked_at(wrong, table)
    assert report["verdict"] == "insufficient_data"
    assert {field for _, _, field in codes(report)} <= {"skin.sensors", "skin.sensor_radius_mm"}


def test_offsets_in_metres_at_the_only_sensor_are_named(table: SigmaTable) -> None:
    made = campaign(Made(sensors=1, offsets_mm=(0.0, 1.0, 2.0), lines=8), table)
    report = looked_at(changed(made, away(1e-3), of_all), table)
    assert ("units_off_by_1000", "", "position_mm") in codes(report)
    assert report["verdict"] == "insufficient_data"


def test_recordings_that_were_all_refused_are_said_to_be(good: Campaign, table: SigmaTable) -> None:
    document = to_dict(changed(good, times(1e3, "indenter_radius_mm"), of_all))
    read, refused = from_dict(document)
    report = underskin.diagnose(Reading(read, refused, []), table)
    assert report.verdict == "insufficient_data"
    assert f"{len(good.recordings)} recording(s) were refused for their indenter_radius_mm" in report.statement


@pytest.mark.slow
def test_copies_are_found_through_rounding(good: Campaign, table: SigmaTable) -> None:
    copies = changed(good, times(1 + 1e-6, *LINES), of_all).recordings[:4]
    whole = replace(good, recordings=(*good.recordings, *(replace(entry, id=f"{entry.id} copy") for entry in copies)))
    report = looked_at(whole, table)
    assert codes(report) == {("duplicated_recording", f"r{number} copy", "frf_re_pc_per_n") for number in range(4)}
    assert report["d33"] == looked_at(good, table)["d33"]


def test_recordings_made_alike_at_one_frequency_tell_nothing(table: SigmaTable) -> None:
    alike = campaign(Made(sensors=1, preloads_n=(1.0,), spheres_mm=(4.0,), repeats=6, lines=1), table)
    entries = [replace(entry, load_cycles=1, dwell_s=1.0, recorded_at=None) for entry in alike.recordings]
    report = looked_at(replace(alike, recordings=tuple(entries)), table)
    assert report["verdict"] == "insufficient_data"
    assert "made alike" in report["statement"]


@pytest.mark.parametrize("factor", [1e3, -1.0])
def test_of_three_recordings_the_one_that_is_off_is_named_and_of_two_neither(factor: float, table: SigmaTable) -> None:
    made = campaign(Made(sensors=1, spheres_mm=(4.0,), preloads_n=(0.5, 1.0, 2.0)), table)
    wrong = changed(made, times(factor, *LINES), lambda entry: entry.id == "r1")
    code = "units_off_by_1000" if factor > 0 else "sign_flipped"
    assert codes(looked_at(wrong, table)) == {(code, "r1", "frf_re_pc_per_n")}
    of_two = looked_at(replace(wrong, recordings=wrong.recordings[:2]), table)
    assert codes(of_two) == {(code, "", "frf_re_pc_per_n")}
    assert of_two["verdict"] == "insufficient_data"


@pytest.mark.slow
def test_a_period_that_does_not_fit_between_recordings_is_named(good: Campaign, table: SigmaTable) -> None:
    """From 0.03 to 3.9 Hz is no impossible sweep, but not one in 20 s."""

    def dated(entry: FrfRecording) -> FrfRecording:
        number = int(entry.id[1:])
        return replace(entry, recorded_at=f"2020-01-01T10:{number // 3:02d}:{20 * (number % 3):02d}Z")

    slow = changed(good, times(0.03, "frequency_hz"), of_all)
    assert codes(looked_at(slow, table)) == set()
    report = looked_at(changed(slow, dated, of_all), table)
    assert codes(report) == {("units_off_by_1000", "", "frequency_hz")}
    assert "20 s" in report["statement"]
    assert report["verdict"] == "insufficient_data"


@pytest.mark.slow
def test_a_reversed_recording_is_told_beside_a_resonance(table: SigmaTable) -> None:
    """Few lines over a resonance differ as much as noise would, and their mean cancels: they are no silence."""
    made = Made(("contact_resonance",), (6.0, 0.05), highest_hz=1000.0, lines=20, modulus_mpa=16.0)
    for parameters in ((30.0, 0.05), (6.0, 0.02)):
        resonant = campaign(replace(made, parameters=parameters), table)
        report = looked_at(changed(resonant, times(-1.0, *LINES), of_r3), table)
        of_recordings = {entry for entry in codes(report) if entry[0] in ("sign_flipped", "no_response")}
        assert of_recordings == {("sign_flipped", "r3", "frf_re_pc_per_n")}


@pytest.mark.slow
def test_where_little_is_expected_silence_is_kept(table: SigmaTable) -> None:
    """Far beside the sensor the response is below the noise, as the model says: no sensor is dead, and such recordings
    are counted as those of far contacts."""
    far = campaign(Made(offsets_mm=(0.0, 5.5), lines=20, line=0.01), table)
    random = np.random.default_rng(2)

    def noise(real: Floats) -> Complexes:
        return np.asarray(0.05 * (random.normal(size=len(real)) + 1j * random.normal(size=len(real))))

    assert codes(looked_at(added(far, noise), table)) == {("far_contacts", "", "position_mm")}


@pytest.mark.slow
@pytest.mark.parametrize(("spread", "differs"), [(0.009, False), (0.02, True)])
def test_forces_within_a_percent_are_one_force(spread: float, differs: bool, good: Campaign, table: SigmaTable) -> None:
    """As a shaker without a closed loop gives them."""
    entries = frf_recordings(good)
    forces = entries[0].dynamic_force_n * np.linspace(1, 1 + spread, len(entries))
    varied = [replace(entry, dynamic_force_n=float(force)) for entry, force in zip(entries, forces, strict=True)]
    report = looked_at(replace(good, recordings=tuple(varied)), table)
    constant = {entry["field"] for entry in report["findings"] if entry["code"] == "constant_axis"}
    assert ("dynamic_force_n" in constant) is not differs
    assert ("dynamic_force_n" in {entry["axis"] for entry in report["location"]["axes"]}) is differs


@pytest.mark.slow
def test_bands_and_stamps_that_may_be_meant_are_no_slips(table: SigmaTable) -> None:
    """Three bands of one sensor; and three sensors recorded at once, saved one after the other."""
    three = campaign(Made(sensors=1, spheres_mm=(4.0,), preloads_n=(0.3, 2.0, 3.0), lines=40), table)
    bands = ((0.1, 1.0), (1.0, 29.0), (30.0, 1000.0))
    banded = [
        replace(entry, frequency_hz=np.linspace(*band, 40))
        for entry, band in zip(frf_recordings(three), bands, strict=True)
    ]
    array = campaign(Made(sensors=3, spheres_mm=(4.0,), preloads_n=(1.0,), lines=40), table)
    saved = [
        replace(entry, recorded_at=f"2020-01-01T10:00:0{n}Z", frequency_hz=np.geomspace(0.5, 200.0, 40))
        for n, entry in enumerate(frf_recordings(array))
    ]
    for whole, entries in ((three, banded), (array, saved)):
        report = looked_at(replace(whole, recordings=tuple(entries)), table)
        assert "units_off_by_1000" not in {code for code, _, _ in codes(report)}
        assert report["verdict"] != "insufficient_data"


def test_places_that_rounding_leaves_where_zero_is_meant_are_no_impossible_numbers(table: SigmaTable) -> None:
    made = campaign(Made(sensors=1, spheres_mm=(4.0,), preloads_n=(0.3, 2.0, 3.0), lines=40), table)
    places = np.arange(-0.6, 0.7, 0.2)[2:5]
    assert 0 < abs(places[1]) < 1e-15
    scanned = [
        replace(entry, position_mm=(float(x), 0.0)) for entry, x in zip(frf_recordings(made), places, strict=True)
    ]
    sensor = replace(made.skin.sensors[0], x_mm=0.1 + 0.2 - 0.3)
    report = looked_at(replace(made, recordings=tuple(scanned), skin=replace(made.skin, sensors=(sensor,))), table)
    assert codes(report) == set()


@pytest.mark.slow
@pytest.mark.parametrize(("factor", "unit"), [(1e3, "fC/N"), (1e-3, "nC/N")])
def test_d33_far_declared_named(factor: float, unit: str, table: SigmaTable) -> None:
    """A d33 far from the declared one is named, with the unit that explains it.

    A thousandth of a ceramic's d33, or a weak polymer's times 1000, could be a sensor's.
    """
    d33 = 0.5 if factor > 1 else 450.0
    weak = campaign(Made(sensors=3, lines=20, d33_pc_per_n=d33), table)
    wrong = changed(weak, times(factor, *LINES), of_all)
    slip = ("units_off_by_1000", "", "frf_re_pc_per_n")
    assert slip not in codes(looked_at(wrong, table))
    told = looked_at(replace(wrong, skin=replace(weak.skin, d33_pc_per_n=-d33)), table)
    assert slip in codes(told)
    assert any(f"given in {unit}?" in entry["statement"] for entry in told["findings"])
