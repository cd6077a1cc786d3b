"""One sensor whose level differs from that of all others: its own d33 or cable, or a fault, not the physics.

A weak sensor, ln gain ~ N(−2, 0.7), is left out; one that merely differs, ln gain ~ N(0, 0.45), is corrected, given
enough others that agree. Two groups of sensors that are alike within (`two_groups`) are taken to the level of the
larger one, and which is right stays open. Where several sensors differ otherwise, the mechanism `sensor_spread`
applies.
"""

from collections.abc import Iterator
from functools import partial
from math import exp, log

import numpy as np

from underskin.diagnosis.slips.levels import CHANGE, LEAST_CHANGE, LEAST_LEVELS, Alternative, Levels, Undone
from underskin.diagnosis.slips.table import Screened, of_levels
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.inversion.sensor_groups import two_groups

_WEAK, _WEAK_SPREAD = -2.0, 0.7  # prior of ln gain of a weak sensor: a third to a thirtieth


@of_levels
def sensor_gains(screened: Screened, levels: Levels) -> Iterator[Alternative]:
    """Each sensor as a weak one, and as one that differs."""
    sensors = np.unique(levels.sensor).tolist()
    for sensor in sensors if len(sensors) > 1 else ():
        of_sensor = (levels.sensor == sensor).astype(float)
        name = screened.campaign.skin.sensors[sensor].id
        offset, column = _WEAK * of_sensor, _WEAK_SPREAD * of_sensor
        undo = partial(_without_sensor, screened=screened, name=name)
        yield Alternative(-log(len(sensors)), offset=offset, column=column, undo=undo)
        if len(sensors) >= LEAST_LEVELS:
            without_gain = partial(_without_gain, screened=screened, name=name)
            yield Alternative(-2 * log(len(sensors)), column=CHANGE * of_sensor, undo=without_gain)


@of_levels
def groups_of(screened: Screened, levels: Levels) -> Iterator[Alternative]:
    """The sensors as two groups, the factor between them being the known change."""
    sensors, of_recording = np.unique(levels.sensor, return_inverse=True)
    medians = [float(np.median(levels.value[of_recording == index])) for index in range(len(sensors))]
    groups = two_groups(np.exp(medians), np.zeros(len(sensors)))
    if groups is not None:  # those of the smaller group are taken to the level of the larger, the lower of equal ones
        names = [screened.campaign.skin.sensors[sensor].id for sensor in sensors.tolist()]
        offset = np.where(np.isin(of_recording, groups.higher), log(groups.factor), 0.0)
        lower, higher = ([names[index] for index in part] for part in (groups.lower, groups.higher))
        changed, factor = (lower, groups.factor) if len(lower) < len(higher) else (higher, 1 / groups.factor)
        is_changed = np.isin([recording.sensor for recording in screened.recordings], changed)
        arguments = {"lower": lower, "higher": higher, "factor": groups.factor}
        finding = Finding(Reason.TWO_GROUPS, "", "charge_pc", arguments)
        undone = screened.scaled(np.where(is_changed, factor, 1.0), finding)
        yield Alternative(-log(len(sensors)), offset=offset, undo=undone)


def _without_sensor(amplitude: float, *, screened: Screened, name: str) -> Undone:
    """The recordings of the other sensors."""
    off = screened.of_sensor(name)
    arguments = {"sensor": name, "share": exp(_WEAK + _WEAK_SPREAD * amplitude), "recordings": int(off.sum())}
    return screened.without(off, Finding(Reason.WEAK_SENSOR, "", "frf_re_pc_per_n", arguments))


def _without_gain(amplitude: float, *, screened: Screened, name: str) -> Undone | None:
    """The recordings with the sensor's gain removed."""
    gain, of_sensor = CHANGE * amplitude, screened.of_sensor(name)
    if abs(gain) < LEAST_CHANGE:
        return None
    arguments = {"sensor": name, "share": exp(gain), "recordings": int(of_sensor.sum())}
    reason = Reason.SENSOR_WEAKER if gain < 0 else Reason.SENSOR_STRONGER
    return screened.scaled(np.where(of_sensor, exp(-gain), 1.0), Finding(reason, "", "frf_re_pc_per_n", arguments))
