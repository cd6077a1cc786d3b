"""The rig's force–displacement curves: exact limits, hereditary integrals, and files that the library reads."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from rig import effects
from rig.description import parse
from rig.elastomer import RecordedCurve, campaign_of_curves, record_curves
from rig.errors import RigError
from rig.visible_curves import visibility
from underskin.recordings import campaign as campaigns

E_MPA, R_MM = 0.5, 2.5
INDENTATION: dict[str, dict[str, Any]] = {
    "layered_contact": {},
    "adhesion": {"work_j_per_m2": 1.0, "work_of_separation_j_per_m2": 2.0},
    "strain_stiffening": {"coefficient": 3.0, "law": "limited"},
    "compressible_layer": {"poisson_ratio": 0.4},
    "contact_creep": {"fraction": 0.4, "time_s": 5.0},
    "instrument_compliance": {"stiffness_n_per_mm": 5.0},
    "liquid_drag": {"coefficient_n_s_per_mm": 0.5},
    "modulus_error": {"factor": 1.2},
    "force_ripple": {"amplitude": 0.05, "pitch_mm": 0.1},
    "force_drift": {"n_per_root_s": 0.02},
    "thermal_drift": {"drift_mm": 0.02, "time_s": 3.0},
    "guide_friction": {"friction": 0.03, "slip_mm": 0.02},
    "nonlinear_cell": {"nonlinearity": 0.05, "range_n": 2.0},
    "plastic_set": {"ratio": 0.1},
    "flattened_tip": {"radius_mm": 0.5},
    "rough_surface": {"height_mm": 0.02, "force_n": 0.02},
}
COMPRESSION: dict[str, dict[str, Any]] = {
    "platen_friction": {"friction": 0.5},
    "strain_stiffening": {"coefficient": 3.0},
    "contact_creep": {"fraction": 0.4, "time_s": 5.0},
    "instrument_compliance": {"stiffness_n_per_mm": 100.0},
    "tilted_platen": {"wedge_mm": 0.3},
    "force_ripple": {"amplitude": 0.05, "pitch_mm": 0.1},
    "force_drift": {"n_per_root_s": 0.3},
}


def described(kind: str, on: dict[str, Any], **curves: Any) -> dict[str, Any]:
    usual = {"indenters_mm": [R_MM], "largest_displacement_mm": 1.0} if kind == "indentation" else {}
    quiet = {"force_noise_n": 0.0, "contact_point_mm": 0.0}
    return {
        "schema": "experiment/1", "name": "curves", "seed": 3, "kind": kind, "effects": on,
        "skin": {"thickness_mm": 8.0, "youngs_modulus_mpa": E_MPA, "sensor_radius_mm": 1.5, "d33_pc_per_n": 14.0},
        "curves": {**usual, **quiet, **curves},
    }  # fmt: skip


def curve(kind: str, on: dict[str, Any], **curves: Any) -> tuple[RecordedCurve, np.ndarray, np.ndarray]:
    (recorded,) = record_curves(parse(described(kind, on, **curves)))
    return recorded, np.array(recorded.entry["displacement_mm"]), np.array(recorded.entry["force_n"])


def hertz(depth: np.ndarray | float) -> np.ndarray:
    return np.asarray(4 / 3 * E_MPA / 0.75 * np.sqrt(R_MM) * np.maximum(depth, 0) ** 1.5)


def test_base_curves_are_hertz_s_and_neo_hookean() -> None:
    _, depth, force = curve("indentation", {})
    assert force == pytest.approx(hertz(depth), rel=1e-4, abs=1e-5)
    _, shortening, force = curve("compression", {}, tension=True)
    assert shortening.min() < 0 < shortening.max()
    stretch = 1 - shortening / 10
    assert force == pytest.approx(E_MPA * np.pi / 4 * 20**2 * (stretch**-2 - stretch) / 3)


def test_a_ramp_relaxes_as_the_hereditary_integral() -> None:
    """Lee and Radok 1960: F(t) = ∫ E(t − s) d(c δ^(3/2))."""
    g, tau = 0.4, 5.0
    recorded, depth, force = curve("indentation", {"contact_creep": {"fraction": g, "time_s": tau}}, samples=400)
    time = np.array(recorded.entry["time_s"])
    start = 0.08 / 0.1  # s until contact
    for index in (60, 120, 180):
        t = time[index] - start
        expected, _ = quad(
            lambda s, t=t: (1 - g * (1 - np.exp(-(t - s) / tau))) * 1.5 * 0.1**1.5 * np.sqrt(s), 0, t
        )  # fmt: skip
        assert force[index] == pytest.approx(float(hertz(1.0)) * expected, rel=3e-3)
    back = force[len(force) // 2 + 20 :]
    assert (np.diff(back) <= 1e-9).all()  # drawn back, the force falls, and it never pulls
    assert back[-1] == 0
    assert (back[:50] < hertz(depth[len(force) // 2 + 20 :][:50])).all()


def test_slow_creep_has_no_memory_left() -> None:
    """Creep far faster than the ramp: an elastic body of the relaxed modulus, loading and unloading alike."""
    _, depth, force = curve("indentation", {"contact_creep": {"fraction": 0.4, "time_s": 1e-3}}, samples=400)
    assert force == pytest.approx(0.6 * hertz(depth), abs=0.02 * float(hertz(1.0)))


@pytest.mark.slow
def test_an_adhesive_contact_tears_at_the_force_of_johnson_kendall_and_roberts() -> None:
    """Pull-off under displacement control comes after the least force, −(3/2)π w R; before contact there is none."""
    work = 5.0
    on = {"adhesion": {"work_j_per_m2": work}}
    _, depth, force = curve("indentation", on, samples=4000, largest_displacement_mm=0.6)
    coming, going = np.split(np.arange(len(depth)), 2)
    assert force.min() == pytest.approx(-1.5 * np.pi * work * 1e-3 * R_MM, rel=1e-2)
    assert (force[coming][depth[coming] < 0] == 0).all()
    assert depth[going][force[going] < 0].min() < 0


def test_the_base_below_a_thin_layer_stiffens_it_as_the_exact_contact_says() -> None:
    """By the integral equation, at a/h = 0.3 the force is 1.0197 times Hertz's at that a, δR/a² = 0.7945."""
    h, radius = 2.0, 5.0
    description = described("indentation", {"layered_contact": {}}, indenters_mm=[radius], samples=2000)
    description["skin"]["thickness_mm"] = h
    (recorded,) = record_curves(parse(description))
    a = 0.3 * h
    found = np.interp(0.7945 * a**2 / radius, recorded.entry["displacement_mm"][:990], recorded.exact_force_n[:990])
    assert found == pytest.approx(1.0197 * 4 / 3 * E_MPA / 0.75 * a**3 / radius, rel=3e-4)


