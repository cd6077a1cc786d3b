"""Bad input by name: what is wrong with recordings themselves is found before physics is blamed for it."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.support.diagnosis_campaigns import Made, added, campaign
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.diagnosis.screening.inspection import inspect
from underskin.findings import english
from underskin.findings.lacking import Lack
from underskin.recordings.campaign import Campaign, FrfRecording, from_dict, to_dict
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Complexes, Floats

MADE = Made(sensors=3, repeats=2, lines=20)
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
    entries = [entry for entry in good.recordings if isinstance(entry, FrfRecording)]
    return replace(good, recordings=tuple(change(entry) if which(entry) else entry for entry in entries))


def of_all(entry: FrfRecording) -> bool:
    return entry.id != ""


def of_r3(entry: FrfRecording) -> bool:
    return entry.id == "r3"


def of_r9(entry: FrfRecording) -> bool:
    return entry.id == "r9"


def of_s1(entry: FrfRecording) -> bool:
    return entry.sensor == "s1"


def codes(found: Any) -> set[tuple[str, str, str]]:
    return {(entry.code, entry.recording, entry.field) for entry in found if entry.code != "constant_axis"}


ONE = [
    (noise(1e-2), of_r3, ("no_response", "r3", "frf_re_pc_per_n"), 1),
    (noise(1e-2), of_s1, ("no_response", "r8", "frf_re_pc_per_n"), 16),
    (times(1000.0, "preload_n"), of_r3, ("units_off_by_1000", "r3", "preload_n"), 1),
    (times(1e-3, "preload_n"), of_r3, ("units_off_by_1000", "r3", "preload_n"), 1),
    (times(1000.0, "dynamic_force_n"), of_r3, ("units_off_by_1000", "r3", "dynamic_force_n"), 1),
    (times(1000.0, "frequency_hz"), of_r3, ("units_off_by_1000", "r3", "frequency_hz"), 1),
    (times(1e-3, "indenter_radius_mm"), of_r3, ("units_off_by_1000", "r3", "indenter_radius_mm"), 1),
    (away(1e-3), of_r9, ("units_off_by_1000", "r9", "position_mm"), 1),
    (away(1e3), of_r9, ("units_off_by_1000", "r9", "position_mm"), 1),
    (times(1000.0, *LINES), of_s1, ("units_off_by_1000", "r8", "frf_re_pc_per_n"), 16),
    (times(1e-3, "dynamic_force_n"), of_all, ("units_off_by_1000", "", "dynamic_force_n"), 0),
    (times(1e-3, *LINES), of_all, ("units_off_by_1000", "", "frf_re_pc_per_n"), 0),
]


@pytest.mark.parametrize(("change", "which", "finding", "left_out"), ONE)
def test_what_is_wrong_is_named_and_left_out(
    change: Change,
    which: Which,
    finding: tuple[str, str, str],
    left_out: int,
    good: Campaign,
    table: SigmaTable,
) -> None:
    inspected = inspect(changed(good, change, which), table)
    assert finding in codes(inspected.findings)
    assert {entry[0] for entry in codes(inspected.findings)} == {finding[0]}
    assert inspected.lacking is None
    assert len(inspected.campaign.recordings) == len(good.recordings) - left_out


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
    report = diagnosis_report(changed(good, change, of_all), table)
    assert report["verdict"] == "insufficient_data"
    assert report["mechanisms"] == []
    told = [entry for entry in report["findings"] if entry["code"] != "constant_axis"]
    assert (code, field) in {(entry["code"], entry["field"]) for entry in told}


@pytest.mark.parametrize(
    ("sensor_radius_mm", "thickness_mm", "field"),
    [(15.0, 2.0, "skin.sensor_radius_mm"), (1.0, 0.2, "skin.thickness_mm")],
)
def test_impossible_geometry_is_named(
    sensor_radius_mm: float, thickness_mm: float, field: str, good: Campaign, table: SigmaTable
) -> None:
    skin = replace(good.skin, sensor_radius_mm=sensor_radius_mm, thickness_mm=thickness_mm)
    report = diagnosis_report(replace(good, skin=skin), table)
    assert report["verdict"] == "insufficient_data"
    (told,) = (entry for entry in report["findings"] if entry["code"] == "impossible_geometry")
    assert told["field"] == field
    assert told["statement"][1:] in report["statement"]


SKIN = [
    ("youngs_modulus_mpa", 1e3),
    ("youngs_modulus_mpa", 1e-3),
    ("thickness_mm", 1e3),
    ("thickness_mm", 1e-3),
    ("sensor_radius_mm", 1e-3),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "factor"), SKIN)
def test_a_skin_in_other_units_is_named_and_tells_nothing(
    name: str, factor: float, good: Campaign, table: SigmaTable
) -> None:
    """Also where the units are said to be checked, so that the diagnosis goes on."""
    wrong = replace(good, skin=replace(good.skin, **{name: factor * getattr(good.skin, name)}))
    found = ("units_off_by_1000", "", f"skin.{name}")
    inspected = inspect(wrong, table)
    assert found in codes(inspected.findings)
    assert inspected.lacking is not None
    assert "units_checked" in english.lacking(inspected.lacking)
    meant = inspect(replace(wrong, units_checked=True), table)
    assert found in codes(meant.findings)
    assert meant.lacking is None or "units_checked" not in english.lacking(meant.lacking)


@pytest.mark.slow
def test_a_modulus_that_was_checked_is_diagnosed_with_the_suspicion_beside(good: Campaign, table: SigmaTable) -> None:
    stiff = replace(good, skin=replace(good.skin, youngs_modulus_mpa=3000.0), units_checked=True)
    report = diagnosis_report(stiff, table)
    assert report["verdict"] != "insufficient_data"
    told = {(entry["code"], entry["field"]): entry["statement"] for entry in report["findings"]}
    assert "kPa" in told["units_off_by_1000", "skin.youngs_modulus_mpa"]


@pytest.mark.parametrize("factor", [1e3, 1e-3])
def test_sensors_in_other_units_are_named(factor: float, good: Campaign, table: SigmaTable) -> None:
    sensors = tuple(
        replace(sensor, x_mm=factor * sensor.x_mm, y_mm=factor * sensor.y_mm) for sensor in good.skin.sensors
    )
    inspected = inspect(replace(changed(good, away(factor), of_all), skin=replace(good.skin, sensors=sensors)), table)
    assert inspected.lacking
    assert {entry[2] for entry in codes(inspected.findings)} <= {"skin.sensors", "skin.sensor_radius_mm"}


def test_offsets_in_metres_at_the_only_sensor_are_named(table: SigmaTable) -> None:
    made = campaign(Made(sensors=1, offsets_mm=(0.0, 1.0, 2.0), lines=8), table)
    inspected = inspect(changed(made, away(1e-3), of_all), table)
    assert ("units_off_by_1000", "", "position_mm") in codes(inspected.findings)
    assert inspected.lacking


def test_what_would_bring_contacts_into_the_tables_is_named(good: Campaign, table: SigmaTable) -> None:
    inspected = inspect(replace(changed(good, times(1e3, "indenter_radius_mm"), of_all), units_checked=True), table)
    named = {entry.field: entry.statement for entry in inspected.findings if "within the tables" in entry.statement}
    assert "µm" in named["indenter_radius_mm"]
    assert "GPa" in named["skin.youngs_modulus_mpa"]
    assert inspected.lacking


def test_recordings_that_were_all_refused_are_said_to_be(good: Campaign, table: SigmaTable) -> None:
    document = to_dict(changed(good, times(1e3, "indenter_radius_mm"), of_all))
    read, refused = from_dict(document)
    report = diagnosis_report(read, table, refused=refused)
    assert report["verdict"] == "insufficient_data"
    assert f"{len(good.recordings)} recording(s) were refused for their indenter_radius_mm" in report["statement"]


def test_copies_are_found_through_rounding(good: Campaign, table: SigmaTable) -> None:
    copies = changed(good, times(1 + 1e-6, *LINES), of_all).recordings[:4]
    whole = replace(good, recordings=(*good.recordings, *(replace(entry, id=f"{entry.id} copy") for entry in copies)))
    inspected = inspect(whole, table)
    assert codes(inspected.findings) == {
        ("duplicated_recording", f"r{number} copy", "frf_re_pc_per_n") for number in range(4)
    }
    assert len(inspected.campaign.recordings) == len(good.recordings)


def test_recordings_made_alike_at_one_frequency_tell_nothing(table: SigmaTable) -> None:
    alike = campaign(Made(sensors=1, preloads_n=(1.0,), spheres_mm=(4.0,), repeats=6, lines=1), table)
    entries = [replace(entry, load_cycles=1, dwell_s=1.0, recorded_at=None) for entry in alike.recordings]
    report = diagnosis_report(replace(alike, recordings=tuple(entries)), table)
    assert report["verdict"] == "insufficient_data"
    assert "made alike" in report["statement"]


@pytest.mark.parametrize("factor", [1e3, 1e-3, -1.0])
def test_of_three_recordings_the_one_that_is_off_is_named_and_of_two_neither(factor: float, table: SigmaTable) -> None:
    made = campaign(Made(sensors=1, spheres_mm=(4.0,), preloads_n=(0.5, 1.0, 2.0)), table)
    wrong = changed(made, times(factor, *LINES), lambda entry: entry.id == "r1")
    code = "units_off_by_1000" if factor > 0 else "sign_flipped"
    of_three = inspect(wrong, table)
    assert codes(of_three.findings) == {(code, "r1", "frf_re_pc_per_n")}
    assert of_three.lacking is None
    of_two = inspect(replace(wrong, recordings=wrong.recordings[:2]), table)
    assert codes(of_two.findings) == {(code, "", "frf_re_pc_per_n")}
    assert of_two.lacking is not None
    assert of_two.lacking.lack == Lack.TWO_RECORDINGS_CONTRADICT


def test_a_period_that_does_not_fit_between_recordings_is_named(good: Campaign, table: SigmaTable) -> None:
    """From 0.03 to 3.9 Hz is no impossible sweep, but not one in 20 s."""

    def dated(entry: FrfRecording) -> FrfRecording:
        number = int(entry.id[1:])
        return replace(entry, recorded_at=f"2020-01-01T10:{number // 3:02d}:{20 * (number % 3):02d}Z")

    slow = changed(good, times(0.03, "frequency_hz"), of_all)
    assert inspect(slow, table).findings == inspect(good, table).findings
    found = inspect(changed(slow, dated, of_all), table)
    assert codes(found.findings) == {("units_off_by_1000", "", "frequency_hz")}
    assert "20 s" in " ".join(entry.statement for entry in found.findings)
    assert found.lacking


def test_units_that_were_checked_are_believed(good: Campaign, table: SigmaTable) -> None:
    slow = replace(changed(good, times(1e-3, "frequency_hz"), of_all), units_checked=True)
    assert inspect(slow, table).lacking is None


def test_a_resonance_is_not_taken_for_noise(table: SigmaTable) -> None:
    """Few lines over a resonance differ as much as noise would, and their mean cancels: they are no silence."""
    made = Made(("contact_resonance",), (6.0, 0.05), highest_hz=1000.0, lines=20, modulus_mpa=16.0)
    for parameters in ((6.0, 0.05), (30.0, 0.05), (6.0, 0.02)):
        resonant = campaign(replace(made, parameters=parameters), table)
        inspected = inspect(changed(resonant, times(-1.0, *LINES), of_r3), table)
        assert codes(inspected.findings) == {("sign_flipped", "r3", "frf_re_pc_per_n")}
        assert len(inspected.campaign.recordings) == len(resonant.recordings)


def test_where_little_is_expected_silence_is_kept(table: SigmaTable) -> None:
    """Far beside the sensor the response is below the noise, as the model says: such recordings count."""
    far = campaign(Made(offsets_mm=(0.0, 5.5), lines=20, line=0.01), table)
    random = np.random.default_rng(2)

    def noise(real: Floats) -> Complexes:
        return np.asarray(0.05 * (random.normal(size=len(real)) + 1j * random.normal(size=len(real))))

    noisy = added(far, noise)
    inspected = inspect(noisy, table)
    assert codes(inspected.findings) == set()
    assert len(inspected.campaign.recordings) == len(far.recordings)
