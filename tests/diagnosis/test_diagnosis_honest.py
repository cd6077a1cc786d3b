"""Campaigns that look odd and may well be meant are left as they are, until what is declared contradicts them."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.diagnosis_campaigns import Made, campaign
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.diagnosis.screening.inspection import inspect
from underskin.diagnosis.screening.physical_limits import without_extremes
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.surrogate.sigma_table import SigmaTable

THREE = Made(sensors=1, spheres_mm=(4.0,), preloads_n=(0.3, 2.0, 3.0), lines=40)


def frfs(made: Campaign) -> list[FrfRecording]:
    return [entry for entry in made.recordings if isinstance(entry, FrfRecording)]


def test_places_that_rounding_leaves_where_zero_is_meant_are_no_impossible_numbers(table: SigmaTable) -> None:
    made = campaign(THREE, table)
    places = np.arange(-0.6, 0.7, 0.2)[2:5]
    assert 0 < abs(places[1]) < 1e-15
    scanned = [replace(entry, position_mm=(float(x), 0.0)) for entry, x in zip(frfs(made), places, strict=True)]
    sensor = replace(made.skin.sensors[0], x_mm=0.1 + 0.2 - 0.3)
    found = without_extremes(replace(made, recordings=tuple(scanned), skin=replace(made.skin, sensors=(sensor,))))
    assert found.findings == []
    assert found.lacking is None
    assert len(found.campaign.recordings) == 3


@pytest.mark.slow
@pytest.mark.parametrize("tip_mass_g", [300.0, 1500.0])
def test_a_recording_above_its_resonance_is_not_reversed(tip_mass_g: float, table: SigmaTable) -> None:
    """In antiphase with force over most of its lines, with the heavier tip in all recordings."""
    made = campaign(
        replace(THREE, mechanisms=("contact_resonance",), parameters=(tip_mass_g, 0.05), highest_hz=1000.0), table
    )
    median = [float(np.median(np.asarray(entry.frf_re_pc_per_n))) for entry in frfs(made)]
    assert min(median) < 0
    report = diagnosis_report(made, table)
    assert "sign_flipped" not in {entry["code"] for entry in report["findings"]}
    assert [entry["name"] for entry in report["mechanisms"]] == ["contact_resonance"]
    assert report["mechanisms"][0]["parameters"][0]["value"] == pytest.approx(tip_mass_g, rel=0.05)


def test_an_array_stamped_as_it_is_saved_is_not_slow(table: SigmaTable) -> None:
    """Three sensors recorded at once, and saved one after the other."""
    made = campaign(Made(sensors=3, spheres_mm=(4.0,), preloads_n=(1.0,), lines=40), table)
    stamped = [replace(entry, recorded_at=f"2020-01-01T10:00:0{n}Z") for n, entry in enumerate(frfs(made))]
    slow = [replace(entry, frequency_hz=np.geomspace(0.5, 200.0, 40)) for entry in stamped]
    assert inspect(replace(made, recordings=tuple(slow)), table).lacking is None


def test_three_bands_are_no_slip(table: SigmaTable) -> None:
    made = campaign(THREE, table)
    bands = ((0.1, 1.0), (1.0, 29.0), (30.0, 1000.0))
    entries = [
        replace(entry, frequency_hz=np.linspace(*band, 40)) for entry, band in zip(frfs(made), bands, strict=True)
    ]
    inspected = inspect(replace(made, recordings=tuple(entries)), table)
    assert "units_off_by_1000" not in {entry.code for entry in inspected.findings}
    assert len(inspected.campaign.recordings) == 3


@pytest.mark.parametrize(("factor", "word"), [(1e3, "large"), (1e-3, "small")])
def test_a_d33_far_from_the_declared_one_is_named(factor: float, word: str, table: SigmaTable) -> None:
    """A thousandth of a ceramic's d33, or a weak polymer's times 1000, could be a sensor's."""
    d33 = 0.5 if factor > 1 else 450.0
    weak = campaign(Made(sensors=3, lines=20, d33_pc_per_n=d33), table)
    entries = [
        replace(
            entry,
            frf_re_pc_per_n=factor * np.asarray(entry.frf_re_pc_per_n),
            frf_im_pc_per_n=factor * np.asarray(entry.frf_im_pc_per_n),
        )
        for entry in frfs(weak)
    ]
    wrong = replace(weak, recordings=tuple(entries))
    slip = ("units_off_by_1000", "", "frf_re_pc_per_n")
    assert slip not in {(entry.code, entry.recording, entry.field) for entry in inspect(wrong, table).findings}
    told = inspect(replace(wrong, skin=replace(weak.skin, d33_pc_per_n=-d33)), table).findings
    assert slip in {(entry.code, entry.recording, entry.field) for entry in told}
    assert any(f"1000 × too {word}" in entry.statement for entry in told)
