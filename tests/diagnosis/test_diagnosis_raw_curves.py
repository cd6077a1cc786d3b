"""Raw curves as nanoindenters write them: air on both sides, snap-in, hysteresis, pull-off, noise, arbitrary zeros."""

import json
import os
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares

from rig.description import parse as rig_experiment
from rig.elastomer import campaign_of_curves, record_curves
from tests.support.adhesive_curves import MODULUS_MPA, WORK_J_PER_M2, adhesive_curves
from tests.support.cases import first
from tests.support.lean_reports import lean_report
from underskin.diagnosis.data.curve_samples import curve_lines
from underskin.diagnosis.data.names import NOTHING_MISSING
from underskin.diagnosis.inference.explanation import FittingProblem, Request
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.diagnosis.reporting.goodness_of_fit import modulus
from underskin.diagnosis.reporting.numbers import multiple_of
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.unnamed_rivals import Discrepancy
from underskin.prediction.forward_model import predict
from underskin.recordings.campaign import Campaign, IndentationRecording, parse
from underskin.recordings.conditions import Conditions, IndentationConditions, SkinDescription
from underskin.recordings.curve_course import course
from underskin.surrogate.sigma_table import SigmaTable, load_table
from underskin.units import Floats

CAMPAIGNS = os.environ.get("UNDERSKIN_CAMPAIGNS")
RADIUS, MODULUS, ADHESION, SEPARATION, STAGE = 7.5e-6, 1e6, 0.040, 0.075, 3.0  # SI


def branch(work: float) -> tuple[Floats, Floats, Floats]:
    """Contact radius, δ and F of JKR's equilibrium, written from the two equations alone."""
    reduced, a = MODULUS / 0.75, np.geomspace(1e-8, 6e-6, 100_001)
    depth = a**2 / RADIUS - np.sqrt(2 * np.pi * work * a / reduced)
    return a, depth, 4 * reduced * a**3 / (3 * RADIUS) - np.sqrt(8 * np.pi * work * reduced * a**3)


