"""The evidence of a hypothesis by Laplace's method, against importance sampling and nested sampling."""

import os
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.special import logsumexp
from scipy.stats import multivariate_t

from tests.support.cases import first
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.nested_sampling import Posterior, nested
from tests.support.pressed_curves import explained, pressed
from underskin.diagnosis.data.dataset import lines
from underskin.diagnosis.inference.evidence import Evidence, laplace
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request, integrated
from underskin.diagnosis.inference.laplace import around_mean
from underskin.diagnosis.inference.optimizer import Fitter
from underskin.surrogate.sigma_table import SigmaTable

SOAK = os.environ.get("UNDERSKIN_SOAK") == "1"

CASES: list[tuple[tuple[str, ...], tuple[float, ...]]] = [
    ((), ()),
    (("moving_contact_edge",), (0.7,)),
    (("amplifier_high_pass",), (0.5,)),
    (("moving_contact_edge",), (0.05,)),
    (("layered_contact",), ()),
    (("adhesion",), (0.5,)),
    (("interface_slip",), (0.3,)),
    (("compressible_layer",), (0.45,)),
    (("strain_stiffening",), (5.0,)),
    (("sensor_spread",), (0.15,)),
    (("ageing",), (0.2, 500.0, 0.0)),
    (("contact_creep",), (0.5, 20.0)),
    (("misalignment",), (0.4, 0.3)),
    (("preload_dependent_d33",), (2.0, 1.0)),
    (("modulus_error",), (1.4,)),
    (("thickness_error",), (1.1,)),
    (("timing_delay",), (20.0,)),
    (("sensor_relaxation",), (0.03, 0.0, 20.0)),
    (("contact_resonance",), (3.0, 0.05)),
    (("moving_contact_edge", "ageing"), (0.7, 0.2, 500.0, 0.0)),
]


@pytest.mark.slow
def test_an_integral_around_any_point_within_the_bounds_stays_of_the_posterior_s_height(table: SigmaTable) -> None:
    """Where a fit hangs at several bounds, the quadratic's mean may lie far outside all of them."""
    random = np.random.default_rng(1)
    found, _ = explained(pressed(10.0, (5.0,)), ("strain_stiffening", "instrument_compliance"), table)
    hypothesis = found.best.hypothesis
    fitter = Fitter([hypothesis])
    low, high = hypothesis.bounds
    beyond = []
    for _ in range(150):
        fit, draw = found.point.fit.copy(), random.random(hypothesis.own_parameters)
        own = fit[: len(draw)] + 0.1 * random.normal(size=len(draw))
        fit[: len(draw)] = np.where(draw < 0.3, low[: len(draw)], np.where(draw < 0.6, high[: len(draw)], own))
        at = fitter.evaluate(fitter.at(replace(found.point, fit=np.clip(fit, low, high))))
        if np.isfinite(at.cost[0]):
            beyond.append(float(around_mean(fitter, at)[0][0] + at.cost[0]))
    assert len(beyond) > 50
    assert min(beyond) > -300  # of about ten parameters, each to 1e-6 of its unit or better
    assert max(beyond) < 50


def laplace_of(names: tuple[str, ...], values: tuple[float, ...], table: SigmaTable) -> Evidence:
    """By Laplace's method, of the hypothesis with which the campaign was made."""
    made = Made(names, values, sensors=3, offsets_mm=(0.0, 1.0), preloads_n=(0.3, 1.2, 2.4), highest_hz=1000.0)
    problem = FittingProblem(lines(campaign(made, table)), table)
    hypothesis = problem.hypothesis(names, placed=False)
    own = [entry.to_fit(value) for entry, value in zip(hypothesis.model.parameters, values, strict=False)]
    fitter = Fitter([hypothesis])
    return laplace(fitter, fitter.improve(fitter.begin([np.array([own])]).points))


@pytest.mark.slow
@pytest.mark.parametrize(("names", "values"), [CASES[index] for index in first(4, (0, 1, 10, 17, 4))])
def test_evidence_agrees_with_importance_sampling(
    names: tuple[str, ...], values: tuple[float, ...], table: SigmaTable
) -> None:
    """Laplace's method against the mean of density over Student's t around the mode."""
    found = laplace_of(names, values, table)
    assert found.log_evidence == pytest.approx(importance(found), abs=0.5)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("names", "offsets_mm"), [((), (0.0,)), (("preload_dependent_d33",), (0.0, 0.3)), ((), (0.0, 1.0))]
)
def test_evidence_with_positioning_scatter(
    names: tuple[str, ...], offsets_mm: tuple[float, ...], table: SigmaTable
) -> None:
    """The same where little tells how much of it there is (a bell is off by half a nat), and where much does."""
    values = (2.0, 1.0) if names else ()
    made = Made(names, values, sensors=2, offsets_mm=offsets_mm, preloads_n=(0.3, 1.2, 2.4))
    (explained,) = FittingProblem(lines(campaign(made, table)), table).explain([Request(names)])
    assert explained is not None
    (whole,) = integrated([explained])
    _, found = whole.each[1]
    assert found.hypothesis.placed
    assert found.log_evidence == pytest.approx(importance(found), abs=0.3)


def importance(found: Evidence) -> float:
    """The log evidence by importance sampling."""
    fitter, point = found.fitter, found.point
    posterior = Posterior(fitter, point)
    values, vectors = np.linalg.eigh(fitter.covariance_equations(found.at)[1][0])
    levels = (vectors / np.maximum(values, 0.6)) @ vectors.T
    centre = np.concatenate([point.fit[found.hypothesis.mean_places], point.covariance])
    proposal = multivariate_t(centre, 2 * block_diag(found.covariance, levels), df=4, seed=1)
    draws = proposal.rvs(4000)
    weights = np.array([posterior.log_density(x) for x in draws]) - proposal.logpdf(draws)
    return float(logsumexp(weights) - np.log(len(draws)))


@pytest.mark.soak
@pytest.mark.skipif(not SOAK, reason="minutes a case: UNDERSKIN_SOAK=1")
@pytest.mark.parametrize(("names", "values"), CASES)
def test_evidence_agrees_with_nested_sampling(
    names: tuple[str, ...], values: tuple[float, ...], table: SigmaTable
) -> None:
    """Laplace's method against nested sampling of the same posterior: 0.5 in log evidence, beside its own error."""
    found = laplace_of(names, values, table)
    sampled = nested(Posterior(found.fitter, found.point))
    assert found.log_evidence == pytest.approx(sampled.log_evidence, abs=0.5 + 2 * sampled.error)


def test_explanations_are_names_in_order_of_composition(table: SigmaTable) -> None:
    problem = FittingProblem(lines(campaign(Made(("ageing",), (0.3, 300.0, 0.0)), table)), table)
    (found,) = problem.explain([Request(("ageing", "modulus_error"))])
    assert isinstance(found, Explanation)
    assert found.names == ("modulus_error", "ageing")
