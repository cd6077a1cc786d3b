"""A drift within the first recordings, y_j + A e^(−j/τ) in the order of time j, towards the level of all later ones.

It is compared with everything else that may change the levels (`levels`). It is rejected where load cycles could have
caused the fall (`ageing`), where a smooth law along any axis explains the levels as well, and where a single first
recording, a step after the first recordings, or a step of one sensor explains them far better.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from underskin.diagnosis.slips.levels import Cause, Levels, explained, smooth_along
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.unlisted.axes import recording_order
from underskin.recordings.campaign import FrfRecording
from underskin.units import Floats

_LEAST = 6
_TIMES = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0)  # τ, in recordings
_LONGEST = 0.3  # largest τ, of the number of recordings
_MOST_SHARE = 0.4  # of the recordings left out at most
_SLOWER = (2.0, 4.0, 8.0)  # times the longest τ: a drift over the whole campaign
_LONGEST_STEP = 6  # recordings at another level than the others, as a step and not a drift
_ONSETS_OF_STEP = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)  # quantiles of the order, for steps of one sensor
_AMPLITUDE = 0.5  # prior standard deviation of A
_GAIN, _LEAST_AMPLITUDE = 3.2, 0.1  # of ln evidence; smaller drifts are within the scatter of gains
# ln evidence by which it must exceed other explanations, less for rarer ones: a drift over the whole campaign, or a
# step after two recordings or more. A single first recording that is off is common.
_OVER_AGEING, _OVER_SMOOTH, _OVER_SLOWER, _OVER_FIRST, _OVER_STEP = 4.5, 1.5, -5.0, -1.5, -8.0
_ONSETS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5)  # of ageing, over the largest number of cycles
_OVER = 0.01  # of the level: largest remaining drift in recordings that are used


@dataclass(frozen=True)
class WarmUp:
    """τ [recordings], amplitude A, and gain of ln evidence."""

    time: float
    amplitude: float
    gain: float


def warming(levels: Levels, causes: Sequence[Cause]) -> WarmUp | None:
    """The drift within the first recordings, None where other causes explain the levels as well."""
    times = [time for time in _TIMES if time <= _LONGEST * len(levels.value)]
    if len(levels.value) < _LEAST or not times:
        return None
    drifts = [np.zeros(len(levels.value)), *(_drift(levels, time) for time in times)]
    posterior = explained(levels, causes, _AMPLITUDE * np.array(drifts)[:, :, None])
    best = int(np.argmax(posterior.evidence[1:]))
    evidence, amplitude = float(posterior.evidence[1 + best]), _AMPLITUDE * float(posterior.coefficient[1 + best, 0])
    gain = evidence - float(posterior.evidence[0])
    if gain < _GAIN or abs(amplitude) < _LEAST_AMPLITUDE:
        return None
    first, *steps = _steps(levels)
    slower = [_drift(levels, times[-1] * longer) for longer in _SLOWER]
    ageing = _ageing(levels.cycles) if amplitude > 0 and levels.cycles is not None else []
    rivals = [
        (first, _OVER_FIRST),
        *((step, _OVER_STEP) for step in steps),
        *((column, _OVER_SLOWER) for column in slower),
    ]
    rivals += [(column, _OVER_AGEING) for column in ageing]
    rivals += _sensor_step(levels)
    columns, over = zip(*rivals, strict=True)
    needed = explained(levels, causes, _AMPLITUDE * np.array(columns)[:, :, None]).evidence + over
    if levels.axes:
        along = np.array([smooth_along(axis) for axis in levels.axes])
        needed = np.append(needed, explained(levels, causes, along).evidence + _OVER_SMOOTH)
    return WarmUp(times[best], amplitude, gain) if evidence > needed.max() else None


def without_first(recordings: Sequence[FrfRecording], warm_up: WarmUp) -> tuple[list[FrfRecording], Finding]:
    """The recordings after the warm-up, and the finding."""
    last = min(warm_up.time * np.log(max(abs(warm_up.amplitude) / _OVER, 1.0)), _MOST_SHARE * len(recordings))
    late = recording_order(recordings) > last
    arguments = {"percent": 100 * float(np.exp(-warm_up.amplitude) - 1), "recordings": int((~late).sum())}
    remaining = [recording for recording, chosen in zip(recordings, late, strict=True) if chosen]
    return remaining, Finding(Reason.WARM_UP, "", "recorded_at", arguments)


def _steps(levels: Levels) -> list[Floats]:
    """Columns that are 1 in the first 1, 2, … recordings."""
    return [(levels.order < last).astype(float) for last in range(1, _LONGEST_STEP + 1)]


def _sensor_step(levels: Levels) -> list[tuple[Floats, float]]:
    """The best step in the later recordings of one sensor, by C⁻¹ without a step, and the ln evidence to subtract since
    the best of many was chosen; empty for a single sensor."""
    if levels.sensor.max() == 0:
        return []
    onsets = np.unique(np.quantile(levels.order, _ONSETS_OF_STEP).round())
    late = levels.order >= onsets[:, None]
    steps = np.concatenate([late & (levels.sensor == sensor) for sensor in np.unique(levels.sensor)]).astype(float)
    weight = levels.fit(levels.value).precision @ steps.T
    size = (steps.T * weight).sum(axis=0)
    gain = (levels.value @ weight) ** 2 / (size + _AMPLITUDE**-2) - np.log1p(_AMPLITUDE**2 * size)
    return [(steps[int(np.argmax(gain))], -float(np.log(len(steps))))]


def _drift(levels: Levels, time: float) -> Floats:
    return np.asarray(np.exp(-levels.order / time))


def _ageing(cycles: Floats) -> list[Floats]:
    onsets = [share * cycles.max() for share in _ONSETS]
    return [*(np.exp(-cycles / onset) for onset in onsets), *(np.log10(1 + cycles / onset) for onset in onsets)]
