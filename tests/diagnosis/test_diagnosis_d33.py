"""The stated d33 counts what does not show, and is to be quoted only where nothing that does not show moves it."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.signal import butter, freqs

from rig.description import parse as experiment
from rig.recorded import campaign as campaign_of_lines
from rig.recorded import record_lines
from tests.support.cases import first
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.lean_reports import beside, lean_report, whole_report
from underskin.recordings.campaign import FrfRecording, Tolerances, parse
from underskin.surrogate.sigma_table import SigmaTable

pytestmark = pytest.mark.slow

D33 = 14.0
CENTRED, BESIDE = [[0.0, 0.0]], [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]
DECLARED = beside("modulus_error", "thickness_error", "misalignment", "interface_slip", "moving_contact_edge")

# One sphere on one sensor's centre, over a narrow range of preloads: nearly everything is a factor on d33
NARROW = Made(sensors=1, spheres_mm=(6.0,), preloads_n=(0.9, 1.0, 1.1, 1.2), repeats=3)


@pytest.mark.parametrize("factor", first(1, [1.06, 0.94]))
def test_stated_d33_holds_true_beside_effect(factor: float, table: SigmaTable) -> None:
    """The stated d33 holds the true one beside an effect that does not show.

    It is wider than of a search that knows of no such effect, which excludes the true one.
    """
    hidden = campaign(replace(NARROW, mechanisms=("thickness_error",), parameters=(factor,)), table)
    report = whole_report(hidden, table, *DECLARED)
    assert report["mechanisms"] == []
    assert report["d33"]["low"] < NARROW.d33_pc_per_n < report["d33"]["high"]
    certain = whole_report(hidden, table, *beside())["d33"]["relative"]
    assert not certain["low"] < NARROW.d33_pc_per_n < certain["high"]


def test_tolerances_widen_the_absolute_interval_alone(table: SigmaTable) -> None:
    """The sensor's radius enters as rT² at most; E and h, which the recordings do not tell, by their slopes at the
    contact: √((s_r r)² + (s_h h)² + (s_E E)²) of each tolerance beyond the fit's own prior."""
    made = campaign(NARROW, table)

    def log_width(interval: Mapping[str, float]) -> float:
        return float(np.log(interval["high"] / interval["low"])) / 3.92

    def found(**percents: float) -> tuple[float, float]:
        tolerances = None if not percents else Tolerances(**percents)
        d33 = whole_report(replace(made, skin=replace(made.skin, tolerances=tolerances)), table, *beside())["d33"]
        return log_width(d33), log_width(d33["relative"])

    usual, stated = found(), found(thickness_percent=1.0, youngs_modulus_percent=2.0, sensor_radius_percent=0.0)
    radius = found(thickness_percent=1.0, youngs_modulus_percent=2.0, sensor_radius_percent=4.0)
    assert stated[0] == pytest.approx(stated[1], rel=1e-3)
    assert usual[1] == pytest.approx(stated[1], rel=1e-3)
    assert usual[0] > 1.2 * usual[1]
    assert radius[1] == pytest.approx(stated[1], rel=1e-3)
    grown = np.sqrt(radius[0] ** 2 - radius[1] ** 2) / 0.04  # ∂ ln FRF/∂ ln rT: 2 of a sensor within the contact
    assert 0.5 < grown < 2.0


@pytest.mark.parametrize(("times", "said"), [(2.0, "2 times the declared 14 pC/N"), (1.0, "")])
def test_a_charge_taken_peak_to_peak_shows_beside_the_declared_d33(times: float, said: str, table: SigmaTable) -> None:
    """Nothing else in the recordings tells a factor on all of them."""
    made = campaign(replace(NARROW, d33_pc_per_n=D33 * times), table)
    statement = lean_report(replace(made, skin=replace(made.skin, d33_pc_per_n=D33)), table, *DECLARED)["statement"]
    assert said in statement
    assert ("times the declared" in statement) == bool(said)


def reported(
    offsets_mm: list[list[float]], factor: float, spheres: list[float], table: SigmaTable, *left_out: str
) -> dict[str, Any]:
    """Of a skin whose thickness is `factor` times what is declared, pressed at these places beside its sensors."""
    described: dict[str, Any] = {
        "schema": "experiment/1",
        "name": "declared",
        "seed": 7,
        "skin": {
            "thickness_mm": 2.5, "youngs_modulus_mpa": 16.0, "sensor_radius_mm": 1.5, "d33_pc_per_n": D33,
            "array": {"columns": 2, "rows": 2, "pitch_mm": 4.0}, "width_mm": 20.0, "length_mm": 40.0,
        },
        "design": {
            "indenters_mm": spheres, "preloads_n": [0.5, 1.0, 2.0, 3.0], "dynamic_forces_n": [0.09],
            "offsets_mm": offsets_mm, "start": "2017-05-03T09:00:00Z",
        },
        "lines": {"low_hz": 10.0, "high_hz": 130.0, "count": 20},
        "noise": {"gain": 0.01, "line": 0.01},
        "effects": {"thickness_error": {"factor": factor}} if factor != 1.0 else {},
    }  # fmt: skip
    return lean_report(parse(campaign_of_lines(record_lines(experiment(described)))), table, *left_out)


