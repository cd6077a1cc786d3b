"""Curves, the rig's, raw ones and real ones: what is told of them, and what no law describes."""

import os
import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares

import underskin
from bench.soak import SOAK
from proof.real import recorded
from rig.description import parse as experiment
from rig.draw_curves import drawn_curves
from rig.effects import INDENTATION
from rig.elastomer import campaign_of_curves, record_curves
from tests.support.blocks import sample
from tests.support.cases import first
from tests.support.lean_reports import beside, lean_report
from tests.support.pressed_curves import pressed
from tests.support.slip_campaigns import looked_at
from underskin import Conditions, SkinDescription, load_table, predict
from underskin.physics.sphere_law import SphereLaw
from underskin.recordings.campaign import Campaign, IndentationConditions, IndentationRecording, parse
from underskin.surrogate.hdf5_format import load_contact
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

STAGE = beside("instrument_compliance", "strain_stiffening")
STICKY = beside("adhesion", "instrument_compliance", "strain_stiffening")


def names(report: dict[str, Any]) -> list[str]:
    return [entry["name"] for entry in report["mechanisms"]]


def made(document: dict[str, Any]) -> Campaign:
    """The rig's campaign of curves."""
    pressing = experiment({"schema": "experiment/1", "name": "curves", **document})
    return parse(campaign_of_curves(pressing, record_curves(pressing)))


def of_curve(
    depth: Floats,
    force: Floats,
    radius: float = 5.0,
    modulus: float | None = None,
    thickness: float = 80.0,
    **more: Any,
) -> Campaign:
    curve = IndentationRecording("i", radius, depth, force, **more)
    skin = SkinDescription(poisson_ratio=0.5, thickness_mm=thickness, youngs_modulus_mpa=modulus, sensor_radius_mm=1.0)
    return Campaign("one", skin, (curve,), units_checked=True)


def hertz(depth: Floats, radius: float = 5.0, modulus: float = 2.0) -> Floats:
    """[N], of an incompressible half space."""
    return np.asarray(16 / 9 * modulus * np.sqrt(radius) * np.maximum(depth, 0.0) ** 1.5)


def ways(*ends: float, samples: int = 400) -> Floats:
    """From one depth to the next."""
    return np.concatenate([np.linspace(here, there, samples) for here, there in pairwise(ends)])


@pytest.mark.slow
@pytest.mark.skipif("UNDERSKIN_RECORDINGS" not in os.environ, reason="UNDERSKIN_RECORDINGS names no folder")
@pytest.mark.parametrize("name", first(1, ["compression-EF10", "tension-RTV615", "compression-EF50"]))
def test_silicone_stiffens_and_does_not_creep_where_nothing_tells_time(name: str, table: SigmaTable) -> None:
    (entry,) = [entry for entry in recorded() if entry.name == name]
    report = lean_report(
        parse(entry.make(Path(os.environ["UNDERSKIN_RECORDINGS"]))), table,
        *beside("strain_stiffening", "contact_creep", "platen_friction"),
    )  # fmt: skip
    assert report["verdict"] == "explained"
    assert names(report) == ["strain_stiffening"]
    fit = report["fit"]
    assert fit["after"]["heldout_rmse_percent"] < fit["before"]["heldout_rmse_percent"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ends", "share"),
    first(
        2, [((-0.2, 0.3, -0.2), 0.9), ((0.03, 0.3, -0.3), 0.35), ((-0.01, 0.3, -0.3), -0.35), ((-0.3, 0.3, -0.04), 0.2)]
    ),
)
def test_a_drift_of_the_cell_is_no_mismatch(ends: tuple[float, ...], share: float, table: SigmaTable) -> None:
    """Of this share of the largest force over the curve: told by the air, where there is any."""
    depth = ways(*ends)
    force = hertz(depth)
    noise = 1e-3 * force.max() * np.random.default_rng(6).normal(size=len(depth))
    time = np.linspace(0, 300, len(depth))
    drifting = force + share * force.max() * time / 300 + noise
    report = lean_report(of_curve(depth, drifting, modulus=2.0, time_s=time), table, *STAGE)
    assert report["verdict"] == "no_mismatch"
    modulus = report["fit"]["before"]["youngs_modulus"]
    assert modulus["low"] < 2.0 < modulus["high"]


