"""Explanations that only the widths of their priors tell apart, and what is done about it.

The evidence of a set is how well it fits at best, times how usual the values are that it needs, times Occam's factor:
the share of its priors' range that fits. The first is what the recordings say, the second what is known of materials
and rigs. The third compares ranges that were chosen for this catalogue; between "nothing" and a mechanism, or one
mechanism and two, it is what keeps freedom from being free, but where one law at its best does here what another of
the same number of mechanisms does, it would decide between them by no more than how wide each range happens to be.

So no explanation is held to be less probable than the leading one, of as many mechanisms, by Occam's factor alone: its
odds are at least e^(s − s_leader), at most 1, with s = log L + Σ log(prior/prior at its peak) at the best fit. Which of
two leads whose evidences differ by less than these are good for, s decides.
"""

from collections.abc import Sequence

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation, own_places
from underskin.units import Floats

_BEHIND = 1e-6  # of an equal: the leader stays the leader
_ACCURACY = 0.1  # of Laplace's method, in nats


def fit_and_plausibility(explanation: Explanation) -> float:
    """s: the log posterior density at the best fit, were each own parameter's prior 1 at its peak."""
    places = own_places(explanation.names, explanation.best.fitter.hypothesis.lines)
    own = [entry for place in places.values() for entry in explanation.model.parameters[place]]
    return -explanation.best.at.cost - sum(entry.log_prior(entry.start) for entry in own)


def without_occam(explanations: Sequence[Explanation], log_weights: Sequence[float]) -> Floats:
    """The weights, those of the leader's equals in size raised to what fit and plausibility say of them."""
    weights = np.array(log_weights)
    first = _leader(explanations, weights)
    leader = explanations[first]
    weights[first] = weights.max()
    for number, rival in enumerate(explanations):
        if rival.names and len(rival.names) == len(leader.names) and number != first:
            gap = fit_and_plausibility(rival) - fit_and_plausibility(leader)
            raised = max(weights[number], weights[first] + gap)
            weights[number] = min(raised, weights[first] - _BEHIND)
    return weights


def _leader(explanations: Sequence[Explanation], weights: Floats) -> int:
    """The place of the one of largest weight, or among its equals in weight and size of the best fit."""
    first = int(np.argmax(weights))
    equals = [
        number
        for number in np.flatnonzero(weights > weights[first] - _ACCURACY).tolist()
        if explanations[number].names and len(explanations[number].names) == len(explanations[first].names)
    ]
    return max(equals, key=lambda number: fit_and_plausibility(explanations[number]), default=first)
