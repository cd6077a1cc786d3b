"""What the instrument writes: zeros, drift, gain, steps; the textbook case; visibility against an independent fit."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares

from rig.description import parse
from rig.elastomer import RecordedCurve, campaign_of_curves, record_curves
from rig.reading import document
from rig.truth import truth_of_curves
from rig.visible_curves import visibility
from tests.support.repository import ROOT
from underskin.recordings import campaign as campaigns

pytestmark = pytest.mark.slow

TEXTBOOK = document(ROOT / "examples" / "rig" / "nanoindenter.yaml")


def textbook(effects: Any = None, **curves: Any) -> tuple[Any, RecordedCurve]:
    description = {**TEXTBOOK, "curves": {**TEXTBOOK["curves"], **curves}}
    experiment = parse(description if effects is None else {**description, "effects": effects})
    return experiment, record_curves(experiment)[0]


def test_the_textbook_case_is_what_an_instrument_writes() -> None:
    """7.5 µm, 1 MPa, 40 and 75 mJ/m², 3 N/m, 3,100 samples, air on both sides, pulled off at −(3/2) π w_s R."""
    experiment, curve = textbook()
    kept = campaigns.parse(campaign_of_curves(experiment, [curve]))
    assert kept.units_checked
    force, displacement = (np.array(curve.entry[name]) for name in ("force_n", "displacement_mm"))
    assert len(force) == 3100
    start, end = force[:300], force[-200:]
    assert np.ptp(start) < 2e-7 > np.ptp(end)
    assert start.mean() != pytest.approx(0, abs=1e-9)  # an arbitrary zero
    assert force.min() - end.mean() == pytest.approx(-1.5 * np.pi * 75e-6 * 7.5e-3, rel=0.03)
    assert displacement[-1] < curve.zero_mm < displacement.max()
    truth = truth_of_curves(experiment, [curve])
    assert truth["effects"] == ["adhesion"]
    assert truth["identifiable"]
    assert truth["base_rms_misfit_percent"] > 8


@pytest.mark.parametrize(
    ("field", "name", "step"),
    [("displacement_mm", "displacement_step_mm", 2e-6), ("force_n", "force_step_n", 5e-8)],
)
def test_values_are_multiples_of_the_converters_step(field: str, name: str, step: float) -> None:
    _, curve = textbook(**{name: step})
    written = np.array(curve.entry[field])
    assert written / step == pytest.approx(np.round(written / step), abs=1e-4)
    exact = curve.exact_force_n if field == "force_n" else curve.exact_displacement_mm
    assert step / 4 < np.abs(written - exact).max() < step / 2 * 1.001 + 6e-8 * (field == "force_n")


@pytest.mark.parametrize("name", ["drift_n_per_s", "drift_n_per_mm"])
def test_the_baseline_drifts_in_time_or_travel(name: str) -> None:
    quiet: dict[str, Any] = {"force_noise_n": 0.0, "force_step_n": 0.0, "drift_n_per_s": 0.0}
    _, still = textbook(**quiet)
    _, drifting = textbook(**{**quiet, name: 1e-5 if name == "drift_n_per_mm" else 1e-8})
    added = drifting.exact_force_n - still.exact_force_n
    along = still.time_s if name == "drift_n_per_s" else still.exact_displacement_mm
    assert added == pytest.approx(np.polyval(np.polyfit(along, added, 1), along), abs=1e-12)
    assert np.ptp(added) > 1e-9


def test_the_ways_the_recording_can_end_and_what_it_states() -> None:
    experiment, curve = textbook(retract=False, times=False, stage_declared=True, modulus_declared=True)
    written = campaign_of_curves(experiment, [curve])
    (entry,) = written["recordings"]
    assert entry["stage_stiffness_n_per_mm"] == 0.003
    assert "time_s" not in entry
    assert written["skin"]["youngs_modulus_mpa"] == 1
    assert np.argmax(curve.exact_displacement_mm) > len(curve.time_s) - 3
    campaigns.parse(written)


def test_the_gain_in_chi2_is_that_of_an_independent_fit() -> None:
    effects = {"contact_creep": {"fraction": 0.05, "time_s": 2.0, "fraction_2": 0.05, "time_2_s": 10.0}}
    experiment, curve = textbook(effects, displacement_step_mm=0.0, hold_s=2.0)
    force, noise = np.array(curve.entry["force_n"]), np.hypot(1e-8, 2e-9 / np.sqrt(12))
    moved, time = curve.exact_displacement_mm - curve.zero_mm, curve.time_s / curve.time_s[-1]

    def hertz(fit: Any) -> Any:
        law = 4 / 3 * np.exp(fit[0]) / 0.75 * np.sqrt(0.0075) * np.maximum(moved - 1e-3 * fit[1], 0) ** 1.5
        return (force - law - 1e-6 * (fit[2] + fit[3] * time)) / noise

    base = 2 * min(least_squares(hertz, [0.0, start, 0.0, 0.0]).cost for start in (0.0, 0.2))
    truth = float(np.sum(((force - curve.exact_force_n) / noise) ** 2))
    found = visibility(experiment, [curve]).chi2_gain
    assert found == pytest.approx(base - truth, rel=1e-2)
    assert found > 30


def test_each_of_a_pair_is_weighed_beside_the_other() -> None:
    effects = {"adhesion": {"work_j_per_m2": 0.04}, "instrument_compliance": {"stiffness_n_per_mm": 1e4}}
    experiment, curve = textbook(effects, samples=400)
    truth = truth_of_curves(experiment, [curve])
    assert truth["identifiable"]
    assert truth["chi2_gain_of_each"]["adhesion"] > 1000
    assert truth["chi2_gain_of_each"]["instrument_compliance"] < 30  # so stiff a frame does not show
    assert not truth["every_effect_identifiable"]