RIG: dict[str, Any] = {
    "seed": 11, "kind": "indentation",
    "skin": {"thickness_mm": 0.6, "youngs_modulus_mpa": 1.8, "sensor_radius_mm": 1.0, "d33_pc_per_n": 10.0},
    "curves": {
        "indenters_mm": first(1, [0.017, 0.012]), "largest_displacement_mm": 1.6e-3, "samples": 1000,
        "speeds_mm_per_s": [4e-4], "repeats": 1, "hold_s": 20.0, "retract": True, "approach_mm": 3e-4,
        "retreat_mm": 4e-4, "stage_stiffness_n_per_mm": 0.03, "stage_declared": False, "times": True,
        "modulus_declared": False, "units_checked": True, "contact_point_mm": 4.7e-3, "force_zero_n": 2.6e-7,
        "gain": 0.004, "cell_gain": 0.01, "force_noise_n": 2.2e-8,
    },
}  # fmt: skip
UNLISTED: list[tuple[dict[str, Any], dict[str, float]]] = [
    ({"plastic_set": {"ratio": 0.03}}, {}),
    ({"plastic_set": {"ratio": 0.03}}, {"repeats": 3, "force_noise_n": 4e-7}),
    ({"guide_friction": {"friction": 0.05, "slip_mm": 1e-4}}, {}),
    ({"guide_friction": {"friction": 0.05, "slip_mm": 1e-4}}, {"repeats": 3, "force_noise_n": 4e-7}),
]


@pytest.mark.slow
@pytest.mark.parametrize(("effect", "noisy"), first(1, UNLISTED))
def test_physics_that_no_law_describes_is_unexplained_although_a_law_takes_part_of_it(
    effect: dict[str, Any], noisy: dict[str, float], table: SigmaTable
) -> None:
    report = lean_report(made({**RIG, "curves": {**RIG["curves"], **noisy}, "effects": effect}), table, *STICKY)
    assert report["verdict"] == "unexplained"
    assert report["probability"] > 0.9
    if report["unnamed"] is None:
        findings = " ".join(entry["statement"] for entry in report["findings"])
        assert re.search(r"none of \d+ simple laws of one quantity over one axis", findings)
    plain = report["fit"]["before"]["least_squares_modulus_mpa"]
    assert f"Young's modulus {plain:.3g} MPa, leaves" in report["statement"]


@pytest.mark.parametrize("stiffness", [None, 3e-3, 1e3])
def test_the_known_stiffness_of_a_stage_decides_where_contact_ends(stiffness: float | None) -> None:
    """Against JKR's equilibrium, from its two equations alone."""
    radius, modulus, work = 7.5e-6, 1e6, 0.040
    reduced, a = modulus / 0.75, np.geomspace(1e-8, 6e-6, 100_001)
    depth = a**2 / radius - np.sqrt(2 * np.pi * work * a / reduced)
    force = 4 * reduced * a**3 / (3 * radius) - np.sqrt(8 * np.pi * work * reduced * a**3)
    travel = np.concatenate([np.linspace(-0.5e-3, 1e-3, 300), np.linspace(1e-3, -2e-3, 3000)])
    planned = IndentationConditions("i", 1e3 * radius, travel, stage_stiffness_n_per_mm=stiffness)
    skin = SkinDescription(poisson_ratio=0.5, youngs_modulus_mpa=1e-6 * modulus)
    values = {"contact_point i": 0.0, "work_of_adhesion": work}
    answer = predict(Conditions("one", skin, (planned,)), load_table(), values, mechanisms=["adhesion"])
    total = depth + (0.0 if stiffness is None else force / (1e3 * stiffness))
    assert travel[np.flatnonzero(answer.value)[-1]] == pytest.approx(1e3 * depth[total.argmin()], abs=3e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("samples", "ripple"), first(1, [(360, 5e-3), (1500, 0.0)]))
