"""A drift within the first recordings, y_j + A e^(−j/τ) in the order of time j, to the level of all later ones.

A fall that load cycles could have caused is `ageing` and none of this.
"""

from collections.abc import Sequence

import numpy as np

from underskin.diagnosis.screening.levels import Levels
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.units import Floats, Mask

_LEAST = 10
_TIMES = (0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)  # τ, in recordings
_MOST_SHARE = 0.25  # of the recordings: τ is a few of them
_AMPLITUDE = 0.5  # prior standard deviation of A
_GAIN, _OVER_FIRST = 12.0, 2.0  # of ln evidence, and over the first recording alone being off
_ONSETS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5)  # of ageing, over the largest number of cycles
_OVER = 0.01  # of the level: what is left of the drift in recordings that are used


def warm_up(entries: Sequence[FrfRecording], levels: Levels) -> tuple[Mask, list[Finding]]:
    """Which recordings fall into it (entries,), and the finding on it."""
    none: Mask = np.zeros(len(entries), dtype=bool)
    times = [time for time in _TIMES if 2 * time <= _MOST_SHARE * len(levels.value)]
    if len(levels.value) < _LEAST or not times:
        return none, []
    base = levels.evidence(levels.value)
    gains = [levels.evidence(levels.value, _AMPLITUDE * _drift(levels, time)) - base for time in times]
    best = int(np.argmax(gains))
    if gains[best] < _GAIN:
        return none, []
    drift = _drift(levels, times[best])
    amplitude = _amplitude(levels, drift[:, 0])
    first = (levels.order == levels.order.min()).astype(float)[:, None]
    rivals = [levels.evidence(levels.value, _AMPLITUDE * first) - base + _OVER_FIRST]
    if amplitude > 0 and levels.cycles is not None:
        rivals += [levels.evidence(levels.value, _AMPLITUDE * one) - base + 3 for one in _ageing(levels.cycles)]
    if gains[best] < max(rivals):
        return none, []
    last = times[best] * np.log(max(abs(amplitude) / _OVER, 1.0))
    early = levels.order < max(1.0, min(last, _MOST_SHARE * len(entries)))
    out = none.copy()
    out[levels.number[early]] = True
    arguments = {"percent": 100 * float(np.exp(-amplitude) - 1), "recordings": int(out.sum())}
    return out, [Finding(Reason.WARM_UP, "", "recorded_at", arguments)]


def _drift(levels: Levels, time: float) -> Floats:
    return np.asarray(np.exp(-levels.order / time))[:, None]


def _amplitude(levels: Levels, drift: Floats) -> float:
    """A, by least squares of what the smooth functions leave of both."""
    left = levels.residual(drift, 0.03)
    return float(left @ levels.value / (left @ drift))


def _ageing(cycles: Floats) -> list[Floats]:
    return [np.exp(-cycles / (share * cycles.max()))[:, None] for share in _ONSETS] + [
        np.log10(1 + cycles / (share * cycles.max()))[:, None] for share in _ONSETS
    ]