def nanoindentation(seed: int, samples: int = 3100) -> dict[str, Any]:
    """A sphere that snaps in, is pressed, rests pinned, recedes and tears off, on a stage of known stiffness."""
    random = np.random.default_rng(seed)
    reduced = MODULUS / 0.75
    travel = np.concatenate([np.linspace(-3e-6, 1.5e-6, samples // 2), np.linspace(1.5e-6, -6e-6, samples // 2)])
    stable = {}
    for name, work in (("in", ADHESION), ("out", SEPARATION)):
        a, depth, force = branch(work)
        total = depth + force / STAGE
        stable[name] = total[total.argmin() :], a[total.argmin() :]
    depth, force, edge = travel.copy(), np.zeros(len(travel)), 0.0
    for sample, at in enumerate(travel):
        if edge == 0 and at >= 0 and sample < samples // 2:
            edge = float(np.interp(at, *stable["in"]))
        edge = edge if at >= stable["out"][0][0] else 0.0
        if edge > 0:
            edge = float(np.clip(edge, np.interp(at, *stable["in"]), np.interp(at, *stable["out"])))
            hertz, stiffness = 4 * reduced * edge**3 / (3 * RADIUS), 2 * reduced * edge
            stretch = (edge**2 / RADIUS + hertz / STAGE - at) / (1 + stiffness / STAGE)
            depth[sample], force[sample] = edge**2 / RADIUS - stretch, hertz - stiffness * stretch
    time = 0.002 * np.arange(len(travel))
    measured = 1.01 * force + 3e-10 * random.normal(size=len(force)) + 2e-9 + 1e-10 * time
    return {
        "id": f"r{seed}", "kind": "indentation", "indenter_radius_mm": 1e3 * RADIUS, "time_s": time.tolist(),
        "displacement_mm": (1e3 * (depth + 1.2e-5)).tolist(), "force_n": measured.tolist(),
    }  # fmt: skip


def campaign(*recordings: dict[str, Any]) -> dict[str, Any]:
    skin = {"poisson_ratio": 0.5, "sensor_radius_mm": 1.0, "thickness_mm": 2.0}
    return {"schema": "campaign/1", "name": "nano", "units_checked": True, "skin": skin, "recordings": list(recordings)}


@pytest.mark.slow
def test_a_textbook_case_of_adhesion_is_named_with_its_modulus_and_both_works(table: SigmaTable) -> None:
    report = diagnosis_report(parse(campaign(nanoindentation(1))), table)
    assert report["verdict"] == "explained"
    (mechanism,) = report["mechanisms"]
    assert mechanism["name"] == "adhesion"
    values = {entry["name"]: entry for entry in mechanism["parameters"]}
    modulus = report["fit"]["after"]["youngs_modulus"]
    assert modulus["value"] == pytest.approx(MODULUS * 1e-6, rel=0.05)
    for name, truth in (("work_of_adhesion", ADHESION), ("work_of_separation", SEPARATION)):
        assert values[name]["unit"] == "J/m²"
        assert values[name]["value"] == pytest.approx(truth, rel=0.05)
        assert values[name]["low"] < truth < values[name]["high"]
    fit = report["fit"]
    assert fit["before"]["rmse_percent"] > 20 > 1 > fit["after"]["rmse_percent"]
    assert fit["after"]["heldout_rmse_percent"] < 3 * fit["noise_floor_percent"]


@pytest.mark.slow
@pytest.mark.parametrize("work", first(1, [WORK_J_PER_M2, 5.0]))  # the sphere tears off on the way back, or does not
def test_a_jump_into_contact_between_two_samples_asks_for_no_companion(work: float, table: SigmaTable) -> None:
    report = diagnosis_report(parse(adhesive_curves(work)[0]), table)
    assert report["verdict"] == "explained"
    (named,) = report["mechanisms"]
    assert named["name"] == "adhesion"
    assert named["parameters"][0]["low"] < work < named["parameters"][0]["high"]
    modulus = report["fit"]["after"]["youngs_modulus"]
    assert modulus["low"] <= MODULUS_MPA <= modulus["high"]
    assert report["fit"]["after"]["heldout_rmse_percent"] < 1.2 * report["fit"]["noise_floor_percent"]


@pytest.mark.slow
def test_a_remainder_that_is_small_beside_what_a_law_explains_does_not_contradict_it(table: SigmaTable) -> None:
    recording = nanoindentation(3)
    depth, force = np.array(recording["displacement_mm"]), np.array(recording["force_n"])
    wave = 0.004 * force.max() * np.sin(2 * np.pi * (depth - depth.min()) / 0.5 / np.ptp(depth))
    recording["force_n"] = (force + wave).tolist()
    report = diagnosis_report(parse(campaign(recording)), table)
    assert report["verdict"] == "explained"
    assert [entry["name"] for entry in report["mechanisms"]] == ["adhesion"]


_RIG: dict[str, Any] = {
    "schema": "experiment/1", "name": "unlisted", "seed": 11, "kind": "indentation",
    "skin": {"thickness_mm": 0.6, "youngs_modulus_mpa": 1.8, "sensor_radius_mm": 1.0, "d33_pc_per_n": 10.0},
    "curves": {
        "indenters_mm": first(1, [0.017, 0.012]), "largest_displacement_mm": 1.6e-3, "samples": 1000,
        "speeds_mm_per_s": [4e-4], "repeats": 1, "hold_s": 20.0, "retract": True, "approach_mm": 3e-4,
        "retreat_mm": 4e-4, "stage_stiffness_n_per_mm": 0.03, "stage_declared": False, "times": True,
        "modulus_declared": False, "units_checked": True, "contact_point_mm": 4.7e-3, "force_zero_n": 2.6e-7,
        "gain": 0.004, "cell_gain": 0.01, "force_noise_n": 2.2e-8,
    },
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    "effect", first(1, [{"plastic_set": {"ratio": 0.03}}, {"guide_friction": {"friction": 0.05, "slip_mm": 1e-4}}])
)
@pytest.mark.parametrize("noisy", [{}, {"repeats": 3, "force_noise_n": 4e-7}], ids=["clear", "below a sample's noise"])
def test_physics_that_no_law_describes_is_unexplained_although_a_law_takes_part_of_it(
    effect: dict[str, dict[str, float]], noisy: dict[str, float], table: SigmaTable
) -> None:
    experiment = rig_experiment({**_RIG, "curves": {**_RIG["curves"], **noisy}, "effects": effect})
    made = parse(campaign_of_curves(experiment, record_curves(experiment)))
    report = lean_report(made, table, "contact_creep", "compressible_layer")
    assert report["verdict"] == "unexplained"
    assert report["probability"] > 0.9
    plain = report["fit"]["before"]
    if report["unnamed"] is None:
        findings = " ".join(entry["statement"] for entry in report["findings"])
        assert re.search(r"none of \d+ simple laws of one quantity over one axis", findings)
    assert f"Young's modulus {plain['least_squares_modulus_mpa']:.3g} MPa, leaves" in report["statement"]


@pytest.mark.parametrize("stiffness", [None, 3e-3, 1e3])
def test_the_known_stiffness_of_a_stage_decides_where_contact_ends(stiffness: float | None) -> None:
    up, down = np.linspace(-0.5e-3, 1e-3, 300), np.linspace(1e-3, -2e-3, 3000)
    planned = IndentationConditions("i", 1e3 * RADIUS, np.concatenate([up, down]), stage_stiffness_n_per_mm=stiffness)
    skin = SkinDescription(poisson_ratio=0.5, youngs_modulus_mpa=1e-6 * MODULUS)
    answer = predict(
        Conditions("one", skin, (planned,)),
        load_table(),
        {"contact_point i": 0.0, "work_of_adhesion": ADHESION},
        mechanisms=["adhesion"],
    )
    _, depth, force = branch(ADHESION)
    total = depth + (0.0 if stiffness is None else force / (1e3 * stiffness))
    last = np.concatenate([up, down])[np.flatnonzero(answer.value)[-1]]
    assert last == pytest.approx(1e3 * depth[total.argmin()], abs=3e-6)


def test_the_course_of_a_curve_is_found_from_its_samples() -> None:
    recording = nanoindentation(2)
    displacement, force = np.array(recording["displacement_mm"]), np.array(recording["force_n"])
    seen = course(displacement, force)
    jump = int(np.argmin(np.diff(force[:1550]))) + 1
    assert seen.snap_in == jump
    assert seen.pull_off == 1550 + int(np.argmax(np.diff(force[1550:]))) + 1
    assert seen.turn == int(np.argmax(displacement))
    assert seen.noise == pytest.approx(3e-10, rel=0.1)
    assert seen.zero == pytest.approx(2e-9, abs=2e-10)
    assert seen.has_air


def test_a_curve_without_air_or_jumps_has_none() -> None:
    displacement = np.linspace(0.0, 0.3, 400)
    seen = course(displacement, displacement**1.5 + 1e-5 * np.random.default_rng(1).normal(size=400))
    assert (seen.snap_in, seen.pull_off) == (None, None)
    assert seen.turn == seen.leave == 399


@pytest.mark.parametrize(("samples", "ripple"), [(1500, 0.0), (360, 5e-3)])
def test_plain_least_squares_leaves_what_scipy_leaves(samples: int, ripple: float, table: SigmaTable) -> None:
    random = np.random.default_rng(4)
    displacement = np.linspace(-0.1, 0.4, samples)
    depth = np.maximum(displacement - 0.02, 0.0)
    force = 0.3 + 2.0 * depth**1.5 * (1 + 0.6 * depth) + 2e-3 * random.normal(size=samples)  # not Hertz
    force += ripple * np.sin(np.arange(samples) / 3)  # as smooth within a block of samples as noise is not
    recording = IndentationRecording("i", 1.0, displacement, force)
    problem = FittingProblem(
        curve_lines(Campaign("c", SkinDescription(poisson_ratio=0.5), (recording,)), "indentation"), table
    )
    explanation = problem.explain([Request(())])[0]
    assert explanation is not None
    ours = explanation.least_squares[1]

    def residual(x: Floats) -> Floats:
        return np.asarray(x[0] * np.maximum(displacement - x[1], 0.0) ** 1.5 + x[2] - force)

    fitted = least_squares(residual, [2.0, 0.0, 0.3])
    zero = course(displacement, force).zero
    plain = 100 * np.sqrt((fitted.fun**2).sum() / ((force - zero) ** 2).sum())
    assert ours == pytest.approx(plain, rel=0.01)


def hertzian(table: SigmaTable, declared_mpa: float = 2.0, zero_mm: float = 0.0) -> FittingProblem:
    """A curve of 2 MPa on a layer that is hardly felt."""
    depth = np.linspace(-0.1, 0.2, 400)
    hertz = 16 / 9 * 2.0 * np.sqrt(5.0) * np.maximum(depth, 0) ** 1.5
    force = hertz + 1e-3 * hertz.max() * np.random.default_rng(9).normal(size=len(depth))
    skin = SkinDescription(poisson_ratio=0.5, youngs_modulus_mpa=declared_mpa, thickness_mm=80.0)
    curve = IndentationRecording("i", 5.0, depth + zero_mm, force)
    return FittingProblem(curve_lines(Campaign("c", skin, (curve,)), "indentation"), table)


def test_on_curves_a_mechanism_or_a_process_must_bring_five_nats(table: SigmaTable) -> None:
    nothing, layer = hertzian(table).explain([Request(()), Request(("layered_contact",))])
    assert nothing is not None
    assert layer is not None
    process = Discrepancy(nothing.log_evidence + 4.0, {})
    for nats, leader in ((4.9, NOTHING_MISSING), (5.1, "layered_contact")):
        law = replace(layer, log_evidence=nothing.log_evidence + nats)
        search = Search((nothing, law), ((nothing, process),), {})
        assert search.answers[0].names == (leader,)


def test_what_is_fitted_as_a_multiple_has_bounds_in_its_own_unit(table: SigmaTable) -> None:
    problem = FittingProblem(curve_lines(parse(campaign(nanoindentation(1, 800))), "indentation"), table)
    (explanation,) = problem.explain([Request(("adhesion",))])
    assert explanation is not None
    by_name = {entry.name: entry for entry in explanation.model.parameters}
    assert multiple_of(explanation, by_name["work_of_adhesion"]) == 1.0
    assert multiple_of(explanation, by_name["work_of_separation"]) == pytest.approx(ADHESION, rel=0.1)


@pytest.mark.parametrize("declared", [1.98, 2.0, 2.02])
def test_the_interval_of_a_modulus_goes_past_the_declared_value(declared: float, table: SigmaTable) -> None:
    problem = hertzian(table, declared)
    (nothing,) = problem.explain([Request(())])
    assert nothing is not None
    stated = modulus(problem, nothing)
    assert stated["low"] < 0.99 * declared < 1.01 * declared < stated["high"]
    assert stated["low"] < 2.0 < stated["high"]


def test_a_fit_does_not_depend_on_where_the_displacement_has_its_zero(table: SigmaTable) -> None:
    here, there = (hertzian(table, zero_mm=zero).explain([Request(())])[0] for zero in (0.0, 77.0))
    assert here is not None
    assert there is not None
    assert there.log_evidence == pytest.approx(here.log_evidence, abs=0.02)
    left = [one.least_squares[1] for one in (here, there)]
    assert left[1] == pytest.approx(left[0], rel=1e-4)


def test_a_sensor_s_radius_is_no_matter_of_an_indentation(table: SigmaTable) -> None:
    displacement = np.linspace(-0.05, 0.3, 300)
    force = 2.0 * np.maximum(displacement, 0.0) ** 1.5 + 1e-4 * np.random.default_rng(5).normal(size=300)
    recording = {
        "id": "i", "kind": "indentation", "indenter_radius_mm": 4.0,
        "displacement_mm": displacement.tolist(), "force_n": force.tolist(),
    }  # fmt: skip
    document = campaign(recording)
    document["skin"]["thickness_mm"] = 1e-3 * document["skin"]["sensor_radius_mm"]
    assert diagnosis_report(parse(document), table)["verdict"] != "insufficient_data"


@pytest.mark.slow
@pytest.mark.skipif(CAMPAIGNS is None, reason="UNDERSKIN_CAMPAIGNS names no folder of concealed campaigns")
@pytest.mark.parametrize(
    "name", first(2, ["v1x2sxf5n", "v48jbeq3p", "v4j8zegt1", "v7bb8mnv4", "vb2c4z9ma", "v0w0qva2y"])
)
def test_curves_of_an_independent_rig_are_named_with_their_modulus(table: SigmaTable, name: str) -> None:
    assert CAMPAIGNS is not None
    truth = json.loads((Path(CAMPAIGNS) / "curves-open-truth.json").read_text(encoding="utf-8"))[name]
    document = json.loads((Path(CAMPAIGNS) / "curves-open" / f"{name}.json").read_text(encoding="utf-8"))
    report = diagnosis_report(parse(document), table)
    assert report["verdict"] == ("explained" if truth["effects"] else "no_mismatch")
    assert {entry["name"] for entry in report["mechanisms"]} == set(truth["effects"])
    assert report["fit"]["after"]["youngs_modulus"]["value"] == pytest.approx(truth["youngs_modulus_mpa"], rel=0.05)
