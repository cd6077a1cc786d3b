"""Fits of curves: what must not stop one, what a hold and a snap-in look like, and what a contradicted law keeps."""

from dataclasses import replace

import numpy as np
import pytest

from rig.description import parse as experiment
from rig.draw_curves import drawn_curves
from rig.effects import INDENTATION
from rig.elastomer import campaign_of_curves, record_curves
from tests.support.pressed_curves import explained, pressed
from underskin.diagnosis.data.curve_samples import curve_lines
from underskin.diagnosis.inference.curve_starts import between_samples
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.optimizer import Fitter
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.validation.cross_validation import PredictionScore
from underskin.diagnosis.validation.imitation import unseen
from underskin.diagnosis.validation.residual_noise import keeps_structure
from underskin.mechanisms.models.curves import CurveModel
from underskin.recordings.campaign import IndentationRecording, parse
from underskin.recordings.curve_course import course, touch
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

SUPPORTED = 6


@pytest.fixture(scope="module")
def stage(table: SigmaTable) -> tuple[Explanation, Explanation]:
    return explained(pressed(3.0, (5.0,)), ("instrument_compliance",), table)


@pytest.mark.slow
def test_fits_of_what_relaxes_and_stiffens_end_alike_from_anywhere(table: SigmaTable) -> None:
    """On a drawn campaign with one relaxation time, where the share of a second one changes nothing."""
    drawn = campaign_of_curves(*drawn_curves(31001, 33, INDENTATION, "pair"))
    found, _ = explained(parse(drawn), ("contact_creep", "strain_stiffening"), table)
    names = [entry.name for entry in found.model.parameters]
    fitter = Fitter([found.best.hypothesis])
    reached = []
    for form, exponent in [(1.0, 1.8), (-1.0, 1.1), (2.0, 1.2)]:
        fit = found.point.fit.copy()
        fit[names.index("stiffening_form")], fit[names.index("stiffening_exponent")] = form, exponent
        reached.append(float(fitter.improve(fitter.at(replace(found.point, fit=fit))).cost[0]))
    assert max(reached) < min(*reached, found.best.cost) + 0.5


@pytest.mark.slow
def test_a_contact_point_of_what_sticks_stays_between_two_samples(stage: tuple[Explanation, Explanation]) -> None:
    hypothesis, fit = stage[0].best.hypothesis, stage[0].point.fit
    model = hypothesis.model
    assert isinstance(model, CurveModel)
    whole = hypothesis.bounds
    low, high = between_samples(hypothesis, fit, *whole)
    (place,) = model.contact_points
    travel = 1e3 * model.displacement[0]
    travel = np.sort(travel[: int(travel.argmax()) + 1])
    after = int(np.searchsorted(travel, fit[place]))
    assert travel[after - 1] < low[place] <= fit[place] <= high[place] == pytest.approx(travel[after])
    others = np.arange(len(fit)) != place
    assert (low[others] == whole[0][others]).all()
    assert (high[others] == whole[1][others]).all()


@pytest.mark.slow
def test_a_set_fitted_from_a_larger_one_fits_as_well_as_from_nothing(table: SigmaTable) -> None:
    campaign = pressed(3.0, (5.0,))
    problem = FittingProblem(curve_lines(campaign, "indentation"), table)
    both, _ = explained(campaign, ("contact_creep", "instrument_compliance"), table)
    alone, _ = explained(campaign, ("instrument_compliance",), table)
    (found,) = problem.explain([Request(("instrument_compliance",), larger=both)])
    assert found is not None
    assert found.best.cost == pytest.approx(alone.best.cost, abs=0.1)


def held(noise: float, hold: int) -> Floats:
    """A way of 300 samples in, `hold` samples still, and 200 back."""
    random = np.random.default_rng(6)
    way = np.concatenate([np.linspace(0, 1, 300), np.ones(hold), np.linspace(1, 0.2, 200)])
    return way + noise * random.normal(size=len(way))


@pytest.mark.parametrize("noise", [0.0, 1e-3, 3e-3])
def test_a_hold_is_found_although_the_displacement_is_noisy(noise: float) -> None:
    way = held(noise, 250)
    seen = course(way, np.maximum(way - 0.3, 0) ** 1.5)
    assert seen.leave == pytest.approx(549, abs=10)
    assert seen.arrive == (pytest.approx(300, abs=10) if noise else seen.turn)


