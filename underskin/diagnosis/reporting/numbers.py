"""Numbers as a report states them: rounded to stated digits, parameters with their 95 % intervals."""

from typing import Any

import numpy as np
from scipy.special import ndtri

from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.inference.laplace import levels_covariance

_QUANTILE = float(ndtri(0.975))


def rounded(value: float, digits: int = 4) -> float | None:
    """To significant digits; None for what is not finite."""
    return float(f"{value:.{digits}g}") if np.isfinite(value) else None


def probability(value: float) -> float:
    """To three decimals."""
    return round(value, 3)


def place_of(explanation: Explanation, name: str) -> int:
    """Where in its model's parameters one is."""
    return [entry.name for entry in explanation.model.parameters].index(name)


def parameter(explanation: Explanation, place: int) -> dict[str, Any]:
    """A parameter's most probable value and 95 % interval, within its bounds."""
    best, point = explanation.best, explanation.point
    entry = explanation.model.parameters[place]
    if entry.moves_covariance:
        own = [parameter.name for parameter in best.hypothesis.covariance].index(entry.name)
        variance = float(levels_covariance(best.fitter.covariance_equations(best.at)[1][0])[own, own])
    else:
        index = best.hypothesis.mean_places.index(place)
        variance = float(explanation.best.covariance[index, index])
    half_width = _QUANTILE * np.sqrt(max(variance, 0.0))
    low, high = entry.bounds
    middle = float(point.fit[place])
    ends = (max(middle - half_width, low), min(middle + half_width, high))
    return {
        "name": entry.name,
        "unit": entry.unit,
        "value": rounded(float(entry.from_fit(middle))),
        "low": rounded(float(entry.from_fit(ends[0]))),
        "high": rounded(float(entry.from_fit(ends[1]))),
    }
