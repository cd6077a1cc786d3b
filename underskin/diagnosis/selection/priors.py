"""Priors over sets of mechanisms, and the evidence that a mechanism needs to be named.

All sets of one size of the mechanisms that the campaign supports are equally probable.
"""

import math
from collections.abc import Callable, Collection

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.data.names import NONE_OF_THESE
from underskin.diagnosis.inference.explanation import Explanation
from underskin.mechanisms.laws.layered_contact import LayeredContact
from underskin.mechanisms.laws.moving_contact_edge import MovingContactEdge

# "Nothing missing" includes all mechanisms that do not show, hence every other campaign.
PRIORS = {"nothing_missing": 0.6, "one": 0.252, "two": 0.1, "three": 0.012, "four": 0.001, "none_of_these": 0.035}
LARGEST = 4  # mechanisms in a set; four only with laws that are no guesses, or required by several kinds
UNSEEN_ODDS = 1.5  # odds of one more mechanism than shows, for its effect on d33; on the virtual rig about 1.4
SHOWS = 0.7  # nats of evidence that each mechanism of a set must bring
_LEAST_ON_CURVES = 5.0  # the same on curves, whose neighbouring samples may share errors outside the noise model
_EVEN_PRIOR = 0.5  # of a law that is no guess
_LEAST_OF_EVEN = 3.0  # nats that such a law must bring to be named


def least_evidence(explanation: Explanation) -> float:
    """Evidence that a mechanism or an unlisted law must bring on recordings of this kind [nats]."""
    return _LEAST_ON_CURVES if explanation.best.hypothesis.lines.curves else SHOWS


def declared_laws(lines: Lines) -> frozenset[str]:
    """The mechanisms without a free parameter that follow from declared facts."""
    layered = lines.mechanisms.named.get(LayeredContact.name)
    if layered is None or lines.kind not in layered.kinds or lines.campaign.skin.thickness_mm is None:
        return frozenset()
    return frozenset() if layered.parameters(lines.campaign, lines.kind) else frozenset({layered.name})


def even_laws(names: Collection[str], lines: Lines) -> frozenset[str]:
    """The mechanisms that are no guesses in a set of these names, with equal prior odds: those that follow from
    declared facts, and in contact with the layer itself an edge that moves with the load, as it does unless held."""
    named, edge = lines.mechanisms.named, MovingContactEdge
    moves = LayeredContact.name in names and lines.kind in edge.kinds and edge.name in named
    return declared_laws(lines) | (frozenset({edge.name}) if moves else frozenset())


def _even_and_guesses(explanation: Explanation) -> tuple[int, int]:
    """How many mechanisms have equal odds in this set, and how many of the set are guesses."""
    even = even_laws(explanation.names, explanation.best.hypothesis.lines)
    return len(even), len(set(explanation.names) - even)


def guess_count(explanation: Explanation) -> int:
    """Number of mechanisms of a set that are guesses."""
    return _even_and_guesses(explanation)[1]


def log_prior_of(explanation: Explanation, supported: int) -> float:
    """Log prior of a set among the `supported` mechanisms of the campaign."""
    return _with_edge(explanation, supported, log_prior)


def log_prior_of_discrepancy(explanation: Explanation, supported: int, laws: int = 0) -> float:
    """Log prior of an undescribed discrepancy on top of a set, which holds `laws` unlisted laws."""
    return _with_edge(explanation, supported, log_prior_beneath, laws)


def _with_edge(explanation: Explanation, supported: int, prior: Callable[[int, int], float], laws: int = 0) -> float:
    """Log prior of a set by the `prior` of so many guesses among so many mechanisms."""
    even, guesses = _even_and_guesses(explanation)
    size = guesses - laws
    free = prior(size, supported - even) + even * math.log(_EVEN_PRIOR)
    if size == LARGEST:
        return free
    held = prior(size + 1, supported - even + 1) + (even - 1) * math.log(_EVEN_PRIOR)
    return free + edge_gain(explanation, held - free)


def edge_gain(explanation: Explanation, log_odds: float) -> float:
    """What the prior of the edge adds to the log evidence of a set with contact with the layer; 0 of others.

    An edge that moves freely is no guess there; that it is held in part is one, of these odds. The evidence is that of
    all mobile fractions alike, the density at 1 times it that of a free edge.
    """
    edge, lines = MovingContactEdge.name, explanation.best.hypothesis.lines
    if edge not in even_laws(explanation.names, lines) & {*explanation.names}:
        return 0.0
    fraction = explanation.spans[edge].start
    return float(np.logaddexp(explanation.best.log_density_at_end(fraction), log_odds))


def must_gain(explanation: Explanation, name: str) -> float:
    """Evidence that a mechanism of a set must bring to be named in it [nats]."""
    if name in even_laws(explanation.names, explanation.best.hypothesis.lines):
        return _LEAST_OF_EVEN
    return least_evidence(explanation)


def log_prior(size: int, supported: int) -> float:
    """Log prior of one set of `size` mechanisms."""
    share = PRIORS[("nothing_missing", "one", "two", "three", "four")[size]]
    return math.log(share) - math.log(math.comb(supported, size))


def log_prior_beneath(size: int, supported: int) -> float:
    """Log prior of an undescribed discrepancy on top of one set: it counts as one more mechanism."""
    if size == 0:
        return math.log(PRIORS[NONE_OF_THESE])
    return log_prior(size, supported) + math.log(PRIORS[NONE_OF_THESE] * PRIORS["two"] / PRIORS["one"])
