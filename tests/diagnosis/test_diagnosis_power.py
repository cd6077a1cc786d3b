"""What a campaign could have shown at all, and what its answers are worth where they could show little."""

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from tests.support.cases import first
from tests.support.diagnosis_campaigns import Made, campaign
from underskin.diagnosis.data.dataset import lines
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.optimizer import Fitter
from underskin.diagnosis.pipeline import diagnosis_report
from underskin.diagnosis.reporting.numbers import parameter, without_effect
from underskin.diagnosis.reporting.report import DiagnosisResult, verdict
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.priors import SHOWS
from underskin.diagnosis.validation.power import least_chi2, power
from underskin.diagnosis.validation.signatures import Signatures
from underskin.mechanisms import compose
from underskin.mechanisms.registry import CATALOGUE
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

QUIET = Made(sensors=1, repeats=2)


def visible(made: Made, table: SigmaTable) -> dict[str, float]:
    """The smallest visible percentage of each mechanism in a campaign."""
    problem = FittingProblem(lines(campaign(made, table)), table)
    (nothing,) = problem.explain([Request(())])
    assert nothing is not None
    return {entry.mechanism: entry.smallest_visible_percent for entry in power(Signatures(problem), nothing, 16)}


def changed_percent(name: str, values: Sequence[float], table: SigmaTable) -> float:
    """What a mechanism changes of the response, as a root mean square over all rows [%]."""
    empty = campaign(QUIET, table)
    base, model = compose((), empty, table), compose((name,), empty, table)
    fit = np.array([entry.start for entry in base.parameters])
    own = [entry.to_fit(value) for entry, value in zip(model.parameters, values, strict=False)]
    with_it, without = model.predict(np.array([*own, *fit])).value, base.predict(fit).value
    return float(100 * np.sqrt((np.abs(with_it - without) ** 2).sum() / (np.abs(without) ** 2).sum()))


@pytest.mark.slow
def test_three_times_what_is_visible_is_seen_and_a_third_of_it_is_not(table: SigmaTable) -> None:
    document = diagnosis_report(campaign(QUIET, table), table)
    assert document["verdict"] == "no_mismatch"
    least = {entry["mechanism"]: entry["smallest_visible_percent"] for entry in document["power"]}
    coefficients = np.geomspace(0.01, 5.0, 60)
    changes: Floats = np.array(
        [changed_percent("preload_dependent_d33", (value, 1.0), table) for value in coefficients]
    )
    for times, seen in ((3.0, True), (1 / 3, False)):
        strength = float(np.interp(times * least["preload_dependent_d33"], changes, coefficients))
        hidden = replace(QUIET, mechanisms=("preload_dependent_d33",), parameters=(strength, 1.0))
        for seed in first(1, [11, 12]):
            answer = diagnosis_report(campaign(replace(hidden, seed=seed), table), table)
            assert (answer["verdict"] != "no_mismatch") is seen


def test_more_recordings_and_less_scatter_show_more(table: SigmaTable) -> None:
    few, many, rough = (
        visible(made, table) for made in (QUIET, replace(QUIET, repeats=8), replace(QUIET, gain=0.05, line=0.02))
    )
    assert set(few) <= set(many)
    for name in ("timing_delay", "preload_dependent_d33"):
        assert rough[name] > 1.5 * few[name]
        assert many[name] < 0.9 * few[name]
    assert many["timing_delay"] == pytest.approx(few["timing_delay"] / 2, rel=0.2)  # four times as many recordings