@pytest.mark.parametrize("noise", [0.0, 1e-3, 3e-3])
def test_a_turn_is_no_hold(noise: float) -> None:
    way = held(noise, 0)
    seen = course(way, np.maximum(way - 0.3, 0) ** 1.5)
    assert seen.arrive == seen.turn
    assert seen.leave <= seen.turn + 2


@pytest.mark.parametrize(("dip", "found"), [(-12.0, True), (-3.0, False)])
def test_a_snap_in_that_one_sample_shows_is_found(dip: float, found: bool) -> None:
    """Beside noise of 1; the force rises at once behind it."""
    random = np.random.default_rng(7)
    way = np.concatenate([np.linspace(-1, 1, 200), np.linspace(1, -1, 200)])
    force = 600 * np.maximum(way, 0) ** 1.5 + random.normal(size=len(way))
    first = int(np.argmax(way >= 0))
    force[first] += dip
    assert course(way, force).snap_in == (first if found else None)


def test_parameters_that_the_rest_leaves_open_do_not_contradict() -> None:
    missed = PredictionScore(square=16.0, size=1.0, noise=1.0, recordings=1)
    assert missed.is_missed(3.0)
    assert not replace(missed, unsure=1.0).is_missed(3.0)


@pytest.mark.slow
def test_a_set_that_leaves_structure_keeps_a_little_and_the_null_hypothesis_nothing(
    stage: tuple[Explanation, Explanation],
) -> None:
    leader, null = stage
    for contradicted, least, most in ((leader.names, 0.04, 0.06), (null.names, 0.0, 0.0)):
        better = leader if contradicted else replace(null, log_evidence=leader.log_evidence + 50)
        search = Search((better,) if not contradicted else (null, leader), (), {}, frozenset([contradicted]))
        beside = {answer.names: answer.probability for answer in search.answers}
        assert sum(beside.values()) == pytest.approx(1.0)
        assert max(beside, key=lambda names: beside[names]) == ("none_of_these",)
        assert least <= beside.get(contradicted or ("nothing_missing",), 0.0) <= most


@pytest.mark.slow
def test_more_spheres_leave_fewer_laws_that_would_not_show(table: SigmaTable) -> None:
    odds = []
    for radii in ((5.0,), (1.0, 5.0)):
        _, null = explained(pressed(1e6, radii), ("instrument_compliance",), table)
        found = unseen(null, SUPPORTED)
        assert 0 < found.imitated < found.laws
        odds.append(found.odds)
    assert 0.05 / 0.45 > odds[0] > odds[1]


def test_a_touch_lies_half_a_step_of_the_stage_beyond_the_last_sample_in_the_air() -> None:
    """Under a stage that gives the depth jumps by more than a step."""
    assert touch(np.array([-0.3, -0.2, -0.1, 0.4, 0.5]), 3) == pytest.approx(-0.05)
    assert touch(np.array([-0.3, -0.2, -0.1, 0.0, 0.1]), 3) == pytest.approx(-0.05)


@pytest.mark.slow
def test_adhesion_under_a_soft_stage_is_fitted_to_its_noise_from_far_off(table: SigmaTable) -> None:
    """On a drawn campaign with jumps on both ways, where fits ended above the null hypothesis."""
    experiment, curves = drawn_curves(31007, 28, INDENTATION, "single")
    found, null = explained(parse(campaign_of_curves(experiment, curves)), ("adhesion",), table)
    work, separation = found.own("adhesion")
    true = experiment.effects["adhesion"]
    assert np.exp(work) == pytest.approx(true["work_j_per_m2"], rel=0.03)
    assert np.exp(work + separation) == pytest.approx(true["work_of_separation_j_per_m2"], rel=0.03)
    assert found.best.cost < null.best.cost - 1000


