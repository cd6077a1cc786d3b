"""Odds between explanations that differ only in the widths of their priors.

The evidence of a set of mechanisms is the product of the likelihood at the best fit, the prior density of the values
there, and Occam's factor: the share of the prior's range that fits. The likelihood is what the recordings say, the
density what is known of materials and rigs. Occam's factor penalises extra parameters, and is needed where the null
hypothesis is compared with a mechanism, or one mechanism with two. Between sets of equally many mechanisms that fit
equally well, however, it would decide by the widths that were chosen for this catalogue.

So among sets of as many mechanisms as the leading one, none is less probable than that by Occam's factor alone: its
odds are at least e^(s − s_leader), at most 1, with s = log L + Σ log(prior/prior at its peak) at the best fit. Where
the evidences of two candidates for the lead differ by less than their accuracy, s decides.
"""

from collections.abc import Sequence

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.inference.hypothesis import own_places
from underskin.units import Floats

_BEHIND = 1e-6  # of an equal: the leader stays the leader
_ACCURACY = 0.1  # of Laplace's method, in nats


def fit_and_plausibility(explanation: Explanation) -> float:
    """s: the log posterior density at the best fit, were each own parameter's prior 1 at its peak."""
    places = own_places(explanation.names, explanation.best.hypothesis.lines)
    own = [entry for place in places.values() for entry in explanation.model.parameters[place]]
    return -explanation.best.cost - sum(entry.log_prior(entry.start) for entry in own)


def without_occam(explanations: Sequence[Explanation], log_weights: Sequence[float], sizes: Sequence[int]) -> Floats:
    """The weights, those of the leader's equals in size raised to what fit and plausibility say of them; `sizes` count
    the mechanisms that are guesses."""
    weights = np.array(log_weights)
    first = _leader(explanations, weights, sizes)
    leader = explanations[first]
    weights[first] = weights.max()
    for number, rival in enumerate(explanations):
        if sizes[number] and sizes[number] == sizes[first] and number != first:
            gap = fit_and_plausibility(rival) - fit_and_plausibility(leader)
            raised = max(weights[number], weights[first] + gap)
            weights[number] = min(raised, weights[first] - _BEHIND)
    return weights


def _leader(explanations: Sequence[Explanation], weights: Floats, sizes: Sequence[int]) -> int:
    """The place of the one of largest weight, or among its equals in weight and size of the best fit."""
    first = int(np.argmax(weights))
    equals = [
        number
        for number in np.flatnonzero(weights > weights[first] - _ACCURACY).tolist()
        if sizes[number] and sizes[number] == sizes[first]
    ]
    return max(equals, key=lambda number: fit_and_plausibility(explanations[number]), default=first)
