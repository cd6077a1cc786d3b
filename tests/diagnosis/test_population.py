"""Populations of skins, on quantities that are drawn: intervals hold, and those that depart are told."""

import numpy as np
import pytest
from scipy.stats import norm

from tests.support.cases import first
from underskin.diagnosis.inference.knowledge import Knowledge
from underskin.diagnosis.several.likelihoods import mixed, of_mean, of_posterior, posterior
from underskin.diagnosis.several.population import REGULAR, Make, Populations, Spread, State, populations
from underskin.units import Floats

FAR = 0.4
MAKE = Make(0.0, np.zeros(2), np.array([1.0, 1.0]))
SPREADS = (Spread(0.03, 2.0), Spread(0.03, 2.0))


def states(mean: Floats, covariance: Floats) -> list[State]:
    """Of a skin whose recordings say this of two quantities; it may depart in either."""
    precision: Floats = np.linalg.inv(covariance).astype(np.float64)
    said = Knowledge(precision, precision @ mean, float(-0.5 * mean @ precision @ mean))
    far = np.eye(2) * FAR**2
    return [State(REGULAR, said, np.zeros(2)), State("first", said, far[0]), State("second", said, far[1])]


def pooled(means: Floats, covariances: list[Floats]) -> Populations:
    each = [states(mean, covariance) for mean, covariance in zip(means, covariances, strict=True)]
    return populations(each, [MAKE], SPREADS)


def drawn(random: np.random.Generator, skins: int, departs: float) -> tuple[Floats, int | None, Populations]:
    """True quantities (skins, 2) of skins of one make, which of them departs, and what is told of all."""
    spread = np.exp(random.uniform(np.log(0.01), np.log(0.1), 2))
    true = random.normal(0.0, spread, (skins, 2))
    odd = int(random.integers(skins)) if random.random() < departs else None
    if odd is not None:
        true[odd, random.integers(2)] += random.choice([-1, 1]) * max(4 * spread.max(), random.uniform(0.15, 0.7))
    covariances = []
    for _ in range(skins):
        deviations, correlation = random.uniform(0.01, 0.15, 2), random.uniform(-0.9, 0.9)
        covariances.append(np.outer(deviations, deviations) * np.array([[1, correlation], [correlation, 1]]))
    means = np.array([random.multivariate_normal(*entry) for entry in zip(true, covariances, strict=True)])
    return true, odd, pooled(means, covariances)


@pytest.mark.slow
@pytest.mark.parametrize("skins", first(1, [3, 6]))
def test_intervals_hold_the_true_values_and_departures_are_told(skins: int) -> None:
    """Of 150 populations, half with a skin that departs: 95 % intervals, four of five departing skins, few others."""
    random = np.random.default_rng(3)
    held: list[bool] = []
    named, false = [], []
    for _ in range(150):
        true, odd, found = drawn(random, skins, 0.5)
        held += ((found.of_skins[1] < true) & (true < found.of_skins[2])).ravel().tolist()
        stated = {number for number, own in enumerate(found.departs) if own[REGULAR] < 0.5}
        false.append(bool(stated - {odd}))
        if odd is not None:
            named.append(odd in stated)
    assert 0.92 < np.mean(held) < 0.98
    assert np.mean(named) > 0.7
    assert np.mean(false) < 0.06


def test_a_skin_that_departs_does_not_pull_the_others() -> None:
    sure = np.diag([1e-4, 1e-4])
    alike = np.array([[0.0, 0.0], [0.02, -0.01], [-0.01, 0.02]])
    plain = pooled(alike, [sure] * 3)
    beside = pooled(np.vstack([alike, [0.0, 0.5]]), [sure] * 4)
    assert beside.departs[3]["second"] > 0.95
    assert np.allclose(beside.of_skins[:, :3], plain.of_skins, atol=3e-3)
    assert np.allclose(beside.mean, plain.mean, atol=5e-3)
    assert beside.of_skins[0, 3, 1] == pytest.approx(0.5, abs=0.02)  # nor they it


def test_a_departure_shows_in_what_two_quantities_say_together() -> None:
    """Each alone is unsure, their sum is sure: a skin departs though each of its quantities may be the make's."""
    loose = 0.2**2 * np.array([[1, -0.999], [-0.999, 1]])
    sisters = [np.diag([1e-4, 1e-4])] * 3
    found = pooled(np.array([[0.0, 0.0]] * 3 + [[0.15, 0.15]]), [*sisters, loose])
    assert found.departs[3][REGULAR] < 0.2
    assert abs(found.departs[3]["first"] - found.departs[3]["second"]) < 0.1  # which, nothing tells
    alone = pooled(np.array([[0.0, 0.0]] * 3 + [[0.15, 0.15]]), [*sisters, np.diag(np.diag(loose))])
    assert alone.departs[3][REGULAR] > 0.7


def test_little_said_leans_on_the_sisters() -> None:
    sure, unsure = np.diag([1e-4, 1e-4]), np.diag([0.04, 0.04])
    found = pooled(np.array([[0.0, 0.0]] * 4 + [[0.2, 0.2]]), [sure] * 4 + [unsure])
    widths = found.of_skins[2, 4] - found.of_skins[1, 4]
    assert np.all(widths < 0.5 * 2 * 1.96 * 0.2)
    assert np.all(np.abs(found.of_skins[0, 4]) < 0.03)


def test_a_posterior_and_its_likelihood_say_the_same() -> None:
    random = np.random.default_rng(1)
    spread = random.normal(size=(3, 3))
    precision, centre, mean = np.array([1.0, 4.0, 2.0]), random.normal(size=3), random.normal(size=3)
    covariance: Floats = np.linalg.inv(np.diag(precision) + spread @ spread.T + np.eye(3)).astype(np.float64)
    said = of_posterior(-3.2, mean, covariance, centre, precision)
    again, of_it = posterior(said, centre, precision)
    assert np.allclose(again, mean)
    assert np.allclose(of_it, covariance)


def test_likelihoods_of_a_mean_and_of_mixtures_are_integrals() -> None:
    x = np.linspace(-3, 3, 20001)
    said = Knowledge(np.array([[25.0]]), np.array([5.0]), 0.3)
    of_x = np.exp(0.3 + 5 * x - 12.5 * x**2)
    at = 0.4
    numeric = np.log(np.trapezoid(of_x * norm.pdf(x, at, 0.3), x))
    assert of_mean(said, np.array([0.09])).log_density(np.array([at])) == pytest.approx(numeric, abs=1e-6)
    other = Knowledge(np.array([[100.0]]), np.array([40.0]), -9.0)
    both = 0.7 * of_x + 0.3 * np.exp(-9 + 40 * x - 50 * x**2)
    weights = both * norm.pdf(x, 0.0, 0.5)
    mixture = mixed([(np.log(0.7), said), (np.log(0.3), other)], np.zeros(1), np.array([4.0]))
    mean, covariance = posterior(mixture, np.zeros(1), np.array([4.0]))
    expected = np.average(x, weights=weights)
    assert mean[0] == pytest.approx(expected, abs=1e-6)
    assert covariance[0, 0] == pytest.approx(np.average((x - expected) ** 2, weights=weights), rel=1e-6)


def test_what_is_as_wide_as_the_prior_says_nothing() -> None:
    said = of_posterior(0.0, np.array([0.05, 0.3]), np.diag([0.0099, 0.0004]), np.zeros(2), np.array([100.0, 1.0]))
    assert np.allclose(said.precision[0], 0.0)
    assert said.linear[0] == 0.0
    assert said.precision[1, 1] == pytest.approx(2499.0)
