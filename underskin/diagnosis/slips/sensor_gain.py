"""One sensor whose level differs from that of all others: its own d33 or cable, or a fault, not the physics.

A weak sensor, ln gain ~ N(−2, 0.7), is left out; one that merely differs, ln gain ~ N(0, 0.45), is corrected, given
enough others that agree. Where several sensors differ, the mechanism `sensor_spread` applies.
"""

from collections.abc import Iterator, Sequence
from functools import partial
from math import exp, log

import numpy as np

from underskin.diagnosis.slips.levels import CHANGE, LEAST_CHANGE, LEAST_LEVELS, Alternative, Levels, Undone, times
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording

_WEAK, _WEAK_SPREAD = -2.0, 0.7  # prior of ln gain of a weak sensor: a third to a thirtieth


def sensor_gains(levels: Levels) -> Iterator[Alternative]:
    """Each sensor as a weak one, and as one that differs."""
    sensors = np.unique(levels.sensor).tolist()
    for sensor in sensors if len(sensors) > 1 else ():
        of_sensor = (levels.sensor == sensor).astype(float)
        number = int(levels.index[levels.sensor == sensor][0])
        yield Alternative(
            -log(len(sensors)),
            offset=_WEAK * of_sensor,
            column=_WEAK_SPREAD * of_sensor,
            undo=partial(_without_sensor, number=number),
        )
        if len(sensors) >= LEAST_LEVELS:
            undo = partial(_without_gain, number=number)
            yield Alternative(-2 * log(len(sensors)), column=CHANGE * of_sensor, undo=undo)


def _without_sensor(recordings: Sequence[FrfRecording], amplitude: float, *, number: int) -> Undone:
    """The recordings of the other sensors."""
    name = recordings[number].sensor
    share = exp(_WEAK + _WEAK_SPREAD * amplitude)
    others = [recording for recording in recordings if recording.sensor != name]
    arguments = {"sensor": name, "share": share, "recordings": len(recordings) - len(others)}
    return others, Finding(Reason.WEAK_SENSOR, "", "frf_re_pc_per_n", arguments)


def _without_gain(recordings: Sequence[FrfRecording], amplitude: float, *, number: int) -> Undone | None:
    """The recordings with the sensor's gain removed."""
    name, gain = recordings[number].sensor, CHANGE * amplitude
    if abs(gain) < LEAST_CHANGE:
        return None
    scaled = [times(recording, exp(-gain)) if recording.sensor == name else recording for recording in recordings]
    count = sum(recording.sensor == name for recording in recordings)
    reason = Reason.SENSOR_WEAKER if gain < 0 else Reason.SENSOR_STRONGER
    finding = Finding(reason, "", "frf_re_pc_per_n", {"sensor": name, "share": exp(gain), "recordings": count})
    return scaled, finding
