"""The evidence of a hypothesis: its likelihood against a dense covariance matrix, its integral by Laplace's method
against importance sampling and nested sampling."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, multivariate_t

from tests.support.cases import first
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.nested_sampling import Posterior, nested

# A report has probabilities alone, capped and averaged: an evidence that is wrong by a nat would not show there.
from underskin.diagnosis.data.dataset import lines
from underskin.diagnosis.inference.evidence import Evidence, laplace_at
from underskin.diagnosis.inference.explanation import FittingProblem, Request
from underskin.diagnosis.inference.fit import Fitter
from underskin.diagnosis.inference.hypothesis import log_likelihoods
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

pytestmark = pytest.mark.slow

CASES: list[tuple[tuple[str, ...], tuple[float, ...]]] = [
    ((), ()),
    (("moving_contact_edge",), (0.7,)),
    (("amplifier_high_pass",), (0.5, 1.0)),
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


LIKELIHOODS: list[tuple[Made, bool]] = [
    (Made(lines=4, offsets_mm=(0.0, 1.3), preloads_n=(0.5, 2.0)), True),
    (
        Made(
            ("amplifier_high_pass", "mains_pickup"), (0.5, 1.0, 0.05, 2.0, 1.0), lines=5, preloads_n=(0.5,),
            offsets_mm=(0.7,), highest_hz=50.0,
        ),
        True,
    ),
    (Made(("contact_resonance",), (2.0, 0.05), lines=6, preloads_n=(0.5,), highest_hz=900.0), False),
]  # fmt: skip


def real(rows: np.ndarray) -> Floats:
    return np.concatenate([rows.real, rows.imag])


@pytest.mark.parametrize(("made", "has_position_scatter"), LIKELIHOODS)
def test_likelihood_whole_covariance_matrix(made: Made, has_position_scatter: bool, table: SigmaTable) -> None:
    """The likelihood is that of the whole covariance matrix.

    Woodbury's identity against one dense covariance matrix over all rows.
    """
    problem = FittingProblem(lines(campaign(made, table)), table)
    hypothesis = problem.hypothesis(made.mechanisms, has_position_scatter, all_lines=True)
    own = [entry.to_fit(value) for entry, value in zip(hypothesis.model.parameters, made.parameters, strict=False)]
    fitter, used = Fitter(hypothesis), hypothesis.lines
    at = fitter.initial(np.array([own]), slopes=True)
    levels, curvature = fitter.levels(at.points.covariance).first, fitter.curvature
    factor = np.exp(0.5 * levels.position**2 * curvature.laplacian)[used.recording]
    prediction = hypothesis.model.predict(at.points.fit[0])
    model, which = real(prediction.value * factor), np.tile(used.recording, 2)
    sensor, same = used.sensor[which], which[:, None] == which[None, :]
    gain = levels.gain**2 + 0.5 * levels.position**4 * curvature.square[which]
    covariance = np.diag((levels.level * np.tile(used.deviation, 2)) ** 2)
    covariance += np.outer(model, model) * same * gain[:, None]
    covariance += np.outer(model, model) * (sensor[:, None] == sensor[None, :]) * levels.spread**2
    if has_position_scatter:
        assert prediction.position_slopes is not None
        for slope in prediction.position_slopes:
            column = real(slope * factor)
            covariance += levels.position**2 * np.outer(column, column) * same
    covariance += np.diag(np.tile(prediction.pickup_variance, 2))
    exact = float(multivariate_normal.logpdf(real(used.value), model, covariance, allow_singular=True))
    # What all hypotheses share is left out: 2π and the lines' own deviations
    shared = -float(len(model) * np.log(2 * np.pi) / 2 + 2 * np.log(used.deviation).sum())
    several = fitter.levels(at.points.covariance[:, None])
    each = log_likelihoods(fitter.lines, curvature, at.products, several, at.points.sensor_log_gain)
    assert each[0, 0] == pytest.approx(exact - shared, abs=1e-6 * abs(exact))


GRADIENTS = [
    Made(("contact_resonance",), (2.0, 0.05), lines=6, preloads_n=(0.5,), highest_hz=900.0),
    Made(("moving_contact_edge",), (0.7,), lines=4, preloads_n=(0.5, 2.0)),
]


@pytest.mark.parametrize("made", GRADIENTS)
def test_gradient_by_differences(made: Made, table: SigmaTable) -> None:
    """The gradient of the log likelihood by each parameter is the limit of its differences, away from the optimum,
    without sensors' gains and scatter of positions, about which it is linearised."""
    problem = FittingProblem(lines(campaign(made, table)), table)
    hypothesis = problem.hypothesis(made.mechanisms, has_position_scatter=False, all_lines=True)
    own = [entry.to_fit(value) for entry, value in zip(hypothesis.model.parameters, made.parameters, strict=False)]
    fitter = Fitter(hypothesis)
    initial = fitter.initial(np.array([own]), slopes=True).points
    random, margin = np.random.default_rng(0), 1e-3 * (fitter.high - fitter.low)
    beside = initial.fit + random.normal(0, 0.02, initial.fit.shape)
    points = replace(
        initial,
        fit=np.clip(beside, fitter.low + margin, fitter.high - margin),
        sensor_log_gain=np.zeros_like(initial.sensor_log_gain),
    )

    def likelihood(fit: Floats) -> float:
        moved = replace(points, fit=fit)
        products = fitter.products(moved, slopes=False, place=False)
        levels = fitter.levels(moved.covariance[:, None])
        return float(log_likelihoods(fitter.lines, fitter.curvature, products, levels, moved.sensor_log_gain)[0, 0])

    products = fitter.products(points, slopes=True, place=False)
    _, gradient = fitter.tangent(points, products).normal_equations
    for index in np.flatnonzero(fitter.free).tolist():
        step = np.zeros_like(points.fit)
        step[0, index] = 1e-5 * max(1.0, abs(points.fit[0, index]))
        difference = (likelihood(points.fit + step) - likelihood(points.fit - step)) / (2 * step[0, index])
        assert gradient[0, index] == pytest.approx(difference, rel=1e-4, abs=1e-4), hypothesis.model.parameters[index]


