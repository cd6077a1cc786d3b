"""The evidence of one hypothesis by Laplace's method, with care for parameters at their bounds.

log Z = −cost* + (n/2) log 2π − ½ log|H| + log P(box). The cost is that of the quadratic's own minimum (which may lie
outside the bounds), H the information on the mean parameters and the Hessian in the covariance's, P(box) the
probability that a normal with this mean and H⁻¹ gives to the bounds: one bound after another, each with the moments
left by the ones before (exact for one bound; Mendell and Elston 1974).
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import log_ndtr

from underskin.diagnosis.inference.optimizer import Evaluated, Fitter
from underskin.units import Floats

_NEAR = 4.0  # standard deviations from a bound within which it counts
_POLISHING, _POLISHED = 4, 0.05  # steps at most, and the gain in log posterior below which it stops
_LEAST_COVARIANCE_CURVATURE = 0.3  # of logarithms of noise levels: their priors are not wider
_TRUSTED = 1.0  # gain in log posterior that polishing may leave
_FLAT = 1e-3  # least standard deviations of the quadratic within a parameter's bounds: keeps H invertible


@dataclass(frozen=True)
class Evidence:
    """log Z up to what all hypotheses share, the most probable point, and the parameters' covariance there."""

    log_evidence: float
    fitter: Fitter
    at: Evaluated
    covariance: Floats  # (mean parameters, mean parameters), of the quadratic, bounds not counted


def around(fitter: Fitter, at: Evaluated) -> Evidence:
    """By the quadratic around a most probable point, which is first brought to where the whole gradient vanishes."""
    if fitter.hypothesis.placed and at.growth is None:
        at = fitter.with_growth(at)
    equations = _equations(fitter, at)
    for _ in range(_POLISHING):
        polished = _polish(fitter, at, *equations)
        if polished is None:
            break
        at, equations = polished, _equations(fitter, polished)
    log_evidence, covariance = _mean_part(fitter, at, *equations)
    return Evidence(log_evidence + around_levels(fitter, at), fitter, at, covariance)


def around_mean(fitter: Fitter, at: Evaluated) -> float:
    """The log of the integral over the mean parameters, those of the covariance held."""
    return _mean_part(fitter, at, *_equations(fitter, at))[0]


def _mean_part(fitter: Fitter, at: Evaluated, information: Floats, gradient: Floats) -> tuple[float, Floats]:
    """That, and the covariance of the quadratic."""
    places = fitter.places
    fit, low, high = at.point.fit[places], fitter.low[places], fitter.high[places]
    # Towards a bound the gradient stays; elsewhere, where polishing left much of it, the fit hangs at a kink, and what
    # a smooth cost would still gain there is not to be had.
    free = ~(((fit <= low) & (gradient > 0)) | ((fit >= high) & (gradient < 0)))
    if 0.5 * gradient[free] @ np.linalg.solve(information[np.ix_(free, free)], gradient[free]) > _TRUSTED:
        gradient = np.where(free, 0.0, gradient)
    covariance: Floats = np.linalg.inv(information).astype(np.float64)
    gain = 0.5 * gradient @ covariance @ gradient
    volume = 0.5 * len(fit) * np.log(2 * np.pi) - 0.5 * np.linalg.slogdet(information)[1]
    mean = (fit - covariance @ gradient).astype(np.float64)
    return float(-at.cost + gain + volume + log_box(mean, covariance, low, high)), covariance


def around_levels(fitter: Fitter, at: Evaluated) -> float:
    """What the integral over the covariance's parameters adds to the log at their mode."""
    return log_volume(fitter.covariance_equations(at)[1])


def log_volume(hessian: Floats) -> float:
    """The log volume of the normal approximation in the logarithms of the noise levels."""
    eigenvalues = np.maximum(np.linalg.eigvalsh(hessian), _LEAST_COVARIANCE_CURVATURE)
    return float(0.5 * len(hessian) * np.log(2 * np.pi) - 0.5 * np.log(eigenvalues).sum())


def levels_covariance(hessian: Floats) -> Floats:
    """The covariance of the logarithms of the noise levels, with the same least curvature.

    At a bound the Hessian may be negative, and an interval read from it would have no width.
    """
    eigenvalues, vectors = np.linalg.eigh(hessian)
    return np.asarray(vectors / np.maximum(eigenvalues, _LEAST_COVARIANCE_CURVATURE) @ vectors.T)


def _equations(fitter: Fitter, at: Evaluated) -> tuple[Floats, Floats]:
    """Information on the mean parameters and the gradient of the cost."""
    information, ascent = fitter.posterior_equations(at)
    low, high = fitter.low[fitter.places], fitter.high[fitter.places]
    return information + np.diag((_FLAT / (high - low)) ** 2), -ascent


def _polish(fitter: Fitter, at: Evaluated, information: Floats, gradient: Floats) -> Evaluated | None:
    """A Newton step with the whole gradient, within the bounds; None where it gains nothing."""
    places = fitter.places
    fit, low, high = at.point.fit[places], fitter.low[places], fitter.high[places]
    held = ((fit <= low) & (gradient > 0)) | ((fit >= high) & (gradient < 0))
    free = ~held
    if not free.any():
        return None
    step = np.zeros(len(fit))
    step[free] = -np.linalg.solve(information[np.ix_(free, free)], gradient[free])
    if -0.5 * gradient @ step < _POLISHED:
        return None
    for _ in range(5):
        moved = at.point.fit.copy()
        moved[places] = np.clip(fit + step, low, high)
        tried = fitter.settle(fitter.evaluate(replace(at.point, fit=moved)), 1)
        if tried.cost < at.cost - 0.2 * _POLISHED:
            return replace(tried, growth=at.growth)
        step = step / 3
    return None


def log_box(mean: Floats, covariance: Floats, low: Floats, high: Floats) -> float:
    """The logarithm of the probability of low < x < high for x ~ N(mean, covariance)."""
    mean, covariance = mean.copy(), covariance.copy()
    deviation = np.sqrt(np.diag(covariance))
    near = np.minimum(mean - low, high - mean) < _NEAR * deviation
    total = 0.0
    for place in np.flatnonzero(near):
        sd = float(np.sqrt(covariance[place, place]))
        a, b = (low[place] - mean[place]) / sd, (high[place] - mean[place]) / sd
        if a > 0:  # the far tail is computed on the side where it is small
            a, b, sign = -b, -a, -1.0
        else:
            sign = 1.0
        log_mass = _log_between(a, b)
        total += log_mass
        # Mean and variance of the truncated normal, and what they do to the others
        density_a, density_b = (np.exp(-0.5 * x * x - 0.5 * np.log(2 * np.pi) - log_mass) for x in (a, b))
        first = density_a - density_b
        tail = (a * density_a if np.isfinite(a) else 0.0) - (b * density_b if np.isfinite(b) else 0.0)
        variance = float(np.clip(1 + tail - first**2, 1e-6, 1.0))
        gain = covariance[:, place] / sd
        mean = mean + gain * sign * first
        covariance = covariance - np.outer(gain, gain) * (1 - variance)
    return total


def _log_between(a: float, b: float) -> float:
    """log(Φ(b) − Φ(a)), a < b and a ≤ 0."""
    upper, lower = log_ndtr(b), log_ndtr(a)
    return float(upper + np.log1p(-np.exp(min(lower - upper, -1e-15))))