def test_plain_least_squares_leaves_what_scipy_leaves(samples: int, ripple: float, table: SigmaTable) -> None:
    random = np.random.default_rng(4)
    displacement = np.linspace(-0.1, 0.4, samples)
    depth = np.maximum(displacement - 0.02, 0.0)
    force = 0.3 + 2.0 * depth**1.5 * (1 + 0.6 * depth) + 2e-3 * random.normal(size=samples)  # not Hertz
    force += ripple * np.sin(np.arange(samples) / 3)  # as smooth within a block of samples as noise is not
    stated = looked_at(of_curve(displacement, force, 1.0), table, "strain_stiffening")["fit"]["before"]

    def residual(x: Floats, law: SphereLaw) -> Floats:
        return np.asarray(x[0] * law(displacement - x[1]) + x[2] - force)

    laws = [SphereLaw(1.0, None, 0.5, softening) for softening in (None, load_contact().softening)]
    linear, solved = (least_squares(residual, [2.0, 0.0, 0.3], args=(law,)) for law in laws)
    assert solved.cost < linear.cost  # so that all of finite strain is taken
    plain = 100 * np.sqrt((solved.fun**2).sum() / ((force - 0.3) ** 2).sum())
    assert stated["rmse_percent"] == pytest.approx(plain, rel=0.02)
    assert stated["least_squares_modulus_mpa"] == pytest.approx(solved.x[0] * 0.75, rel=0.01)


@pytest.mark.slow
def test_modulus_holds_true_value_wherever(
    table: SigmaTable,
) -> None:
    """A modulus holds the true value wherever the displacement has its zero and whatever is declared.

    Its interval goes past the declared value; nor is a sensor's radius any matter of an indentation.
    """
    depth = ways(-0.1, 0.2)
    force = hertz(depth) + 1e-3 * hertz(depth).max() * np.random.default_rng(9).normal(size=len(depth))
    fits = []
    for declared, zero_mm, thickness in ((1.98, 0.0, 80.0), (2.02, 0.0, 80.0), (2.0, 0.0, 80.0), (2.0, 77.0, 80.0)):
        report = looked_at(
            of_curve(depth + zero_mm, force, modulus=declared, thickness=thickness), table, "strain_stiffening"
        )
        stated = report["fit"]["before"]["youngs_modulus"]
        assert report["verdict"] == "no_mismatch"
        assert stated["low"] < 0.99 * declared < 1.01 * declared < stated["high"]
        assert stated["low"] < 2.0 < stated["high"]
        fits.append(report["fit"]["before"]["rmse_percent"])
    assert fits[3] == pytest.approx(fits[2], rel=1e-4)
    thin = looked_at(of_curve(depth, force, thickness=1e-3), table, "strain_stiffening")
    assert thin["verdict"] == "insufficient_data"
    assert "of the declared thickness" in thin["statement"]


def cylinders(heights_mm: list[float], table: SigmaTable, *known: str, **effects: Any) -> dict[str, Any]:
    """The report on cylinders of 12 MPa and 4 mm diameter without a declared modulus."""
    curves = {
        "heights_mm": heights_mm, "diameters_mm": [4.0], "largest_displacement_mm": 0.25, "samples": 120, "repeats": 3,
        "force_noise_n": 0.05, "gain": 0.005, "modulus_declared": False,
    }  # fmt: skip
    skin = {"thickness_mm": 2.5, "youngs_modulus_mpa": 12.0, "sensor_radius_mm": 1.0, "d33_pc_per_n": 10.0}
    whole = made({"seed": 4, "kind": "compression", "skin": skin, "curves": curves, "effects": effects})
    return lean_report(whole, table, *beside(*known))


@pytest.mark.slow
def test_friction_at_the_platens_is_told_from_the_modulus_by_two_shapes_alone(table: SigmaTable) -> None:
    """Of cylinders of one shape the interval of the modulus holds both."""
    for effects in ({}, {"platen_friction": {"friction": 0.9}}):
        modulus = cylinders([2.5], table, "platen_friction", **effects)["fit"]["before"]["youngs_modulus"]
        assert modulus["low"] < 12.0 < modulus["high"]
        assert modulus["high"] / modulus["low"] == pytest.approx(1.32, rel=0.05)  # 1 + 2 S² of a cylinder that sticks
    report = cylinders([2.5, 8.0], table, "platen_friction", "strain_stiffening", platen_friction={"friction": 0.9})
    assert names(report) == ["platen_friction"]
    modulus = report["fit"]["after"]["youngs_modulus"]
    assert modulus["low"] < 12.0 < modulus["high"]
    assert modulus["high"] / modulus["low"] < 1.1


