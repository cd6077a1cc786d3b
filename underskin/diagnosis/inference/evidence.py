"""The evidence of one hypothesis: Laplace's method, and integrals over parameters whose posterior is not Gaussian.

A parameter on a logarithmic scale that the lines hardly determine (the time of a small step, the onset of a small loss)
is one: the others follow it along a curve, and where the effect is small it is free. There Z is the integral over that
parameter of the evidence that Laplace's method gives with it held.

The positioning scatter is another: its prior is flat between two values, and often the recordings do not determine it;
the gain scatter's posterior is then not Gaussian either. There Z is the integral over the logarithms of both, at the
most probable prediction, from which the quadratic of the mean parameters leads on.

Integrals are sums at equal strides, as good as exact for what falls to nothing both ways.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from underskin.diagnosis.inference.hypothesis import own_parameters
from underskin.diagnosis.inference.laplace import Evidence, around, around_levels, around_mean, log_volume
from underskin.diagnosis.inference.objective import GAIN, POSITION
from underskin.diagnosis.inference.optimizer import Evaluated, Fitter

__all__ = ["Evidence", "around", "integrated", "laplace"]

_TRUSTED = 1.0  # gain in log posterior within which a walk has begun at the most probable point
_LOOSE = 0.3  # standard deviation beyond which a logarithmic parameter is integrated over: a factor of 1.35
_FEWEST_STRIDES = 8  # from one bound to the other
_GONE = 4.0  # nats below the greatest of the walk at which it ends
_LONGEST_STRIDE = 0.3  # of scatter's logarithm: twice the deviation with which its prior falls off
_GAIN_STRIDES = 8  # either way: 2.4 of the logarithm at most, and the prior's flat part is 1.6 wide
_SETTLING = 3  # steps of the other noise levels at each positioning scatter


def laplace(fitter: Fitter, at: Evaluated) -> Evidence:
    """The evidence around a most probable point, over all values of what the lines leave loose."""
    return integrated(around(fitter, at))


def integrated(evidence: Evidence) -> Evidence:
    """Over all values of a parameter that the lines leave loose, where there is one, and of the positioning scatter."""
    over_loose = _over_loose(evidence)
    return _over_position(over_loose) if over_loose.fitter.hypothesis.placed else over_loose


def _over_loose(evidence: Evidence) -> Evidence:
    """With log ∫ Z(x) p(x) dx over the loosest parameter x, walking from its most probable value both ways.

    Where the walk comes upon a point more probable than that, all begins again from there.
    """
    place = _loosest(evidence)
    if place is None:
        return evidence
    fitter, at = evidence.fitter, evidence.at
    held = Fitter(fitter.hypothesis, held=place)
    low, high = fitter.low[place], fitter.high[place]
    deviation = float(np.sqrt(np.diag(evidence.covariance)[fitter.places.index(place)]))

    def held_at(near: Evidence, value: float) -> Evidence:
        return _held_at(held, near.at, place, value)

    stride = min(deviation, (high - low) / _FEWEST_STRIDES)
    total, walked = _integral(held_at, evidence, float(at.point.fit[place]), stride, (low, high))
    best = min(walked, key=lambda entry: entry.at.cost - held.parameters[place].log_prior(entry.at.point.fit[place]))
    better = fitter.settle(fitter.evaluate(best.at.point), 1)
    if better.cost < at.cost - _TRUSTED:
        return _over_loose(around(fitter, better))
    return replace(evidence, log_evidence=total)


def _loosest(evidence: Evidence) -> int | None:
    """The place of the mechanisms' logarithmic parameter whose standard deviation is the largest, where that counts."""
    own = own_parameters(evidence.fitter.hypothesis)
    deviations = {
        place: float(np.sqrt(variance))
        for place, variance in zip(evidence.fitter.places, np.diag(evidence.covariance), strict=True)
        if place < own and evidence.fitter.parameters[place].scale == "log"
    }
    place = max(deviations, key=lambda place: deviations[place], default=None)
    return place if place is not None and deviations[place] > _LOOSE else None


