"""The diagnosis' statistics against exact answers: likelihood, gradient, line noise, bounds."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from tests.support.diagnosis_campaigns import Made, campaign
from underskin.diagnosis.data.dataset import Lines, lines
from underskin.diagnosis.inference.explanation import FittingProblem, Request
from underskin.diagnosis.inference.laplace import log_box
from underskin.diagnosis.inference.likelihood import log_likelihoods
from underskin.diagnosis.inference.optimizer import Evaluated, Fitter
from underskin.diagnosis.noise.noise_priors import GAIN_PRIOR, POSITION_PRIOR
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats


def fitted(
    made: Made, table: SigmaTable, *, placed: bool = False, whole: bool = True
) -> tuple[Fitter, Evaluated, Lines]:
    problem = FittingProblem(lines(campaign(made, table)), table)
    hypothesis = problem.hypothesis(made.mechanisms, placed, whole=whole)
    own = [entry.to_fit(value) for entry, value in zip(hypothesis.model.parameters, made.parameters, strict=False)]
    fitter = Fitter([hypothesis])
    return fitter, fitter.begin([np.array([own])], slopes=True), hypothesis.lines


def real(rows: np.ndarray) -> Floats:
    return np.concatenate([rows.real, rows.imag])


@pytest.mark.parametrize(
    ("made", "placed"),
    [
        (Made(sensors=2, lines=4, preloads_n=(0.5, 2.0)), False),
        (Made(sensors=2, lines=4, preloads_n=(0.5, 2.0), offsets_mm=(0.0, 1.3)), True),
        (Made(("mains_pickup",), (0.05, 2.0, 1.0), sensors=1, lines=5, preloads_n=(0.5, 2.0), highest_hz=50.0), False),
        (Made(("contact_resonance",), (2.0, 0.05), sensors=2, lines=6, preloads_n=(0.5,), highest_hz=900.0), False),
        (
            Made(
                ("amplifier_high_pass", "mains_pickup"),
                (0.5, 0.05, 2.0, 1.0),
                sensors=2,
                lines=5,
                preloads_n=(0.5,),
                offsets_mm=(0.7,),
                highest_hz=50.0,
            ),
            True,
        ),
    ],
)
def test_the_likelihood_is_that_of_the_whole_covariance_matrix(made: Made, placed: bool, table: SigmaTable) -> None:
    """Woodbury's identity against one dense covariance matrix over all rows."""
    fitter, at, used = fitted(made, table, placed=placed)
    levels = fitter.levels(at.points.covariance).first
    curvature = fitter.curvature
    factor = np.exp(0.5 * levels.position**2 * curvature.laplacian)[used.recording]
    prediction = fitter.hypotheses[0].model.predict(at.points.fit[0])
    model = real(prediction.value * factor)
    which = np.tile(used.recording, 2)
    sensor = used.sensor[which]
    deviation = levels.level * np.tile(used.deviation, 2)
    covariance = np.diag(deviation**2)
    same = which[:, None] == which[None, :]
    gain = levels.gain**2 + 0.5 * levels.position**4 * curvature.square[which]
    covariance += np.outer(model, model) * same * gain[:, None]
    covariance += np.outer(model, model) * (sensor[:, None] == sensor[None, :]) * levels.spread**2
    if placed:
        assert prediction.position_slopes is not None
        for slope in prediction.position_slopes:
            column = real(slope * factor)
            covariance += levels.position**2 * np.outer(column, column) * same
    covariance += np.diag(np.tile(prediction.pickup_variance, 2))
    exact = float(multivariate_normal.logpdf(real(used.value), model, covariance, allow_singular=True))
    # What all hypotheses share is left out: 2π and the lines' own deviations
    shared = -float(len(model) * np.log(2 * np.pi) / 2 + 2 * np.log(used.deviation).sum())
    several = fitter.levels(at.points.covariance[:, None])
    each = log_likelihoods(fitter.lines, curvature, at.products, several, at.points.bend)
    assert each[0, 0] == pytest.approx(exact - shared, abs=1e-6 * abs(exact))


@pytest.mark.parametrize(
    ("names", "values", "placed"),
    [
        (("moving_contact_edge",), (0.6,), False),
        (("contact_resonance",), (2.0, 0.05), False),
        (("moving_contact_edge",), (0.6,), True),
        (("amplifier_high_pass",), (0.5,), True),
        (("amplifier_high_pass", "mains_pickup"), (0.5, 0.05, 2.0, 1.0), False),
    ],
)
def test_the_gradient_is_that_of_the_posterior(
    names: tuple[str, ...], values: tuple[float, ...], placed: bool, table: SigmaTable
) -> None:
    """What the model's covariance adds included, against differences."""
    highest_hz = 50.0 if "mains_pickup" in names else 400.0
    made = Made(names, values, sensors=3, offsets_mm=(0.9,) if placed else (0.0,), highest_hz=highest_hz)
    fitter, start, _ = fitted(made, table, placed=placed, whole=False)
    moved = start.points.fit + np.where(fitter.free[0], np.linspace(0.05, 0.005, start.points.fit.shape[1]), 0.0)
    at = fitter.settle(fitter.evaluate(replace(start.points, fit=moved)), 2)
    at = fitter.with_growth(at) if placed else at
    _, gradient = fitter.posterior_equations(at)
    for place in fitter.hypotheses[0].mean_places:
        step = np.zeros(at.points.fit.shape[1])
        step[place] = 1e-5
        ends = [fitter.evaluate(replace(at.points, fit=at.points.fit + sign * step)).cost[0] for sign in (1, -1)]
        assert gradient[0, place] == pytest.approx(-(ends[0] - ends[1]) / 2e-5, rel=1e-5, abs=1e-3)


