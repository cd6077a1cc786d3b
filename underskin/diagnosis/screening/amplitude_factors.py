"""Recordings whose level is 2 or √2 times the others', or 1/2 or 1/√2: peak-to-peak or rms given for peak.

Which recordings are off, a ∈ {0, 1}ⁿ, is sought for each factor c so that y − a ln c is best explained by the model of
levels, each recording in turn taken for what it is nearer to. k of n such choices cost ln C(n, k).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import comb, log

import numpy as np

from underskin.diagnosis.screening.levels import Levels
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.units import Floats, Mask

_FACTORS = (2.0, 0.5, 2.0**0.5, 0.5**0.5)
_MEANT = {True: "peak-to-peak", False: "rms"}
_LEAST = 6
_GAIN, _COST = 15.0, 1.0  # of ln evidence, and per ln of the number of choices
_WELL = 0.8  # of the recordings at least lie within a quarter of ln c of one of the two levels
_MOST = 0.5


@dataclass(frozen=True)
class _Step:
    """A factor, the recordings that have it, and by how much ln evidence gains on its cost."""

    factor: float
    off: Mask
    gain: float


def without_factors(
    entries: Sequence[FrfRecording], levels: Levels
) -> tuple[list[FrfRecording], list[Finding], Levels]:
    """The recordings with such a factor taken out, the finding on it, and their levels."""
    if len(levels.value) < _LEAST:
        return list(entries), [], levels
    steps = [step for step in (_step(levels, factor) for factor in _FACTORS) if step is not None]
    best = max(steps, key=lambda step: step.gain, default=None)
    if best is None or best.gain < _GAIN:
        return list(entries), [], levels
    off = levels.number[best.off].tolist()
    arguments = {
        "factor": best.factor,
        "meant": _MEANT[abs(log(best.factor)) > 0.5],
        "of": [entries[number].id for number in off],
        "recordings": len(entries),
    }
    right = [_times(entry, 1 / best.factor) if number in off else entry for number, entry in enumerate(entries)]
    finding = Finding(Reason.AMPLITUDE_FACTOR, "", "dynamic_force_n", arguments)
    return right, [finding], replace(levels, value=levels.value - log(best.factor) * best.off)


def _step(levels: Levels, factor: float) -> _Step | None:
    """The recordings that are off by a factor; None where there are none, or most."""
    size = log(factor)
    off = _nearer(levels, size)
    if not off.any() or off.mean() > _MOST:
        return None
    value = levels.value - size * off
    left = np.abs(levels.residual(value, 0.05))
    if (left < 0.25 * abs(size)).mean() < _WELL:
        return None
    choices = log(comb(len(off), int(off.sum())))
    return _Step(factor, off, levels.evidence(value) - levels.evidence(levels.value) - _COST * choices)


def _nearer(levels: Levels, size: float) -> Mask:
    """a, by taking in turn the recordings that gain most, then each for what it is nearer to."""
    off: Mask = np.zeros(len(levels.value), dtype=bool)
    start = levels.residual(levels.value, 0.2)
    off = _two_levels(start, size)
    for _ in range(12):
        left = levels.residual(levels.value - size * off, 0.1) + size * off
        better = left / size > 0.5
        if (better == off).all():
            break
        off = better
    return off


def _two_levels(value: Floats, size: float) -> Mask:
    """Which values are nearer to the second of two levels, `size` apart, that lie nearest to all of them."""
    places = value[:, None] - value[None, :]  # from each value taken as the first level
    misses = np.minimum(np.abs(places), np.abs(places - size))
    first = int(np.argmin(np.minimum(misses, 0.3 * abs(size)).sum(axis=0)))
    return np.asarray(places[:, first] / size > 0.5)


def _times(entry: FrfRecording, factor: float) -> FrfRecording:
    assert entry.frf_re_pc_per_n is not None
    assert entry.frf_im_pc_per_n is not None
    real, imaginary = factor * entry.frf_re_pc_per_n, factor * entry.frf_im_pc_per_n
    return replace(entry, frf_re_pc_per_n=real, frf_im_pc_per_n=imaginary)
