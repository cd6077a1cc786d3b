"""One sensor whose level differs from that of all others, which agree: its own d33 or cable, not the physics.

A separate gain for that sensor must explain the levels far better than any spread of all sensors, and than anything
smooth along an axis. Where several sensors differ, the mechanism `sensor_spread` applies.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp, log

import numpy as np

from underskin.diagnosis.slips.levels import LevelFit, Levels, smooth_along
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording

_LEAST_SENSORS = 4
_LEAST = 0.14  # of |ln gain|
_AMPLITUDE = 0.4  # prior standard deviation of ln gain
_GAIN, _OVER_RIVALS = 1.7, 1.5  # of ln evidence, after its cost, and over other explanations
_COST = 2.0  # per ln of the number of sensors: one for the choice, and one for an outlier by chance


@dataclass(frozen=True)
class OutlyingSensor:
    """The sensor, the logarithm of its gain over the others', and the gain of ln evidence after its cost."""

    sensor: int
    amplitude: float
    gain: float


def outlying_sensor(levels: Levels) -> OutlyingSensor | None:
    """The sensor whose gain differs most from the others', None where none is significant."""
    sensors = np.unique(levels.sensor).tolist()
    if len(sensors) < _LEAST_SENSORS:
        return None
    base = levels.fit(levels.value)
    outlier = max(sensors, key=lambda sensor: _plainness(base, levels, sensor))
    column = (levels.sensor == outlier).astype(float)
    fit = levels.fit(levels.value, _AMPLITUDE * column[:, None])
    gain = fit.evidence - base.evidence - _COST * log(len(sensors))
    if gain < _GAIN:
        return None
    amplitude, _ = fit.amplitude(levels.value, column)
    if abs(amplitude) < _LEAST:
        return None
    rivals = [levels.fit(levels.value, smooth_along(axis)).evidence for axis in levels.axes]
    return (
        OutlyingSensor(outlier, amplitude, gain) if fit.evidence > max(rivals, default=-np.inf) + _OVER_RIVALS else None
    )


def without_sensor_gain(
    recordings: Sequence[FrfRecording], levels: Levels, outlier: OutlyingSensor
) -> tuple[list[FrfRecording], Finding]:
    """The recordings with the sensor's gain removed, and the finding."""
    first = int(levels.index[levels.sensor == outlier.sensor][0])
    name = recordings[first].sensor
    scaled = [
        _times(recording, exp(-outlier.amplitude)) if recording.sensor == name else recording
        for recording in recordings
    ]
    arguments = {
        "sensor": name,
        "share": exp(outlier.amplitude),
        "recordings": sum(recording.sensor == name for recording in recordings),
    }
    reason = Reason.SENSOR_WEAKER if outlier.amplitude < 0 else Reason.SENSOR_STRONGER
    return scaled, Finding(reason, "", "frf_re_pc_per_n", arguments)


def _plainness(base: LevelFit, levels: Levels, sensor: int) -> float:
    amplitude, deviation = base.amplitude(levels.value, (levels.sensor == sensor).astype(float))
    return abs(amplitude) / deviation


def _times(recording: FrfRecording, factor: float) -> FrfRecording:
    assert recording.frf_re_pc_per_n is not None
    assert recording.frf_im_pc_per_n is not None
    real, imaginary = factor * recording.frf_re_pc_per_n, factor * recording.frf_im_pc_per_n
    return replace(recording, frf_re_pc_per_n=real, frf_im_pc_per_n=imaginary)
