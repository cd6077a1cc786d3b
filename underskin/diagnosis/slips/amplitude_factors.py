"""Recordings whose level is off by 2, √2, 1/2 or 1/√2: peak-to-peak or rms given for peak amplitudes.

For each factor c the set a ∈ {0, 1}ⁿ of affected recordings is chosen so that the model of levels (`levels`) best
explains y − a ln c. Choosing k of n recordings costs ln C(n, k) of evidence.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import comb, log

import numpy as np

from underskin.diagnosis.slips.levels import Levels, follows_an_axis
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.units import Floats, Mask

_FACTORS = (2.0, 0.5, 2.0**0.5, 0.5**0.5)
_CONVENTION = {True: "peak-to-peak", False: "rms"}
_LEAST = 6
_GAIN, _GAIN_UNSURE, _COST = 7.5, 14.0, 1.0  # least gain of ln evidence, the same where chance is likelier; per ln C
_WELL, _APART = 0.7, 0.85  # share of recordings within a third of ln c of their level: at least; for separate levels
_MOST, _FEW, _MANY = 0.5, 0.1, 12  # shares of the recordings, and a number of them
_EXACT, _EXACT_WITHIN = 3.0, 0.01  # standard deviations, and a tolerance, within which the factor must be c
# Where a law along an axis may act as well: no law gives 2, and √2 may be chance unless it is sharp.
_PLAIN_SIZE, _PLAIN_WITHIN, _SHARP_WITHIN = 0.5, 0.06, 0.02  # of ln c
_SEARCHED_SCATTER, _SEARCHED_SMOOTH_SIZES = (0.04, 0.12), (0.15, 1.0)


@dataclass(frozen=True)
class Step:
    """A factor, the recordings that have it, the gain of ln evidence after its cost, and the share of all recordings
    that lie within a third of ln c of their level (`near`)."""

    factor: float
    off: Mask
    gain: float
    near: float


def amplitude_step(levels: Levels) -> Step | None:
    """The factor of largest gain, None where none is significant."""
    if len(levels.value) < _LEAST:
        return None
    base = levels.fit(levels.value).evidence
    steps = [step for step in (_step(levels, factor, base) for factor in _FACTORS) if step is not None]
    plain = [step for step in steps if step.gain > _least_gain(step)]
    return max(plain, key=lambda step: step.gain, default=None)


def _least_gain(step: Step) -> float:
    """The gain of ln evidence that a step must exceed.

    A few of many recordings that are √2 off may be position errors; one recording may be off by chance. Two levels, one
    half the other, may be a single one where they overlap: position errors only lower the level, and two halves of such
    a skewed distribution fit better than the whole.
    """
    if len(step.off) > _MANY and step.off.mean() < _FEW and abs(log(step.factor)) < _PLAIN_SIZE:
        return np.inf
    skewed = log(step.factor) < -_PLAIN_SIZE and step.near <= _APART
    return _GAIN_UNSURE if skewed or step.off.sum() == 1 else _GAIN


def without_step(recordings: Sequence[FrfRecording], levels: Levels, step: Step) -> tuple[list[FrfRecording], Finding]:
    """The recordings corrected for the factor, without those that have no level, and the finding."""
    off = levels.index[step.off].tolist()
    arguments = {
        "factor": step.factor,
        "meant": _CONVENTION[abs(log(step.factor)) > 0.5],
        "of": [recordings[index].id for index in off],
        "recordings": len(recordings),
        "left_out": len(recordings) - len(levels.index),
    }
    right = [
        _times(recordings[index], 1 / step.factor) if index in off else recordings[index]
        for index in levels.index.tolist()
    ]
    return right, Finding(Reason.AMPLITUDE_FACTOR, "", "dynamic_force_n", arguments)


def _step(levels: Levels, factor: float, base: float) -> Step | None:
    """The recordings that are off by a factor; None where there are none or most, or the factor differs from c."""
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
    """The a that minimises (y − a ln c)ᵀ C⁻¹ (y − a ln c), one recording at a time; of a and 1 − a the smaller."""
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
