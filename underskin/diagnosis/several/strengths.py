"""The strengths of mechanisms that several skins of one make have, as populations."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.inference.hypothesis import own_places, quadratic_of_prior
from underskin.diagnosis.inference.knowledge import Knowledge
from underskin.diagnosis.several.common_set import CommonSet
from underskin.diagnosis.several.course import Candidate
from underskin.diagnosis.several.population import REGULAR, Make, Populations, Spread, State, populations

_LEAST_SKINS = 3
_INFORMS = 0.5  # of a prior's precision: what recordings must say at least to count
_WIDEST = 10.0  # deviation of the logarithm of a strength of which nothing is known
_SPREAD = Spread(0.1, 2.0)  # deviation of its logarithm from skin to skin
_FAR = 1.0  # the same of a skin that departs in it
DEPARTS = "strength"


@dataclass(frozen=True)
class Strength:
    """One parameter of a mechanism, with its unit, as a population of the skins that have it."""

    parameter: str
    unit: str
    skins: tuple[str, ...]
    population: Populations


def of_strengths(candidates: Mapping[str, Candidate], common: CommonSet) -> list[Strength]:
    """Of the positive parameters of mechanisms that at least three skins have."""
    said: dict[tuple[str, str], dict[str, list[State]]] = {}
    for (skin, candidate), names in zip(candidates.items(), common.sets, strict=True):
        fit = candidate.explained(frozenset(names))
        if fit is None:
            continue
        for mechanism, places in own_places(fit.names, fit.best.hypothesis.lines).items():
            for place in range(places.start, places.stop):
                entry = fit.model.parameters[place]
                likelihood = _likelihood(fit, place)
                if entry.scale == "log" and likelihood is not None:
                    states = [State(REGULAR, likelihood, np.zeros(1)), State(DEPARTS, likelihood, np.array([_FAR**2]))]
                    said.setdefault((f"{mechanism}.{entry.name}", entry.unit), {})[skin] = states
    make = Make(0.0, np.zeros(1), np.array([_WIDEST**-2]))
    return [
        Strength(parameter, unit, tuple(own), populations(list(own.values()), [make], [_SPREAD]))
        for (parameter, unit), own in said.items()
        if len(own) >= _LEAST_SKINS
    ]


def _likelihood(fit: Explanation, place: int) -> Knowledge | None:
    """Of one fit coordinate by the recordings alone, the prior taken out; None where they say next to nothing of it, or
    it moves the covariance alone."""
    hypothesis = fit.best.hypothesis
    if place not in hypothesis.mean_places:
        return None
    row = hypothesis.mean_places.index(place)
    after = 1 / float(fit.best.covariance[row, row])
    prior, centre = quadratic_of_prior(fit.model.parameters[place], float(fit.point.fit[place]))
    precision = after - prior
    if precision < _INFORMS * prior:
        return None
    return Knowledge(np.array([[precision]]), np.array([after * fit.point.fit[place] - prior * centre]), 0.0)
