"""Recordings whose level is off by 2, √2, 1/2 or 1/√2: peak-to-peak or rms given for peak amplitudes.

For each factor c the set a ∈ {0, 1}ⁿ of affected recordings is chosen so that the model of levels (`levels`) best
explains y − a ln c. Choosing k of n recordings costs ln C(n, k) of evidence, or ln of the number of steps along an axis
where a is one of these. Rivals are any other factor of the same recordings, and the most similar step along an axis, as
by a law.
"""

from collections.abc import Iterator, Sequence
from itertools import product
from math import comb, log

import numpy as np

from underskin.diagnosis.slips.levels import CHANGE, SEARCHED, SELDOM, Alternative, Levels, Undone
from underskin.diagnosis.slips.table import Screened, of_levels
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.units import Floats, Indices, Mask

_FACTORS = {2.0: "peak-to-peak", 0.5: "peak-to-peak", 2.0**0.5: "rms", 0.5**0.5: "rms"}
_LOG_PRIOR = -log(75)  # over that of a warm-up: settings seldom change in a campaign, and there are four factors
_LEAST_SHARE = 0.1  # of the recordings that are off; fewer may have missed their place
_WELL, _APART = 0.7, 0.85  # share of recordings within a third of ln c of their level: at least; in separate levels
_SKEWED = 6.5  # of ln prior: misses of the place lower levels by up to half, which two parts fit better than one


@of_levels
def amplitude_factors(screened: Screened, levels: Levels) -> Iterator[Alternative]:
    """Each factor with the sets of recordings that may have it, and the rivals."""
    for factor, (scatter, smooth_size) in product(_FACTORS, SEARCHED):
        precision = levels.precision(scatter, smooth_size)
        off = _chosen(levels.value, precision, log(factor))
        offset = np.where(off, log(factor), 0.0)
        residual = precision @ (levels.value - offset) / np.diag(precision)
        near = float((np.abs(residual) < 0.35 * abs(log(factor))).mean())
        if off.mean() < _LEAST_SHARE or near < _WELL:
            continue
        step, steps = _most_similar_step(levels.axes, off)
        choices = log(comb(len(off), int(off.sum())))
        if len(np.unique(step ^ off)) == 1:
            choices = min(choices, log(steps))
        log_prior = _LOG_PRIOR - choices
        if factor == 0.5 and near < _APART:
            log_prior -= _SKEWED
        yield Alternative(log_prior, offset=offset, undo=_without_factor(screened, levels.index, factor, off))
        yield Alternative(log_prior - SELDOM, column=CHANGE * off.astype(float))
        yield Alternative(-log(steps), column=CHANGE * step.astype(float))


def _most_similar_step(axes: Sequence[Floats], off: Mask) -> tuple[Mask, int]:
    """Of the sets of recordings on one side of an axis, or on one level of it, that which differs from `off`, or from
    all others, by the fewest; and the number of sets."""
    sets = [part for axis in axes for level in np.unique(axis) for part in (axis >= level, axis == level)]
    if not sets:
        return np.zeros(len(off), dtype=bool), 1
    mismatches = np.array([(part ^ off).sum() for part in sets])
    return sets[int(np.argmin(np.minimum(mismatches, len(off) - mismatches)))], len(sets)


def _without_factor(screened: Screened, index: Indices, factor: float, off: Mask) -> Undone:
    """The recordings corrected for the factor, without those that have no level and are not in `index`."""
    count = len(screened.recordings)
    arguments = {
        "factor": factor,
        "meant": _FACTORS[factor],
        "of": [screened.recordings[wrong].id for wrong in index[off].tolist()],
        "recordings": count,
        "left_out": count - len(index),
    }
    correction = np.full(count, np.nan)
    correction[index] = np.where(off, 1 / factor, 1.0)
    return screened.scaled(correction, Finding(Reason.AMPLITUDE_FACTOR, "", "dynamic_force_n", arguments))


def _chosen(value: Floats, precision: Floats, size: float) -> Mask:
    """The a that minimises (y − a ln c)ᵀ C⁻¹ (y − a ln c), one recording at a time; of a and 1 − a the smaller."""
    off: Mask = np.zeros(len(value), dtype=bool)
    for _ in range(3 * len(value)):
        pull = precision @ (value - size * off)
        gain = np.where(off, -2.0, 2.0) * size * pull - size**2 * np.diag(precision)
        best = int(np.argmax(gain))
        if gain[best] <= 0:
            break
        off[best] = not off[best]
    return ~off if off.mean() > 0.5 else off
