"""Sensors that respond with a small share of the others' level in all their recordings: a fault, not a spread.

A sensor is weak where the largest of its levels y lies below the others' median by more than ln 2.9 and by far more
than their scatter. Sensors of one skin differ by tens of percent.
"""

from collections.abc import Sequence

import numpy as np

from underskin.diagnosis.slips.levels import Levels
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.units import Mask

_LEAST_GAP = 1.07
_SCATTERS = 4.0  # robust standard deviations of the others
_MOST = 0.34  # of the sensors at most, or one of two


def weak_sensors(recordings: Sequence[FrfRecording], levels: Levels) -> tuple[Mask, list[Finding]]:
    """Which recordings are of weak sensors (recordings,), and the findings on these."""
    weak: Mask = np.zeros(len(recordings), dtype=bool)
    findings = []
    sensors = np.unique(levels.sensor)
    for sensor in sensors:
        of_sensor = levels.sensor == sensor
        others = levels.value[~of_sensor]
        if len(others) < 2:
            continue
        usual = float(np.median(others))
        scatter = 1.4826 * float(np.median(np.abs(others - usual)))
        gap = usual - levels.value[of_sensor]
        if np.median(gap) < max(_LEAST_GAP, _SCATTERS * scatter) or gap.min() < 0.6 * _LEAST_GAP:
            continue
        name = recordings[levels.index[of_sensor][0]].sensor
        sensor_recordings = np.array([recording.sensor == name for recording in recordings])
        weak |= sensor_recordings
        arguments = {
            "sensor": name,
            "share": float(np.exp(-np.median(gap))),
            "recordings": int(sensor_recordings.sum()),
        }
        findings.append(Finding(Reason.WEAK_SENSOR, "", "frf_re_pc_per_n", arguments))
    if len(findings) > max(1.0, _MOST * len(sensors)):
        return np.zeros(len(recordings), dtype=bool), []
    return weak, findings
