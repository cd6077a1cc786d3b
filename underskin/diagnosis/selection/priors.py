"""The priors over sets of mechanisms, and what a mechanism must bring to be named.

Within a size, every set of mechanisms that the campaign supports is equally probable.
"""

import math

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.data.names import NONE_OF_THESE
from underskin.diagnosis.inference.explanation import Explanation

# "Nothing" stands for all that does not show as well, which is every other campaign.
PRIORS = {"nothing_missing": 0.6, "one": 0.252, "two": 0.1, "three": 0.012, "four": 0.001, "none_of_these": 0.035}
LARGEST = 4  # mechanisms in a set; four only where several kinds of recordings ask for them
UNSEEN_ODDS = 1.5  # that one more mechanism is there than shows, in what it may do to d33; on the virtual rig about 1.4
SHOWS = 0.7  # nats of evidence that each mechanism of a set must bring
_SHOWS_ON_CURVES = 5.0  # the same where neighbouring samples may share what no noise model knows
_DECLARED, _DECLARED_SHOWS = 0.5, 3.0  # prior of a law that follows from declared facts, and nats by which it shows


def least_evidence(explanation: Explanation) -> float:
    """Nats of evidence that a mechanism or an unlisted law must bring on recordings of this kind."""
    return _SHOWS_ON_CURVES if explanation.best.hypothesis.lines.curves else SHOWS


def declared_laws(lines: Lines) -> frozenset[str]:
    """The mechanisms that follow from declared facts: no guesses, with equal prior odds inside every hypothesis."""
    return frozenset(
        name
        for name, mechanism in lines.mechanisms.named.items()
        if lines.kind in mechanism.kinds and mechanism.follows_from_declared(lines.campaign, lines.kind)
    )


def guesses(explanation: Explanation) -> int:
    """How many mechanisms of a set do not follow from declared facts."""
    return len(set(explanation.names) - declared_laws(explanation.best.hypothesis.lines))


def log_prior_of(explanation: Explanation, supported: int) -> float:
    """The logarithm of the prior of a set among so many mechanisms that the campaign supports."""
    declared = declared_laws(explanation.best.hypothesis.lines)
    return log_prior(guesses(explanation), supported - len(declared)) + len(declared) * math.log(_DECLARED)


def log_prior_beneath_of(explanation: Explanation, supported: int, laws: int = 0) -> float:
    """The same of something undescribed on top of a set, of which so many `laws` are not listed."""
    declared = declared_laws(explanation.best.hypothesis.lines)
    size = guesses(explanation) - laws
    return log_prior_beneath(size, supported - len(declared)) + len(declared) * math.log(_DECLARED)


def must_gain(explanation: Explanation, name: str) -> float:
    """Nats of evidence that a mechanism of a set must bring to be named in it."""
    if name in declared_laws(explanation.best.hypothesis.lines):
        return _DECLARED_SHOWS
    return least_evidence(explanation)


def log_prior(size: int, supported: int) -> float:
    """The logarithm of the prior of one set of that many mechanisms."""
    share = PRIORS[("nothing_missing", "one", "two", "three", "four")[size]]
    return math.log(share) - math.log(math.comb(supported, size))


def log_prior_beneath(size: int, supported: int) -> float:
    """The logarithm of the prior of something undescribed on top of one set: a mechanism like any other."""
    if size == 0:
        return math.log(PRIORS[NONE_OF_THESE])
    return log_prior(size, supported) + math.log(PRIORS[NONE_OF_THESE] * PRIORS["two"] / PRIORS["one"])