@pytest.mark.slow
def test_jumps_that_noise_hides_do_not_take_from_the_work_of_adhesion(table: SigmaTable) -> None:
    """Pull-off lies some ten times the noise below the air, too little for a jump; no mean is taken over it."""
    work = 0.3
    pressing = experiment(
        {
            "schema": "experiment/1", "name": "hidden", "seed": 5, "kind": "indentation",
            "skin": {"thickness_mm": 80.0, "youngs_modulus_mpa": 3.0, "sensor_radius_mm": 1.5, "d33_pc_per_n": 14.0},
            "curves": {
                "indenters_mm": [1.2, 1.5], "largest_displacement_mm": 0.25, "samples": 400, "repeats": 2,
                "retract": True, "approach_mm": 0.04, "retreat_mm": 0.04, "force_noise_n": 4e-4,
                "modulus_declared": False, "stage_stiffness_n_per_mm": 1e5, "stage_declared": True,
            },
            "effects": {"adhesion": {"work_j_per_m2": work}},
        }
    )  # fmt: skip
    campaign = parse(campaign_of_curves(pressing, record_curves(pressing)))
    hidden = 0
    smooth = curve_lines(campaign, "indentation").smooth
    assert smooth is not None
    first = 0
    for entry in campaign.recordings:
        assert isinstance(entry, IndentationRecording)
        seen = course(entry.displacement_mm, entry.force_n)
        if seen.pull_off is None:
            hidden += 1
            least = first + seen.turn + int(np.argmin(entry.force_n[seen.turn :]))
            assert smooth.count[np.searchsorted(np.cumsum(smooth.count), least, side="right")] == 1
        first += len(entry.force_n)
    assert hidden >= 2
    found, _ = explained(campaign, ("adhesion",), table)
    place = found.best.hypothesis.mean_places.index(0)
    assert found.model.parameters[0].name == "work_of_adhesion"
    deviation = float(np.sqrt(found.best.covariance[place, place]))
    assert abs(found.point.fit[0] - np.log(work)) < 2.5 * deviation < 0.15


@pytest.mark.slow
@pytest.mark.parametrize(
    ("samples", "noise", "bend", "contradicted"),
    [(1500, 0.01, 0.0, False), (1500, 0.01, 0.012, True), (40, 1e-5, 3e-3, False)],
)
def test_a_bend_below_the_noise_that_all_samples_show_contradicts_hertz(
    samples: int, noise: float, bend: float, contradicted: bool, table: SigmaTable
) -> None:
    """Noise and bend in shares of the largest force; of few samples the noise is told from how they bend, too large."""
    random = np.random.default_rng(8)
    travel = np.concatenate([np.linspace(-0.1, 0.3, samples), np.linspace(0.3, -0.1, samples)])
    force = np.maximum(travel / 0.3, 0.0) ** 1.5 * (1 + bend * np.sin(40 * travel))
    force += noise * random.normal(size=len(travel))
    time = np.arange(float(len(travel))).tolist()
    curve = {"displacement_mm": travel.tolist(), "force_n": force.tolist(), "time_s": time}
    named = {"id": "c", "kind": "indentation", "indenter_radius_mm": 5.0}
    whole = {"schema": "campaign/1", "name": "bent", "units_checked": True, "skin": {"poisson_ratio": 0.5}}
    problem = FittingProblem(curve_lines(parse({**whole, "recordings": [{**named, **curve}]}), "indentation"), table)
    (null,) = problem.explain([Request(())])
    assert null is not None
    assert keeps_structure(problem, null, null) is contradicted


@pytest.mark.slow
@pytest.mark.parametrize("work", [5e-6, 5e-5])
def test_adhesion_of_a_gel_in_a_liquid_leaves_the_modulus_right(work: float, table: SigmaTable) -> None:
    """Some µJ/m², a ten-thousandth of a silicone's in air."""
    pressing = experiment(
        {
            "schema": "experiment/1", "name": "gel", "seed": 5, "kind": "indentation",
            "skin": {"thickness_mm": 5.0, "youngs_modulus_mpa": 0.01, "sensor_radius_mm": 1.5, "d33_pc_per_n": 14.0},
            "curves": {
                "indenters_mm": [0.025], "largest_displacement_mm": 3e-3, "samples": 2000, "retract": True,
                "approach_mm": 1e-3, "retreat_mm": 1.5e-3, "force_noise_n": 5e-10, "modulus_declared": False,
                "stage_stiffness_n_per_mm": 5e-4, "stage_declared": True, "units_checked": True,
            },
            "effects": {"adhesion": {"work_j_per_m2": work}},
        }
    )  # fmt: skip
    report = diagnosis_report(parse(campaign_of_curves(pressing, record_curves(pressing))), table)
    assert report["fit"]["after"]["youngs_modulus"]["value"] == pytest.approx(0.01, rel=0.03)
    assert [entry["name"] for entry in report["mechanisms"]] == ["adhesion"]
    stated = report["mechanisms"][0]["parameters"][0]
    assert 0.8 * stated["low"] < work < 1.25 * stated["high"]