def test_collapsed_lines_give_the_same_posterior(table: SigmaTable) -> None:
    made = Made(("moving_contact_edge",), (0.4,), offsets_mm=(0.0, 1.0))
    _, whole, _ = fitted(made, table, placed=True)
    _, collapsed, _ = fitted(made, table, placed=True, whole=False)
    assert collapsed.cost[0] == pytest.approx(whole.cost[0], abs=1e-2)


def test_hypotheses_taken_together_are_each_alone(table: SigmaTable) -> None:
    """Costs, equations and evidences, of sets with and without dynamics line by line."""
    made = Made(("ageing",), (0.05, 300.0, 0.0), offsets_mm=(0.0, 0.8), sensors=2)
    problem = FittingProblem(lines(campaign(made, table)), table)
    requests = [Request(()), Request(("amplifier_high_pass",)), Request(("ageing",)), Request(("misalignment",))]
    together = problem.explain(requests)
    for request, explanation in zip(requests, together, strict=True):
        (alone,) = problem.explain([request])
        assert alone is not None
        assert explanation is not None
        assert explanation.log_evidence == pytest.approx(alone.log_evidence, abs=0.05)
        assert explanation.point.fit == pytest.approx(alone.point.fit, abs=0.02)


def test_what_is_left_as_hopeless_is_far_behind(table: SigmaTable) -> None:
    made = Made(("contact_resonance",), (3.0, 0.05), sensors=2, highest_hz=1000.0, lines=20)
    problem = FittingProblem(lines(campaign(made, table)), table)
    requests = [Request((name,)) for name in ("contact_resonance", "adhesion", "timing_delay", "sensor_spread")]
    together = problem.explain(requests)
    assert together[0] is not None
    left = [request for request, explanation in zip(requests, together, strict=True) if explanation is None]
    assert left
    for request in left:
        (alone,) = problem.explain([request])
        assert alone is not None
        assert alone.log_evidence < together[0].log_evidence - 10.0


def test_priors_of_scatter_integrate_to_one() -> None:
    for prior in (GAIN_PRIOR, POSITION_PRIOR):
        x = np.linspace(prior.low - 8 * prior.fall_low, prior.high + 8 * prior.fall_high, 20001)
        assert np.trapezoid([np.exp(prior.log_density(value)) for value in x], x) == pytest.approx(1, abs=1e-4)


@pytest.mark.parametrize("relative", [0.002, 0.02])
def test_line_noise_is_found_beneath_a_smooth_misfit(relative: float, table: SigmaTable) -> None:
    """A high pass bends the lines much more than their noise does; the roughness does not mind."""
    made = Made(("amplifier_high_pass",), (0.8,), lines=60, line=relative, sensors=3)
    found = lines(campaign(made, table))
    ratio = found.deviation / (relative * np.abs(found.value))
    assert np.median(ratio) == pytest.approx(1, abs=0.12)


def test_the_box_of_one_bound_is_exact_and_of_two_close() -> None:
    mean, covariance = np.array([0.3, -0.2]), np.array([[1.0, 0.5], [0.5, 2.0]])
    low, high = np.array([0.0, -50.0]), np.array([50.0, 50.0])
    exact = multivariate_normal(mean[:1], covariance[:1, :1]).cdf([1e9]) - multivariate_normal(0.3, 1.0).cdf(0.0)
    assert log_box(mean, covariance, low, high) == pytest.approx(np.log(exact), abs=1e-9)
    both = np.array([0.0, 0.0])
    random = np.random.default_rng(3).multivariate_normal(mean, covariance, 400_000)
    assert log_box(mean, covariance, both, high) == pytest.approx(np.log((random > 0).all(axis=1).mean()), abs=0.03)


def test_a_bound_that_leads_a_mean_far_out_of_others_leaves_the_box_its_probability() -> None:
    """Against quadrature. The last of three is ten deviations beyond its bound and takes the others with it; truncated
    in their order, the log probability came out 128 lower."""
    mean, deviation = np.array([-7.0, 16.0, 10.0]), np.array([1.0, 1.6, 1.0])
    correlation = np.array([[1.0, -0.97, -0.99], [-0.97, 1.0, 0.98], [-0.99, 0.98, 1.0]])
    covariance = correlation * np.outer(deviation, deviation)
    low, high = np.array([0.0, -50.0, -50.0]), np.array([50.0, 5.0, 0.0])
    last = np.linspace(-1.5, 0.0, 601)  # farther down the density is e⁻¹⁵ of that at the bound
    first_two = mean[:2] + np.outer(last - mean[2], covariance[:2, 2])
    rest = covariance[:2, :2] - np.outer(covariance[:2, 2], covariance[:2, 2])
    inside = [multivariate_normal([-at[0], at[1]], rest * [[1, -1], [-1, 1]]).cdf([0.0, 5.0]) for at in first_two]
    exact = float(np.log(np.trapezoid(inside * norm(mean[2]).pdf(last), last)))
    assert log_box(mean, covariance, low, high) == pytest.approx(exact, abs=0.1)
