"""Which sets of mechanisms are fitted to curves beyond each mechanism alone, and from where.

A fit that begins at one mechanism's best parameters may end where another one's cannot be told: two that bend a curve
alike share the bend between them in many ways. So where the best set leaves more than noise, pairs are fitted again
from starts over the parameters of both.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.objective import LEVEL, SMOOTH
from underskin.diagnosis.inference.optimizer import Fitter
from underskin.diagnosis.selection.smaller_sets import Explanations, was_stuck

_LEFT = 15.0  # nats of a smooth error: noise alone has 8 to 12, since the prior expects one
_ROUGHER = np.geomspace(1.0, 12.0, 12)  # times the level of the noise


def afresh(problem: FittingProblem, explanations: Explanations, pairs: Sequence[Request]) -> Explanations:
    """The pairs that fit better from starts over the parameters of both than from one of the two alone, where the best
    set leaves something for that to matter."""
    best = min(explanations.values(), key=lambda entry: entry.best.cost)
    if left_smooth(best) < _LEFT:
        return {}
    known = problem.lines.mechanisms
    requests = [
        Request(pair.names, begin=None if any(known[name].moves_contact_points for name in pair.names) else best.point)
        for pair in pairs
    ]
    better: Explanations = {}
    for request, found in zip(requests, problem.explain(requests, best.best.cost), strict=True):
        if found is not None and was_stuck(explanations.get(frozenset(request.names)), found):
            better[frozenset(request.names)] = found
    return better


def left_smooth(explanation: Explanation) -> float:
    """Nats that a smooth error brings an explanation of curves over the least one and rougher noise: what it leaves."""
    fitter = Fitter([explanation.best.hypothesis])
    at = fitter.evaluate(fitter.at(explanation.point), slopes=False)
    points = at.points[np.zeros(len(_ROUGHER), dtype=np.intp)]
    covariance = points.covariance.copy()
    covariance[:, LEVEL] += np.log(_ROUGHER)
    covariance[:, SMOOTH] = explanation.best.hypothesis.covariance[SMOOTH].low
    without = fitter.evaluate(replace(points, covariance=covariance), slopes=False)
    return float(without.cost.min() - at.cost[0])