def test_a_quiet_report_says_what_would_have_shown(table: SigmaTable) -> None:
    document = diagnosis_report(campaign(QUIET, table), table)
    known = sum("frf" in mechanism.kinds for mechanism in CATALOGUE.values())
    small = {entry["mechanism"] for entry in document["power"] if entry["smallest_visible_percent"] <= 5.0}
    hidden = {
        entry["mechanism"]
        for entry in document["not_identifiable"]
        if entry["confounded_with"] in ("d33", "noise")  # at a typical strength: not to be read as ruled out
    }
    assert small & hidden
    said = document["statement"].rpartition(". ")[2]
    assert said.startswith(f"Of the {known} known mechanisms these {len(small - hidden)} would each have shown")
    named = set(said.rstrip(".").partition(": ")[2].split(", "))
    assert named == {name.replace("_", " ") for name in small - hidden}
    assert 0 < len(named) < known
    percents = [entry["smallest_visible_percent"] for entry in document["power"]]
    assert percents == sorted(percents)
    assert all(0 < percent < 100 for percent in percents)


def test_two_recordings_that_agree_tell_nothing(table: SigmaTable) -> None:
    two = replace(QUIET, spheres_mm=(4.0,), preloads_n=(0.5, 1.5), repeats=1)
    document = diagnosis_report(campaign(two, table), table)
    assert document["verdict"] == "insufficient_data"
    assert "at least 3 are needed" in document["statement"]


def test_what_must_be_gained_grows_with_the_number_of_rivals() -> None:
    assert least_chi2(4, SHOWS) < least_chi2(20, SHOWS) < 16.0
    assert least_chi2(1, SHOWS) > 2 * np.log(4.0)
    assert least_chi2(4, 5.0) > 10.0


def best_of(name: str, made: Made, table: SigmaTable) -> tuple[FittingProblem, Explanation, Explanation]:
    problem = FittingProblem(lines(campaign(made, table)), table)
    nothing, found = problem.explain([Request(()), Request((name,))])
    assert nothing is not None
    assert found is not None
    return problem, nothing, found


def density_with(found: Explanation, place: int, value: float) -> float:
    """The log posterior density with one parameter held and the others fitted, from starts all over an ageing's law."""
    held = Fitter([found.best.hypothesis], held=[(place,)])
    best = -np.inf
    for onset, saturation in itertools.product(np.log([10.0, 100.0, 1000.0]), (0.0, 0.5, 0.95)):
        fit = found.point.fit.copy()
        fit[:3] = value, onset, saturation
        best = max(best, -float(held.improve(held.at(replace(found.point, fit=fit))).cost[0]))
    return best + found.model.parameters[place].log_prior(value)


def test_an_interval_ends_where_the_posterior_has_fallen_though_it_is_skewed(table: SigmaTable) -> None:
    made = Made(("ageing",), (0.2, 300.0, 0.0), sensors=3, repeats=2)
    _, nothing, ageing = best_of("ageing", made, table)
    assert ageing.log_evidence > nothing.log_evidence + 5.0  # a loss there is, though its size is uncertain
    variance = ageing.best.covariance[0, 0]
    assert ageing.point.fit[0] < 1.96 * np.sqrt(variance)  # so that the normal approximation reaches none
    stated = parameter(ageing, 0)
    fall = density_with(ageing, 0, stated["value"]) - density_with(ageing, 0, stated["low"])
    assert fall == pytest.approx(1.92, abs=0.5)


@pytest.mark.parametrize(("coefficient", "stated"), [(0.0, "ambiguous"), (3.0, "explained")])
def test_a_mechanism_that_may_have_no_effect_explains_nothing(
    coefficient: float, stated: str, table: SigmaTable
) -> None:
    name = "preload_dependent_d33"
    made = replace(QUIET, mechanisms=(name,), parameters=(coefficient, 1.0))
    problem, nothing, found = best_of(name, made, table)
    assert without_effect(found) == ([name] if stated == "ambiguous" else [])
    certain = replace(found, log_evidence=nothing.log_evidence + 50.0)
    result = DiagnosisResult("", (), {}, search=Search((nothing, certain), (), {}), problem=problem)
    assert result.search is not None
    assert result.search.answers[0].names == (name,)
    assert verdict(result) == stated