@pytest.mark.slow
def test_a_curve_without_noise_agrees_with_its_law(table: SigmaTable) -> None:
    """Errors of rounding in the likelihood of an exact curve speak for no mechanism."""
    depth = np.linspace(0.0, 0.2, 200)
    exact = IndentationRecording("exact", 5.0, depth, hertz(depth, modulus=10.0), time_s=0.1 * np.arange(200.0))
    report = underskin.diagnose(Campaign("exact", SkinDescription(poisson_ratio=0.5), (exact,)), table)
    assert report.verdict == "no_mismatch", report.statement


@pytest.mark.slow
def test_a_strip_is_called_softer_only_where_it_is(table: SigmaTable) -> None:
    """A strip that softens first and then stiffens is said to do both, with the strains of the recording."""
    random, stretch = np.random.default_rng(1), np.linspace(1.0, 2.2, 160)
    invariant = stretch**2 + 2 / stretch - 3
    force = -9 * np.pi / 3 * (stretch - stretch**-2) * (0.7 + 0.3 / stretch + 0.05 * invariant**2)
    force += 2e-3 * np.abs(force).max() * random.normal(size=160)
    report = underskin.diagnose(sample(20 * (1 - stretch), force, height_mm=20.0, diameter_mm=6.0), table)
    words = r"force over that of a neo-Hookean solid is ([\d.]+) at (\d+) % strain and ([\d.]+) at 118 % strain"
    said = re.search(words, report.statement)
    assert said, report.statement
    softest, strain, end = map(float, said.groups())
    assert softest == pytest.approx(0.92, abs=0.03)
    assert 30 < strain < 70
    assert end == pytest.approx(1.18, abs=0.06)


@pytest.mark.slow
@pytest.mark.parametrize("seed", first(1, [1, 2]))
def test_a_seating_platen_is_no_stiffening_and_stiffening_no_seat(seed: int, table: SigmaTable) -> None:
    curves = {
        "heights_mm": [10.0], "diameters_mm": [20.0], "largest_displacement_mm": 1.0, "samples": 120, "repeats": 3,
        "force_noise_n": 0.1, "contact_point_mm": 0.03, "modulus_declared": False,
    }  # fmt: skip
    skin = {"thickness_mm": 10.0, "youngs_modulus_mpa": 0.5, "sensor_radius_mm": 1.0, "d33_pc_per_n": 10.0}
    pad = {"seed": seed, "kind": "compression", "skin": skin, "curves": curves}
    known = beside("strain_stiffening", "platen_friction", "contact_creep")
    seated = lean_report(made({**pad, "effects": {"tilted_platen": {"wedge_mm": 0.06}}}), table, *known)
    assert seated["verdict"] == "no_mismatch"
    modulus = seated["fit"]["before"]["youngs_modulus"]
    assert modulus["low"] < 0.5 < modulus["high"]
    stiff = lean_report(made({**pad, "effects": {"strain_stiffening": {"coefficient": 2.0}}}), table, *known)
    assert (stiff["verdict"], names(stiff)) == ("explained", ["strain_stiffening"])
    assert "seating" not in {entry["code"] for entry in stiff["findings"]}


@pytest.mark.soak
def test_two_mechanisms_that_share_a_bend_are_both_found(table: SigmaTable) -> None:
    """An elastomer whose modulus grows with the strain, pressed by a stage that gives: each bends the curves alike."""
    whole = parse(campaign_of_curves(*drawn_curves(777001, 109, INDENTATION, "pair")))
    report = lean_report(whole, table, *STAGE)
    found = {entry["name"]: entry["parameters"] for entry in report["mechanisms"]}
    assert set(found) == {"instrument_compliance", "strain_stiffening"}
    (stage,) = found["instrument_compliance"]
    assert stage["low"] < 57.8 < stage["high"] < 70  # alone it would have 124