def test_stage_that_gives_moves_further_by_force_over_stiffness() -> None:
    _, depth, force = curve("indentation", {"instrument_compliance": {"stiffness_n_per_mm": 5.0}})
    assert force == pytest.approx(hertz(depth - force / 5.0), rel=1e-4, abs=1e-5)


@pytest.mark.parametrize(
    ("kind", "name", "values"),
    [("indentation", *item) for item in INDENTATION.items()] + [("compression", *item) for item in COMPRESSION.items()],
)
def test_every_effect_shows_and_is_seen_to_show(kind: str, name: str, values: dict[str, Any]) -> None:
    planned = parse(described(kind, {name: values}, force_noise_n=2e-3, contact_point_mm=0.01))
    recorded = record_curves(planned)
    assert visibility(planned, recorded).identifiable
    campaigns.parse(campaign_of_curves(planned, recorded))


def test_without_an_effect_there_is_nothing_to_see() -> None:
    for kind in ("indentation", "compression"):
        planned = parse(described(kind, {}, force_noise_n=2e-3, contact_point_mm=0.01))
        assert -15 < visibility(planned, record_curves(planned)).chi2_gain < 1e-3  # two fitted parameters


def test_every_effect_of_these_kinds_is_tested() -> None:
    for kind, tested in (("indentation", INDENTATION), ("compression", COMPRESSION)):
        assert set(tested) == {name for name, effect in effects.ALL_EFFECTS.items() if kind in effect.kinds}


def test_what_cannot_be_pressed_is_named() -> None:
    with pytest.raises(RigError, match=r"curves\.largest_displacement_mm = 2\.4: must be below 2\.25 mm, 0\.9"):
        curve("indentation", {}, largest_displacement_mm=2.4)
    held = r"curves\.samples = 60: leaves 4 samples while the load rises, in 8 s of 116 s: must leave at least 8"
    with pytest.raises(RigError, match=held):
        curve("compression", {}, samples=60, hold_s=100.0, largest_displacement_mm=0.8, speeds_mm_per_s=[0.1])
    with pytest.raises(RigError, match=r"effects\.strain_stiffening\.coefficient = 15\.0: locks at this load"):
        curve(
            "compression", {"strain_stiffening": {"coefficient": 15.0, "law": "limited"}}, largest_displacement_mm=1.0
        )
    with pytest.raises(RigError, match=r"lines = \{\}: not for recordings of kind indentation"):
        parse({**described("indentation", {}), "lines": {}})
