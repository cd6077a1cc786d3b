"""The evidence of one hypothesis: Laplace's method, with care for parameters at their bounds.

log Z = −cost* + (n/2) log 2π − ½ log|H| + log P(box). The cost is that of the quadratic's own minimum (which may lie
outside the bounds), H the information on the mean parameters and the Hessian in the covariance's, P(box) the
probability that a normal with this mean and H⁻¹ gives to the bounds: one bound after another, each with the moments
left by the ones before (exact for one bound; Mendell and Elston 1974).

A parameter on a logarithmic scale that the lines leave loose (the time of a small step, the onset of a small loss) has
no bell for a posterior: the others follow it along a bend, and where the effect is small it is free. There Z is the
integral over that parameter of the evidence that the method above gives with it held: a sum at equal strides, as good
as exact for what falls to nothing both ways, and up to a third of a nat too high for what ends on a bound.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import log_ndtr

from underskin.diagnosis.fit import Evaluated, Fitter
from underskin.diagnosis.hypothesis import own_parameters
from underskin.units import Floats

_NEAR = 4.0  # standard deviations from a bound within which it counts
_POLISHING, _POLISHED = 4, 0.05  # steps at most, and the gain in log posterior below which it stops
_LEAST_COVARIANCE_CURVATURE = 0.3  # of logarithms of noise levels: their priors are not wider
_TRUSTED = 1.0  # gain in log posterior that polishing may leave
_LOOSE = 0.3  # standard deviation beyond which a logarithmic parameter is integrated over: a factor of 1.35
_FEWEST_STRIDES = 8  # from one bound to the other
_GONE = 4.0  # nats below the greatest of the walk at which it ends
_FLAT = 1e-3  # least standard deviations of the quadratic within a parameter's bounds: keeps H invertible


@dataclass(frozen=True)
class Evidence:
    """log Z up to what all hypotheses share, the most probable point, and the parameters' covariance there."""

    log_evidence: float
    fitter: Fitter
    at: Evaluated
    covariance: Floats  # (mean parameters, mean parameters), of the quadratic, bounds not counted


def laplace(fitter: Fitter, at: Evaluated) -> Evidence:
    """The evidence around a most probable point, over all values of a parameter that the lines leave loose."""
    return integrated(around(fitter, at))


def integrated(found: Evidence) -> Evidence:
    """Over all values of a parameter that the lines leave loose, where there is one."""
    place = _loosest(found)
    return found if place is None else _integrated(found, place)


def _loosest(found: Evidence) -> int | None:
    """The place of the mechanisms' logarithmic parameter whose standard deviation is the largest, where that counts."""
    own = own_parameters(found.fitter.hypothesis)
    deviations = {
        place: float(np.sqrt(variance))
        for place, variance in zip(found.fitter.places, np.diag(found.covariance), strict=True)
        if place < own and found.fitter.parameters[place].scale == "log"
    }
    place = max(deviations, key=lambda place: deviations[place], default=None)
    return place if place is not None and deviations[place] > _LOOSE else None


def _integrated(found: Evidence, place: int) -> Evidence:
    """With log ∫ Z(x) p(x) dx over the parameter x at this place, walking from its most probable value both ways.

    Where the walk comes upon a point more probable than that, all begins again from there.
    """
    fitter, at = found.fitter, found.at
    held = Fitter(fitter.hypothesis, held=place)
    low, high = fitter.low[place], fitter.high[place]
    deviation = float(np.sqrt(np.diag(found.covariance)[fitter.places.index(place)]))
    stride = min(deviation, (high - low) / _FEWEST_STRIDES)
    begin = float(at.point.fit[place])
    walked = [_held_at(held, at, place, begin)]
    for way in (-stride, stride):
        near, value = walked[0].at, begin + way
        while low <= value <= high:
            walked.append(_held_at(held, near, place, value))
            near, value = walked[-1].at, value + way
            if walked[-1].log_evidence < max(entry.log_evidence for entry in walked) - _GONE:
                break
    best = min(walked, key=lambda entry: entry.at.cost - held.parameters[place].log_prior(entry.at.point.fit[place]))
    better = fitter.settle(fitter.evaluate(best.at.point), 1)
    if better.cost < at.cost - _TRUSTED:
        return laplace(fitter, better)
    total = np.logaddexp.reduce([entry.log_evidence for entry in walked]) + np.log(stride)
    return replace(found, log_evidence=float(total))


def _held_at(held: Fitter, near: Evaluated, place: int, value: float) -> Evidence:
    """Of the other parameters with this one held at a value, times its prior's density there."""
    fit = near.point.fit.copy()
    fit[place] = value
    begin = replace(held.settle(held.evaluate(replace(near.point, fit=fit)), 1), growth=near.growth)
    found = around(held, begin)
    return replace(found, log_evidence=found.log_evidence + held.parameters[place].log_prior(value))


def around(fitter: Fitter, at: Evaluated) -> Evidence:
    """By the quadratic around a most probable point, which is first brought to where the whole gradient vanishes."""
    places = fitter.places
    low, high = fitter.low[places], fitter.high[places]
    if fitter.hypothesis.placed and at.growth is None:
        at = fitter.with_growth(at)
    for _ in range(_POLISHING):
        information, ascent = fitter.posterior_equations(at)
        information, gradient = information + np.diag((_FLAT / (high - low)) ** 2), -ascent
        polished = _polish(fitter, at, information, gradient)
        if polished is None:
            break
        at = polished
    covariance: Floats = np.linalg.inv(information).astype(np.float64)
    fit = at.point.fit[places]
    # Towards a bound the gradient stays; elsewhere, where polishing left much of it, the fit hangs at a kink, and what
    # a smooth cost would still gain there is not to be had.
    free = ~(((fit <= low) & (gradient > 0)) | ((fit >= high) & (gradient < 0)))
    if 0.5 * gradient[free] @ np.linalg.solve(information[np.ix_(free, free)], gradient[free]) > _TRUSTED:
        gradient = np.where(free, 0.0, gradient)
    gain = 0.5 * gradient @ covariance @ gradient
    shift = -covariance @ gradient
    mean_part = -at.cost + gain + 0.5 * len(fit) * np.log(2 * np.pi) - 0.5 * np.linalg.slogdet(information)[1]
    mean_part += log_box((fit + shift).astype(np.float64), covariance, low, high)
    slope, hessian = fitter.covariance_equations(at)
    eigenvalues = np.maximum(np.linalg.eigvalsh(hessian), _LEAST_COVARIANCE_CURVATURE)
    level_part = 0.5 * len(slope) * np.log(2 * np.pi) - 0.5 * float(np.log(eigenvalues).sum())
    return Evidence(float(mean_part + level_part), fitter, at, covariance)


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
