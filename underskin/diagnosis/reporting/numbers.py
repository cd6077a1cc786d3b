"""Numbers as a report states them: rounded to stated digits, parameters with their 95 % intervals."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri

from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.inference.hypothesis import own_places
from underskin.diagnosis.inference.laplace import levels_covariance
from underskin.diagnosis.inference.profile import profile_end
from underskin.mechanisms.parameter import Parameter
from underskin.units import Floats

SDS_OF_95 = float(ndtri(0.975))  # half the width of a 95 % interval in standard deviations


def rounded(value: float, digits: int = 4) -> float | None:
    """To significant digits; None for what is not finite."""
    return float(f"{value:.{digits}g}") if np.isfinite(value) else None


def mixture_quantile(level: float, shares: Floats, means: Floats, deviations: Floats) -> float:
    """Of a mixture of normal distributions, whose `shares` sum to 1, (parts,)."""

    def beyond(at: float) -> float:
        return float(shares @ ndtr((at - means) / deviations) - level)

    far = 8 * deviations.max()
    return float(brentq(beyond, means.min() - far, means.max() + far))


def with_hidden(
    modulus: Mapping[str, Any], hidden: Sequence[tuple[float, float]], tolerance: float = 0.0
) -> dict[str, Any]:
    """A modulus with its 95 % interval, of which the logarithm may be too large by `hidden` values with probabilities,
    and differs by a standard deviation of `tolerance` from the one sought."""
    if len(hidden) == 1 and tolerance == 0:
        return dict(modulus)
    deviation = np.log(modulus["high"] / modulus["low"]) / (2 * SDS_OF_95)
    excess, shares = np.array(hidden).T
    means, deviations = np.log(modulus["value"]) - excess, np.full(len(excess), np.hypot(deviation, tolerance))
    levels = {"value": 0.5, "low": 0.025, "high": 0.975}
    ends = {key: np.exp(mixture_quantile(level, shares, means, deviations)) for key, level in levels.items()}
    return {**modulus, **{key: rounded(float(at)) for key, at in ends.items()}}


def place_of(explanation: Explanation, name: str) -> int:
    """Where in its model's parameters one is."""
    return [entry.name for entry in explanation.model.parameters].index(name)


def parameter(explanation: Explanation, place: int) -> dict[str, Any]:
    """A parameter's most probable value and 95 % interval, within its bounds: 1.96 standard deviations either way.

    Where these reach the value at which a mechanism does nothing, and the profile of the posterior falls off before it,
    the interval ends where the profile does. `at_bound` is the end of its search that it lies at or beyond, `low` or
    `high`, where it does.
    """
    best, point = explanation.best, explanation.point
    entry = explanation.model.parameters[place]
    if entry.moves_covariance:
        own = [parameter.name for parameter in best.hypothesis.covariance].index(entry.name)
        variance = float(levels_covariance(best.fitter.covariance_equations(best.at)[1][0])[own, own])
    else:
        index = best.hypothesis.mean_places.index(place)
        variance = float(explanation.best.covariance[index, index])
    half_width = SDS_OF_95 * np.sqrt(max(variance, 0.0))
    low, high = entry.bounds
    middle = float(point.fit[place])
    ends = [max(middle - half_width, low), min(middle + half_width, high)]
    limit = None if entry.moves_covariance else entry.fit_limit
    if limit is not None and ends[0] <= limit <= ends[1] and limit != middle:
        side = 0 if limit < middle else 1
        end = profile_end(best, place, limit)
        ends[side] = ends[side] if end is None else end
    values = [entry.from_fit(at) for at in (middle, *ends)]
    if entry.relative_to is not None:
        values = _absolute(explanation, place, values)
    stated = zip(("value", "low", "high"), values, strict=True)
    at_bound = entry.ends_search(middle)
    return {
        "name": entry.name,
        "unit": entry.unit,
        **{key: rounded(float(value)) for key, value in stated},
        **({} if at_bound is None else {"at_bound": at_bound}),
    }


def multiple_of(explanation: Explanation, entry: Parameter) -> float:
    """The value that a parameter's bounds and prior are multiples of: 1, or that of the one it is relative to."""
    if entry.relative_to is None:
        return 1.0
    other = place_of(explanation, entry.relative_to)
    return explanation.model.parameters[other].from_fit(float(explanation.point.fit[other]))


def without_effect(explanation: Explanation) -> list[str]:
    """Its mechanisms of which the 95 % interval of every strength holds the value at which the mechanism does nothing.

    A strength is a parameter with such a value (`limit`); on a logarithmic scale none reaches 0 or ∞.
    """
    idle = []
    for name, place in own_places(explanation.names, explanation.best.hypothesis.lines).items():
        own = range(place.start, place.stop)
        strengths = [index for index in own if explanation.model.parameters[index].limit is not None]
        if strengths and all(_holds_limit(explanation, index) for index in strengths):
            idle.append(name)
    return idle


def _holds_limit(explanation: Explanation, place: int) -> bool:
    stated, limit = parameter(explanation, place), explanation.model.parameters[place].limit
    return limit is not None and bool(stated["low"] <= limit <= stated["high"])


def _absolute(explanation: Explanation, place: int, multiples: list[float]) -> list[float]:
    """A parameter that is fitted as a multiple of another, as their product; both on logarithmic scales.

    The interval is that of the product, cut off where the multiple has its bounds.
    """
    best, entry = explanation.best, explanation.model.parameters[place]
    assert entry.relative_to is not None
    other = place_of(explanation, entry.relative_to)
    places = [best.hypothesis.mean_places.index(one) for one in (place, other)]
    deviation = float(np.sqrt(max(best.covariance[np.ix_(places, places)].sum(), 0.0)))
    unit = float(np.exp(explanation.point.fit[other]))
    factor = np.exp(SDS_OF_95 * deviation)
    value = multiples[0] * unit
    return [value, max(value / factor, min(entry.low * unit, value)), min(value * factor, entry.high * unit)]