def _held_at(held: Fitter, near: Evaluated, place: int, value: float) -> Evidence:
    """Of the other parameters with this one held at a value, times its prior's density there."""
    fit = near.point.fit.copy()
    fit[place] = value
    begin = replace(held.settle(held.evaluate(replace(near.point, fit=fit)), 1), growth=near.growth)
    evidence = around(held, begin)
    return replace(evidence, log_evidence=evidence.log_evidence + held.parameters[place].log_prior(value))


def _over_position(evidence: Evidence) -> Evidence:
    """With the integral over log p in place of its normal approximation, p the positioning scatter."""
    fitter, at = evidence.fitter, evidence.at
    bounds = fitter.covariance[POSITION].low, fitter.covariance[POSITION].high
    stride = _stride(fitter.covariance_equations(at)[1][POSITION, POSITION])
    total, _ = _integral(_at_position, evidence, float(at.point.covariance[POSITION]), stride, bounds)
    quadratic = around_mean(fitter, at) + around_levels(fitter, at)
    return replace(evidence, log_evidence=evidence.log_evidence + total - quadratic)


def _at_position(near: Evidence, value: float) -> Evidence:
    """With the other noise levels settled at this positioning scatter."""
    fitter, covariance = near.fitter, near.at.point.covariance.copy()
    covariance[POSITION] = value
    begin = fitter.weighed_anew(fitter.moved(near.at.point, covariance), near.at)
    at = replace(fitter.settle(begin, _SETTLING, held=POSITION), growth=near.at.growth)
    return replace(near, at=at, log_evidence=around_mean(fitter, at) + _over_gain(fitter, at))


def _over_gain(fitter: Fitter, at: Evaluated) -> float:
    """What the integral over the noise levels but the position's adds: a sum over the gain's, the others following."""
    hessian = fitter.covariance_equations(at)[1]
    others = [place for place in range(len(hessian)) if place not in (GAIN, POSITION)]
    curvature = hessian[np.ix_(others, others)]
    stride = _stride(hessian[GAIN, GAIN])
    steps = stride * np.arange(-_GAIN_STRIDES, _GAIN_STRIDES + 1)
    covariances = np.repeat(at.point.covariance[None], len(steps), axis=0)
    covariances[:, GAIN] += steps
    covariances[:, others] -= np.outer(steps, np.linalg.solve(curvature, hessian[others, GAIN]))
    entry = fitter.covariance[GAIN]
    within = (covariances[:, GAIN] >= entry.low) & (covariances[:, GAIN] <= entry.high)
    gains = at.cost - fitter.costs(at, covariances[within])
    return float(np.logaddexp.reduce(gains) + np.log(stride) + log_volume(curvature))


def _stride(curvature: float) -> float:
    """One standard deviation, or what resolves how the priors of scatter fall off."""
    return float(max(curvature, _LONGEST_STRIDE**-2) ** -0.5)


def _integral(
    held_at: Callable[[Evidence, float], Evidence],
    near: Evidence,
    begin: float,
    stride: float,
    bounds: tuple[float, float],
) -> tuple[float, list[Evidence]]:
    """log ∫ Z(x) dx within the bounds, walking from `begin` both ways until Z is gone, and what was found on the way.

    Each point counts for half the way to the next; the last before a bound for the way to the bound.
    """
    low, high = bounds
    evidence_at = {begin: held_at(near, begin)}
    for way in (-stride, stride):
        last, value = begin, begin + way
        while low <= value <= high:
            evidence_at[value] = held_at(evidence_at[last], value)
            if evidence_at[value].log_evidence < max(entry.log_evidence for entry in evidence_at.values()) - _GONE:
                break
            last, value = value, value + way
    values = np.array(sorted(evidence_at))
    below, above = values[0] - low, high - values[-1]
    edges = [values[0] - (below if below < stride else stride / 2), *((values[1:] + values[:-1]) / 2)]
    edges.append(values[-1] + (above if above < stride else stride / 2))
    logs = [evidence_at[value].log_evidence for value in values.tolist()]
    return float(np.logaddexp.reduce(logs + np.log(np.maximum(np.diff(edges), 1e-300)))), list(evidence_at.values())