def test_a_thickness_that_centred_presses_do_not_show_keeps_d33_from_being_quoted(table: SigmaTable) -> None:
    """Told 15 % too thin, the skin answers like another d33."""
    found = reported(CENTRED, 1.15, [4.0], table)
    assert found["verdict"] == "no_mismatch"
    assert not found["d33"]["low"] < D33 < found["d33"]["high"]
    assert not found["d33"]["quotable"]
    assert "would change it without showing" in found["d33"]["why_not"]
    assert "d33 is not to be quoted" in found["statement"]
    assert "thickness error by " in found["statement"]
    (entry,) = [one for one in found["not_identifiable"] if one["mechanism"] == "thickness_error"]
    assert "d33 would then be " in entry["reason"]


@pytest.mark.parametrize("factor", [1.0, 1.15])
def test_presses_beside_the_sensors_tell_the_thickness_and_d33(factor: float, table: SigmaTable) -> None:
    found = reported(BESIDE, factor, [4.0, 10.0], table, *DECLARED)
    assert [entry["name"] for entry in found["mechanisms"]] == (["thickness_error"] if factor != 1.0 else [])
    assert found["d33"]["low"] < D33 < found["d33"]["high"]
    assert found["d33"]["quotable"]
    assert "why_not" not in found["d33"]


def test_physics_that_would_not_show_stands_beside_the_value_to_quote(table: SigmaTable) -> None:
    """A glue line that slips changes d33 alone; presses 1 mm beside the sensor tell the thickness, but not that."""
    found = reported([[0.0, 0.0], [1.0, 0.0]], 1.0, [4.0], table, *DECLARED)
    assert found["d33"]["quotable"]
    (entry,) = [one for one in found["not_identifiable"] if one["mechanism"] == "interface_slip"]
    percent = entry["reason"].partition("d33 would then be ")[2].partition(" too large")[0]
    assert float(percent.removesuffix(" %")) > 100 * (found["d33"]["high"] / found["d33"]["value"] - 1)
    assert f"provided that there is no interface slip ({percent})" in found["statement"]


def test_a_law_that_declared_facts_say_stands_among_the_idealised(table: SigmaTable) -> None:
    """Whether the base shows under the contact is told where it is wide, and left at even odds where it is narrow."""
    narrow, wide = (
        whole_report(
            campaign(Made(spheres_mm=spheres, preloads_n=preloads, thickness_mm=h), table),
            table,
            *beside("layered_contact"),
        )
        for spheres, preloads, h in (((4.0,), (0.05, 0.1, 0.2), 6.0), ((3.0, 8.0), (0.3, 1.0, 2.0), 2.0))
    )
    (little,), (much,) = (report["idealised"] for report in (narrow, wide))
    assert little["name"] == much["name"] == "layered_contact"
    assert little["effect_percent"] < 1 < much["effect_percent"]
    assert 0.3 < little["probability"] < 0.7
    assert much["probability"] < 0.05  # the campaign is made by the base model, whose contact is a half space's


@pytest.mark.parametrize("poles", first(1, [2, 1]))
def test_a_chain_of_two_poles_is_explained(poles: int, table: SigmaTable) -> None:
    """Behind a Butterworth high-pass of one or two poles d33 is quoted, and its interval holds the true one."""
    made = campaign(Made(sensors=2, repeats=1), table)
    filters = butter(poles, 2 * np.pi * 4.0, "high", analog=True)
    recordings = []
    for recording in made.of(FrfRecording):
        assert recording.frequency_hz is not None
        assert recording.frf_re_pc_per_n is not None
        assert recording.frf_im_pc_per_n is not None
        _, response = freqs(*filters, 2 * np.pi * np.asarray(recording.frequency_hz))
        value = response * (np.asarray(recording.frf_re_pc_per_n) + 1j * np.asarray(recording.frf_im_pc_per_n))
        recordings.append(replace(recording, frf_re_pc_per_n=value.real, frf_im_pc_per_n=value.imag))
    known = beside("amplifier_high_pass", "sensor_relaxation", "contact_resonance", "timing_delay")
    report = lean_report(replace(made, recordings=tuple(recordings)), table, *known)
    (mechanism,) = report["mechanisms"]
    values = {entry["name"]: entry for entry in mechanism["parameters"]}
    assert mechanism["name"] == "amplifier_high_pass"
    assert values["corner"]["value"] == pytest.approx(4.0, rel=0.02)
    assert values["high_pass_order"]["value"] == pytest.approx(poles, abs=0.1)
    assert report["d33"]["quotable"]
    assert report["d33"]["low"] < Made().d33_pc_per_n < report["d33"]["high"]
