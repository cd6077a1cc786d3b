"""The gain scatter of skins of one make, which are recorded on one bench: what a skin's sisters say of its own."""

from collections.abc import Sequence

import numpy as np

from underskin.diagnosis.inference.objective import GAIN
from underskin.diagnosis.noise.noise_priors import Plateau
from underskin.diagnosis.several.course import Candidate

_FROM_SKIN_TO_SKIN = 0.2  # deviation of the logarithm of the gain scatter on one bench


def gain_priors(candidates: Sequence[Candidate]) -> list[Plateau]:
    """Of each skin the prior of the gain scatter's logarithm, by what at least one sister says.

    A few recordings do not determine it, and where it is underestimated all intervals are too narrow.
    """
    leaders = [one.search.shown_or_nothing(one.search.answers[0]).best for one in candidates]
    said = np.array([one.point.covariance[GAIN] for one in leaders])
    recordings = np.array([one.hypothesis.lines.recordings for one in leaders])
    precision = 1 / (_FROM_SKIN_TO_SKIN**2 + 0.5 / np.maximum(recordings - 1, 1))
    priors = []
    for number in range(len(candidates)):
        sisters = np.where(np.arange(len(candidates)) == number, 0.0, precision)
        deviation = float(np.hypot(_FROM_SKIN_TO_SKIN, sisters.sum() ** -0.5))
        priors.append(Plateau.normal(float(sisters @ said / sisters.sum()), deviation))
    return priors
