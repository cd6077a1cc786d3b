"""A d33 of all sensors that changed from one campaign to the next: how well that is known, and what could have done it.

The same factor on all sensors tells nothing of its cause: d33 itself, or a mechanism that in this design acts as one
factor, such as a glue line that gives way alike under every sphere.
"""

from collections.abc import Sequence

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.inference.hypothesis import own_places
from underskin.diagnosis.inference.unseen import beside
from underskin.diagnosis.reporting.numbers import place_of
from underskin.diagnosis.several.course import Candidate, Course, same_strength
from underskin.diagnosis.several.posteriors import Shared
from underskin.diagnosis.several.sensors import USUAL, Change
from underskin.units import Floats

AGEING = "ageing"
_LIKELY = 0.1  # of the weight of the most probable cause, from which on another one is listed
_BETWEEN = 0.03  # of ln d33: places over a mechanism's prior lie about as far apart


def unsure_of_changes(candidates: Sequence[Candidate], leader: Course) -> list[float]:
    """Of each campaign by how much ln d33 since the one before is unsure by the mechanisms' strengths; a mechanism that
    is in both with one strength moves both alike. 0 of the first."""
    found = [0.0]
    for number in range(1, len(candidates)):
        before, after = (_moving(candidates[place], leader.sets[place]) for place in (number - 1, number))
        common = [name for name in before.names if name in after.names and _stays(before, after, name)]
        of_both = (_added(candidates[number - 1], before, common), _added(candidates[number], after, common))
        found.append(float(np.hypot(*of_both)))
    return found


def causes(candidate: Candidate, names: Sequence[str], change: Change) -> tuple[str, ...]:
    """The mechanisms that, appearing beside a campaign's own `names`, would change d33 of all sensors so: ageing, which
    is d33 itself and only falls, then the most probable first."""
    explanation = _moving(candidate, names)
    before = float(explanation.point.fit[place_of(explanation, "d33")] - np.log1p(change.value))
    weights = {AGEING: float(_normal(np.log1p([change.value]), USUAL)[0])} if change.value < 0 else {}
    width = float(np.hypot(change.uncertainty, _BETWEEN))
    for name in candidate.problem.lines.mechanisms.named:
        found = None if name in {*names, AGEING} else beside(candidate.problem, explanation, name, "d33")
        if found is not None:
            weights[name] = float(found.share @ _normal(found.mean - before, width))
    most = max(weights.values(), default=0.0)
    likely = {name: weight for name, weight in weights.items() if weight > _LIKELY * most}
    return tuple(sorted(likely, key=lambda name: (name != AGEING, -likely[name])))


def _moving(candidate: Candidate, names: Sequence[str]) -> Explanation:
    """Of a set that part which moves predictions: a spread of the sensors does not change what one of them has."""
    mechanisms = candidate.problem.lines.mechanisms
    found = candidate.explained(frozenset(name for name in names if mechanisms[name].moves_predictions))
    assert found is not None
    return found


def _stays(before: Explanation, after: Explanation, name: str) -> bool:
    return same_strength(*(Shared.of(fit, [name], skin=False) for fit in (before, after)))


def _added(candidate: Candidate, fit: Explanation, common: Sequence[str]) -> float:
    """Standard deviation of ln d33 beyond the base model's, with the parameters of `common` mechanisms known."""
    nothing = candidate.explained(frozenset())
    assert nothing is not None
    return float(np.sqrt(max(_variance(fit, common) - _variance(nothing, ()), 0.0)))


def _variance(fit: Explanation, common: Sequence[str]) -> float:
    hypothesis, covariance = fit.best.hypothesis, fit.best.covariance
    places = own_places(fit.names, hypothesis.lines)
    known = [place for name in common for place in range(places[name].start, places[name].stop)]
    rows = [hypothesis.mean_places.index(place) for place in known if place in hypothesis.mean_places]
    d33 = hypothesis.mean_places.index(place_of(fit, "d33"))
    with_known = covariance[d33, rows]
    return float(covariance[d33, d33] - with_known @ np.linalg.solve(covariance[np.ix_(rows, rows)], with_known))


def _normal(away: Floats, deviation: float) -> Floats:
    return np.asarray(np.exp(-0.5 * np.square(away / deviation)) / deviation)
