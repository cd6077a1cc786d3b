"""Which sets of mechanisms are found on curves, and what a companion that hardly shows is given."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import optimize

from rig.draw_curves import drawn_curves
from rig.effects import INDENTATION
from rig.elastomer import campaign_of_curves
from tests.support.kinds_campaigns import SPHERE, curves, lines
from tests.support.lean_reports import lean_report
from tests.support.pressed_curves import explained, pressed
from underskin.diagnosis.data.curve_samples import curve_lines
from underskin.diagnosis.inference import least_squares
from underskin.diagnosis.inference.explanation import FittingProblem, Request
from underskin.diagnosis.inference.hypothesis import own_places
from underskin.diagnosis.inference.optimizer import Fitter
from underskin.diagnosis.inference.starts import Beginning, best_starts
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.priors import PRIORS
from underskin.diagnosis.validation.cross_validation import PredictionScore, groups, hold_out
from underskin.recordings.campaign import Campaign, parse
from underskin.surrogate.sigma_table import SigmaTable

SUPPORTED = 6
_STICKY = {"work_j_per_m2": 1.0}


@pytest.fixture(scope="module")
def stiffening_on_a_stage() -> Campaign:
    """An elastomer whose modulus grows with the strain, pressed by a stage that gives: each bends the curves alike."""
    return parse(campaign_of_curves(*drawn_curves(777001, 109, INDENTATION, "pair")))


@pytest.fixture(scope="module")
def report(stiffening_on_a_stage: Campaign, table: SigmaTable) -> dict[str, Any]:
    return lean_report(stiffening_on_a_stage, table, "adhesion", "contact_creep")


def test_two_mechanisms_that_share_a_bend_are_found_from_starts_over_both(report: dict[str, Any]) -> None:
    found = {entry["name"]: entry["parameters"] for entry in report["mechanisms"]}
    assert set(found) == {"instrument_compliance", "strain_stiffening"}
    (stage,) = found["instrument_compliance"]
    assert stage["low"] < 57.8 < stage["high"] < 70  # alone it would have 124


def test_least_squares_that_rounding_takes_past_a_bound_end_at_it(
    table: SigmaTable, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beyond a bound there is no finite posterior, and the diagnosis failed."""

    def past_a_bound(*arguments: Any, **options: Any) -> Any:
        found = optimize.least_squares(*arguments, **options)
        found.x = options["bounds"][1] + 1e-12
        return found

    problem = FittingProblem(curve_lines(pressed(3.0, (5.0,)), "indentation"), table)
    hypothesis = problem.hypothesis(("instrument_compliance", "strain_stiffening"), placed=False)
    start = np.array([entry.start for entry in hypothesis.model.parameters])
    low, high = np.array([entry.bounds for entry in hypothesis.model.parameters]).T
    monkeypatch.setattr(least_squares, "least_squares", past_a_bound)
    fit, _ = least_squares.LeastSquares(hypothesis).fitted(start)
    assert (fit >= low).all()
    assert (fit <= high).all()


@pytest.mark.parametrize(("gained", "stays"), [(-0.1, False), (0.1, True), (4.9, True)])
def test_a_companion_that_gains_less_than_shows_stays_with_its_prior(
    gained: float, stays: bool, table: SigmaTable
) -> None:
    """A gain of fewer than five nats is no evidence for it, whatever its size, and no reason against it."""
    alone, nothing = explained(pressed(3.0, (5.0,)), ("instrument_compliance",), table)
    both = replace(alone, names=("instrument_compliance", "adhesion"), log_evidence=alone.log_evidence + gained)
    search = Search((nothing, alone, both), (), {})
    share = {answer.names: answer.probability for answer in search.answers}
    supported = search.supported
    expected = PRIORS["two"] / (supported * (supported - 1) / 2) / (PRIORS["one"] / supported)
    if stays:
        assert share[both.names] / share[alone.names] == pytest.approx(expected, rel=1e-3)
    else:
        assert both.names not in share