def laplace_of(names: tuple[str, ...], values: tuple[float, ...], table: SigmaTable) -> Evidence:
    """By Laplace's method, of the hypothesis with which the campaign was made."""
    made = Made(names, values, sensors=3, offsets_mm=(0.0, 1.0), preloads_n=(0.3, 1.2, 2.4), highest_hz=1000.0)
    problem = FittingProblem(lines(campaign(made, table)), table)
    hypothesis = problem.hypothesis(names, has_position_scatter=False)
    own = [entry.to_fit(value) for entry, value in zip(hypothesis.model.parameters, values, strict=False)]
    fitter = Fitter(hypothesis)
    return laplace_at(fitter, fitter.improve(fitter.initial(np.array([own])).points))


@pytest.mark.parametrize(("names", "values"), [CASES[index] for index in first(3, (0, 1, 17, 10, 4))])
def test_evidence_agrees_with_importance_sampling(
    names: tuple[str, ...], values: tuple[float, ...], table: SigmaTable
) -> None:
    """Laplace's method against the mean of density over Student's t around the mode. A time that the lines leave open
    has a tail that no quadratic holds: up to two nats."""
    found = laplace_of(names, values, table)
    assert found.log_evidence == pytest.approx(importance(found), abs=2.0 if "sensor_relaxation" in names else 0.5)


@pytest.mark.soak
@pytest.mark.parametrize(
    ("names", "offsets_mm"), first(2, [((), (0.0,)), (("preload_dependent_d33",), (0.0, 0.3)), ((), (0.0, 1.0))])
)
def test_evidence_with_positioning_scatter(
    names: tuple[str, ...], offsets_mm: tuple[float, ...], table: SigmaTable
) -> None:
    """The same where little tells how much of it there is (a bell is off by half a nat), and where much does.

    Half a nat decides no answer: on 215 campaigns of the ledger integrals in its place changed none.
    """
    values = (2.0, 1.0) if names else ()
    made = Made(names, values, sensors=2, offsets_mm=offsets_mm, preloads_n=(0.3, 1.2, 2.4))
    explained = FittingProblem(lines(campaign(made, table)), table).explain(Request(names))
    assert explained is not None
    _, found = explained.fits[1]
    assert found.hypothesis.has_position_scatter
    assert found.log_evidence == pytest.approx(importance(found), abs=0.8)


def importance(found: Evidence) -> float:
    """The log evidence by importance sampling."""
    fitter, point = found.fitter, found.point
    posterior = Posterior(fitter, point)
    values, vectors = np.linalg.eigh(fitter.covariance_equations(found.at)[1][0])
    levels = (vectors / np.maximum(values, 0.6)) @ vectors.T
    centre = np.concatenate([point.fit[found.hypothesis.mean_indices], point.covariance])
    proposal = multivariate_t(centre, 2 * block_diag(found.covariance, levels), df=4, seed=1)
    draws = proposal.rvs(4000)
    weights = np.array([posterior.log_density(x) for x in draws]) - proposal.logpdf(draws)
    return float(logsumexp(weights) - np.log(len(draws)))


@pytest.mark.soak
@pytest.mark.parametrize(("names", "values"), CASES)
def test_evidence_agrees_with_nested_sampling(
    names: tuple[str, ...], values: tuple[float, ...], table: SigmaTable
) -> None:
    """Laplace's method against nested sampling of the same posterior: 0.5 in log evidence, beside its own error."""
    found = laplace_of(names, values, table)
    sampled = nested(Posterior(found.fitter, found.point))
    assert found.log_evidence == pytest.approx(sampled.log_evidence, abs=0.5 + 2 * sampled.error)