@pytest.mark.slow
def test_imitated_laws_take_probability(table: SigmaTable) -> None:
    """Unlisted laws that would look like an explanation take from its probability: fewer of them, the stronger the
    effect and the more spheres show it."""

    def reported(stiffness: float, radii: Sequence[float]) -> dict[str, Any]:
        report = lean_report(pressed(stiffness, radii), table, *beside("instrument_compliance"))
        assert names(report) == ["instrument_compliance"]
        return report

    weak, strong = reported(30.0, (20.0,)), reported(3.0, (5.0,))
    assert weak["probability"] < strong["probability"]
    if SOAK:
        assert weak["probability"] < reported(30.0, (2.0, 20.0))["probability"]
    other = [entry for entry in weak["alternatives"] if entry["mechanisms"] == ["none_of_these"]]
    assert other[0]["probability"] <= weak["probability"]


@pytest.mark.slow
def test_drag_of_a_liquid_leaves_the_modulus() -> None:
    """A soft gel under a cantilever in a liquid: the zeros of both ways differ, the force steps where it turns, and
    threads of gel let go gradually, without a jump. Adhesion and drag lead, though no law describes threads; E, 15 kPa,
    and the drag lie in their intervals, that of E as wide as a stage that gives would have it."""
    travel = 1e-3 * np.concatenate([np.linspace(-3.0, 0.17, 1200), np.linspace(0.17, -3.0, 1201)[1:]])  # mm
    time = 5e-4 * np.arange(len(travel))
    force = 16 / 9 * 0.015 * np.sqrt(0.010) * np.maximum(travel, 0.0) ** 1.5
    largest, back = force.max(), np.arange(len(travel)) >= 1200
    drag = 0.012 * largest / (travel[1] - travel[0]) * 5e-4
    stuck = np.where(travel > -5e-5, (1.7e-4 - travel) / 2.2e-4, np.exp((travel + 5e-5) / 3e-5))
    force += drag * np.gradient(travel, time) - 0.1 * largest * np.where(back, np.clip(stuck, 0.0, 1.0), 0.0)
    force += 3e-3 * largest * np.random.default_rng(4).normal(size=len(time))
    recording = IndentationRecording("gel", 0.010, travel, force, time_s=np.asarray(time, dtype=np.float64))
    measured = Campaign("gel", SkinDescription(poisson_ratio=0.5), (recording,), units_checked=True)
    report = underskin.diagnose(measured, without=beside("liquid_drag", "instrument_compliance", "adhesion"))
    assert report.verdict in ("explained", "ambiguous"), report.statement
    assert {mechanism.name for mechanism in report.mechanisms} == {"liquid_drag", "adhesion"}
    assert report.fit is not None
    modulus = report.fit.after.youngs_modulus
    (found,) = (mechanism.parameters[0] for mechanism in report.mechanisms if mechanism.name == "liquid_drag")
    assert modulus is not None
    assert modulus.low is not None
    assert modulus.high is not None
    assert modulus.low <= 0.015 <= modulus.high < 2.5 * modulus.low
    assert modulus.value == pytest.approx(0.015, rel=0.1)
    assert found.low <= drag <= found.high


@pytest.mark.slow
def test_a_friction_of_the_guide_reads_as_drag_at_one_speed() -> None:
    """A constant force against the motion of a sphere that moves in and back at one speed: E is right, and the drag is
    said to be a possible friction, with its size beside that of water."""
    travel = np.concatenate([np.linspace(-0.3, 0.6, 200), np.linspace(0.6, -0.3, 201)[1:]])
    force = 16 / 9 * np.sqrt(5.0) * np.maximum(travel, 0.0) ** 1.5 + 0.1 * np.sign(np.gradient(travel))
    force += 4e-3 * np.random.default_rng(4).normal(size=len(travel))
    recording = IndentationRecording("p", 5.0, travel, force, time_s=0.09 * np.arange(len(travel), dtype=np.float64))
    report = underskin.diagnose(Campaign("p", SkinDescription(poisson_ratio=0.5), (recording,)))
    assert [mechanism.name for mechanism in report.mechanisms] == ["liquid_drag"]
    assert "a friction of the guide, constant against the motion, reads the same" in report.statement
    assert "1e+06 times the drag of water" in report.statement
