"""Recordings whose level is 2 or √2 times the others', or 1/2 or 1/√2: peak-to-peak or rms given for peak.

Which recordings are off, a ∈ {0, 1}ⁿ, is sought for each factor c so that y − a ln c is best explained by the model of
levels, each recording in turn taken for what it is nearer to. k of n such choices cost ln C(n, k).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import comb, log

import numpy as np

from underskin.diagnosis.screening.levels import Levels, follows_an_axis
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.units import Floats, Mask

_FACTORS = (2.0, 0.5, 2.0**0.5, 0.5**0.5)
_CONVENTION = {True: "peak-to-peak", False: "rms"}
_LEAST = 6
_GAIN, _GAIN_UNSURE, _COST = 7.5, 14.0, 1.0  # of ln evidence, where a chance is likelier, and per ln of choices
_WELL, _APART = 0.7, 0.85  # of the recordings lie within a third of ln c of their level: at least, and of levels apart
_MOST, _FEW, _MANY = 0.5, 0.1, 12  # the first two of the recordings
_EXACT, _EXACT_WITHIN = 3.0, 0.01  # standard deviations, and what is to spare: else the factor is another
# Where a law along an axis may be at work as well: twice is no law, and √2 is a chance unless it is sharp.
_PLAIN_SIZE, _PLAIN_WITHIN, _SHARP_WITHIN = 0.5, 0.06, 0.02  # of ln c
_SEARCHED_SCATTER, _SEARCHED_SMOOTH_SIZES = (0.04, 0.12), (0.15, 1.0)


@dataclass(frozen=True)
class Step:
    """A factor, the recordings that have it, by how much ln evidence gains on its cost, and the share of all recordings
    that lie within a third of its logarithm of their level."""

    factor: float
    off: Mask
    gain: float
    near: float


def amplitude_step(levels: Levels) -> Step | None:
    """The plainest such factor among the recordings, None where none is plain."""
    if len(levels.value) < _LEAST:
        return None
    base = levels.fit(levels.value).evidence
    steps = [step for step in (_step(levels, factor, base) for factor in _FACTORS) if step is not None]
    plain = [step for step in steps if step.gain > _least_gain(step)]
    return max(plain, key=lambda step: step.gain, default=None)


def _least_gain(step: Step) -> float:
    """A few of many recordings that are √2 off may have missed their place.

    One recording may be off by chance. Two levels of which one is half the other may be one where they overlap: presses
    that miss their place only lower the level, and halves of such a skewed distribution fit better than the whole.
    """
    if len(step.off) > _MANY and step.off.mean() < _FEW and abs(log(step.factor)) < _PLAIN_SIZE:
        return np.inf
    skewed = log(step.factor) < -_PLAIN_SIZE and step.near <= _APART
    return _GAIN_UNSURE if skewed or step.off.sum() == 1 else _GAIN


def without_step(recordings: Sequence[FrfRecording], levels: Levels, step: Step) -> tuple[list[FrfRecording], Finding]:
    """The recordings with the factor taken out, those without a level left out, and the finding on it."""
    off = levels.number[step.off].tolist()
    arguments = {
        "factor": step.factor,
        "meant": _CONVENTION[abs(log(step.factor)) > 0.5],
        "of": [recordings[number].id for number in off],
        "recordings": len(recordings),
        "left_out": len(recordings) - len(levels.number),
    }
    right = [
        _times(recordings[number], 1 / step.factor) if number in off else recordings[number]
        for number in levels.number.tolist()
    ]
    return right, Finding(Reason.AMPLITUDE_FACTOR, "", "dynamic_force_n", arguments)


def _step(levels: Levels, factor: float, base: float) -> Step | None:
    """The recordings that are off by a factor; None where there are none, or most, or the factor is another."""
    size = log(factor)
    steps: list[Step] = []
    for scatter, smooth_size in product(_SEARCHED_SCATTER, _SEARCHED_SMOOTH_SIZES):
        off = _chosen(levels.value, levels.precision(scatter, smooth_size), size)
        if not off.any() or any((off == step.off).all() for step in steps):
            continue
        value = levels.value - size * off
        fit = levels.fit(value)
        error, deviation = fit.amplitude(value, off.astype(float))
        exact = abs(error) < _EXACT * deviation + _EXACT_WITHIN
        if exact and follows_an_axis(off, levels.axes):
            within = _PLAIN_WITHIN if abs(size) > _PLAIN_SIZE else _SHARP_WITHIN
            exact = abs(error) + deviation < within
        near = float((np.abs(fit.residual(value)) < 0.35 * abs(size)).mean())
        if exact and near > _WELL:
            cost = _COST * log(comb(len(off), int(off.sum())))
            steps.append(Step(factor, off, fit.evidence - base - cost, near))
    return max(steps, key=lambda step: step.gain, default=None)


def _chosen(value: Floats, precision: Floats, size: float) -> Mask:
    """a that makes (y − a ln c)ᵀ C⁻¹ (y − a ln c) small, one recording after the other; of a and 1 − a the smaller."""
    off: Mask = np.zeros(len(value), dtype=bool)
    for _ in range(3 * len(value)):
        pull = precision @ (value - size * off)
        gain = np.where(off, -2.0, 2.0) * size * pull - size**2 * np.diag(precision)
        best = int(np.argmax(gain))
        if gain[best] <= 0:
            break
        off[best] = not off[best]
    return ~off if off.mean() > _MOST else off


def _times(recording: FrfRecording, factor: float) -> FrfRecording:
    assert recording.frf_re_pc_per_n is not None
    assert recording.frf_im_pc_per_n is not None
    real, imaginary = factor * recording.frf_re_pc_per_n, factor * recording.frf_im_pc_per_n
    return replace(recording, frf_re_pc_per_n=real, frf_im_pc_per_n=imaginary)
