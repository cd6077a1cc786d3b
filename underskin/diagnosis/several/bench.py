"""The scatter of gains and positions of skins of one make, which are recorded on one bench: what a skin's sisters say.

A few recordings determine neither, nor many whether positions scatter at all. Where gain scatter is underestimated
intervals are too narrow; where positions scatter and none is assumed, or the reverse, all d33 are off to one side.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import expit, logit

from underskin.diagnosis.inference.objective import GAIN
from underskin.diagnosis.noise.noise_priors import Plateau
from underskin.diagnosis.several.course import Candidate
from underskin.recordings.usual_scatter import NO_POSITION_SCATTER

_FROM_SKIN_TO_SKIN = 0.2  # deviation of the logarithm of the gain scatter on one bench
_UNSURE = 0.02  # the least probability that positions do, or do not, scatter


@dataclass(frozen=True)
class Bench:
    """The prior of the gain scatter's logarithm, and the probability that positions scatter."""

    gain: Plateau
    placed: float


def benches(candidates: Sequence[Candidate]) -> list[Bench]:
    """Of each skin, by what its sisters say, one at least."""
    leaders = [one.search.shown_or_nothing(one.search.answers[0]) for one in candidates]
    said = np.array([one.point.covariance[GAIN] for one in leaders])
    recordings = np.array([one.best.hypothesis.lines.recordings for one in leaders])
    precision = 1 / (_FROM_SKIN_TO_SKIN**2 + 0.5 / np.maximum(recordings - 1, 1))
    usual = logit(1 - NO_POSITION_SCATTER)
    gained = logit(np.clip([one.placed for one in leaders], _UNSURE, 1 - _UNSURE)) - usual
    found = []
    for number in range(len(candidates)):
        sisters = np.arange(len(candidates)) != number
        own = np.where(sisters, precision, 0.0)
        deviation = float(np.hypot(_FROM_SKIN_TO_SKIN, own.sum() ** -0.5))
        placed = float(np.clip(expit(usual + gained[sisters].sum()), _UNSURE, 1 - _UNSURE))
        found.append(Bench(Plateau.normal(float(own @ said / own.sum()), deviation), placed))
    return found