def test_errors_held_out_of_curves_are_percent_of_one_size(table: SigmaTable) -> None:
    """The zero of force is each explanation's own, so that each has another size of what it predicts."""
    problem = FittingProblem(curve_lines(pressed(3.0, (5.0,)), "indentation"), table)
    nothing, alone = problem.explain([Request(()), Request(("instrument_compliance",))])
    assert nothing is not None
    assert alone is not None
    held_out = hold_out(problem, [alone], nothing, lambda _: 0.0, groups(problem.lines))
    assert held_out
    assert all(entry.chosen == alone.names and entry.before.size == entry.after.size for entry in held_out)


@pytest.mark.parametrize(("square", "misled"), [(2.2, False), (2.3, True)])
def test_an_error_half_as_large_again_as_before_misleads(square: float, misled: bool) -> None:
    before = PredictionScore(square=1.0, size=1.0, noise=0.5, recordings=1)
    after = replace(before, square=square)
    assert after.misleads(before) is misled
    assert not replace(after, noise=2.0).misleads(before)  # which noise gives as well
    assert not replace(after, unsure=2.0).misleads(before)  # as do parameters that the rest does not tell


def test_a_set_is_fitted_again_from_the_bound_that_its_point_lies_beyond(table: SigmaTable) -> None:
    """Other recordings may narrow a bound; beyond it the posterior is 0, and the diagnosis failed."""
    problem = FittingProblem(curve_lines(pressed(3.0, (5.0,)), "indentation"), table)
    (entry,) = problem.explain([Request(("contact_creep",), kept=True)])
    assert entry is not None
    fitter = Fitter([problem.hypothesis(entry.names, placed=False)])
    own = own_places(entry.names, problem.lines)["contact_creep"]
    fit = entry.point.fit.copy()
    fit[own] = fitter.low[0, own] - 0.1
    beyond = replace(entry, best=replace(entry.best, point=replace(entry.point, fit=fit)))
    within, again = problem.refit([entry, beyond])
    assert within is not None
    assert again is not None
    assert again.log_evidence == pytest.approx(within.log_evidence, abs=0.5)


@pytest.mark.parametrize("added", ["contact_creep", "compressible_layer", "instrument_compliance"])
def test_a_set_of_curves_begins_also_where_its_parent_stands_and_the_added_mechanism_does_nothing(
    added: str, table: SigmaTable
) -> None:
    """There it fits as well as the parent, but for the prior of what was added."""
    document = lines()
    document["recordings"] = curves("indentation", {**SPHERE, "retract": True}, effects={"adhesion": _STICKY})
    problem = FittingProblem(curve_lines(parse(document), "indentation"), table)
    (nothing,) = problem.explain([Request(())])
    assert nothing is not None
    (sticks,) = problem.explain([Request(("adhesion",), begin=nothing.point)])
    assert sticks is not None
    hypothesis = problem.hypothesis((added, "adhesion"), placed=False)
    fitter = Fitter([hypothesis])
    (starts,) = best_starts(fitter, [Beginning({"adhesion": sticks.own("adhesion")}, sticks.point, {})])
    at = fitter.evaluate(starts)
    own = own_places(hypothesis.model.names, problem.lines)[added]
    new = hypothesis.model.parameters[own]
    priors = [sum(entry.log_prior(value) for entry, value in zip(new, fit[own], strict=True)) for fit in starts.fit]
    assert min(at.cost + priors) < sticks.best.cost + 1.0


def test_a_set_asked_for_is_explained_although_it_gains_nothing_over_its_parent(table: SigmaTable) -> None:
    problem = FittingProblem(curve_lines(pressed(3.0, (5.0,)), "indentation"), table)
    (nothing,) = problem.explain([Request(())])
    assert nothing is not None
    (alone,) = problem.explain([Request(("instrument_compliance",), begin=nothing.point)])
    assert alone is not None
    names = ("contact_creep", "instrument_compliance")
    left, kept = problem.explain([Request(names, alone), Request(names, alone, kept=True)])
    assert left is None
    assert kept is not None
    assert alone.best.cost - 1.0 < kept.best.cost < alone.best.cost + 10.0
