"""The priors over sets of mechanisms, and what a mechanism must bring to be named.

Within a size, every set of mechanisms that the campaign supports is equally probable.
"""

import math

from underskin.diagnosis.data.names import NONE_OF_THESE
from underskin.diagnosis.inference.explanation import Explanation

# "Nothing" stands for all that does not show as well, which is every other campaign.
PRIORS = {"nothing_missing": 0.6, "one": 0.252, "two": 0.1, "three": 0.012, "four": 0.001, "none_of_these": 0.035}
LARGEST = 4  # mechanisms in a set; four only where several kinds of recordings ask for them
UNSEEN_ODDS = 1.5  # that one more mechanism is there than shows, in what it may do to d33; on the virtual rig about 1.4
SHOWS = 0.7  # nats of evidence that each mechanism of a set must bring
_SHOWS_ON_CURVES = 5.0  # the same where neighbouring samples may share what no noise model knows


def least_evidence(explanation: Explanation) -> float:
    """Nats of evidence that a mechanism, or a process, must bring on recordings of this kind."""
    return _SHOWS_ON_CURVES if explanation.best.hypothesis.lines.curves else SHOWS


def log_prior(size: int, supported: int) -> float:
    """The logarithm of the prior of one set of that many mechanisms."""
    share = PRIORS[("nothing_missing", "one", "two", "three", "four")[size]]
    return math.log(share) - math.log(math.comb(supported, size))


def log_prior_beneath(size: int, supported: int) -> float:
    """The logarithm of the prior of something undescribed on top of one set: a mechanism like any other."""
    if size == 0:
        return math.log(PRIORS[NONE_OF_THESE])
    return log_prior(size, supported) + math.log(PRIORS[NONE_OF_THESE] * PRIORS["two"] / PRIORS["one"])
