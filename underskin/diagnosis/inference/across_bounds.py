"""Posteriors that the bounds of one parameter end, and not the recordings: integrated over that parameter.

Indentations tell E/(1 − ν²), so that E and ν trade along a ridge, which ν between its bounds cuts short. A quadratic
knows no bounds, and would leave E as unknown as the ridge is long.
"""

from dataclasses import dataclass, replace

import numpy as np

from underskin.diagnosis.inference.evidence import Evidence, around, held_points
from underskin.diagnosis.inference.hypothesis import FitPoint
from underskin.diagnosis.inference.optimizer import Fitter
from underskin.mechanisms.parameter import Uniform
from underskin.units import Floats

_OPEN = 0.3  # of the range between bounds: a uniform distribution has 0.29
_TRADED = 0.9  # correlation of two parameters that trade against each other
_CELLS = 5  # of the range, at whose middles the parameter is held


@dataclass(frozen=True)
class Part:
    """Of a posterior: its probability, and the normal distribution of the fit coordinates there."""

    share: float
    fit: Floats  # (parameters,)
    covariance: Floats  # (mean parameters, mean parameters)


def parts(evidence: Evidence, place: int) -> list[Part]:
    """The posterior of a parameter, by its place, and of all others.

    In one part, as the quadratic has it; or in as many as the range of the parameter that it trades against is divided
    into, where the recordings leave that parameter open between its bounds.
    """
    open_place = _traded(evidence, place)
    if open_place is None:
        return [Part(1.0, evidence.point.fit, evidence.covariance)]
    low, high = evidence.hypothesis.model.parameters[open_place].bounds
    values = low + (high - low) * (np.arange(_CELLS) + 0.5) / _CELLS
    found = _along(evidence, open_place, values)
    logs = np.array([entry.log_evidence for entry in found])
    shares = np.exp(logs - np.logaddexp.reduce(logs))
    mean_places = np.array(evidence.hypothesis.mean_places)
    free, cell = np.flatnonzero(mean_places != open_place), int(np.flatnonzero(mean_places == open_place)[0])
    each = []
    for share, entry in zip(shares.tolist(), found, strict=True):
        covariance = np.zeros_like(evidence.covariance)
        covariance[np.ix_(free, free)] = entry.covariance
        covariance[cell, cell] = ((high - low) / _CELLS) ** 2 / 12  # anywhere in its cell
        each.append(Part(share, entry.point.fit, covariance))
    return each


def _along(evidence: Evidence, place: int, values: Floats) -> list[Evidence]:
    """The evidence with a parameter held at each of these values, all others fitted again.

    From one value to the next, away from the most probable one: along a straight line, samples lose their contact.
    """
    held = Fitter([evidence.hypothesis], held=[(place,)])
    middle = float(evidence.point.fit[place])
    reached: dict[float, FitPoint] = {middle: evidence.point}
    found: dict[float, Evidence] = {}
    for value in sorted(values.tolist(), key=lambda value: abs(value - middle)):
        begin = held_points(held, [evidence], [place], [0], np.array([value]))
        if len(reached) > 1:
            near, far = sorted(reached, key=lambda other: abs(other - value))[:2]
            step = (reached[near].fit - reached[far].fit) * (value - near) / (near - far)
            begin = held.at(replace(reached[near], fit=np.clip(reached[near].fit + step, held.low[0], held.high[0])))
        (found[value],) = around(held, held.descend(held.settle(held.evaluate(begin), 1), 1))
        reached[value] = found[value].point
    return [found[value] for value in values.tolist()]


def _traded(evidence: Evidence, place: int) -> int | None:
    """The place of the mechanisms' parameter between bounds alone that a parameter trades against; None for none."""
    hypothesis = evidence.hypothesis
    deviations = np.sqrt(np.diag(evidence.covariance))
    row = hypothesis.mean_places.index(place)
    correlations = np.abs(evidence.covariance[row]) / (deviations[row] * deviations)
    for index, other in enumerate(hypothesis.mean_places):
        entry = hypothesis.model.parameters[other]
        low, high = entry.bounds
        between = other < hypothesis.own_parameters and isinstance(entry.prior, Uniform) and entry.scale == "linear"
        if between and correlations[index] > _TRADED and deviations[index] > _OPEN * (high - low):
            return other
    return None
