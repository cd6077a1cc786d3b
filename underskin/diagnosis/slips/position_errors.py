"""Positions of contacts that contradict their sensors': given in m or µm where sensors are in mm.

A position p has a wrong unit where f·p, with f = 1000 or 1/1000, lies far nearer to its sensor than p does. At a sensor
in the origin this cannot be detected, and has little effect.
"""

from collections.abc import Sequence

import numpy as np

from underskin.diagnosis.slips.unit_errors import MOST_SHARE
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.units import Floats, Mask

_UNIT_FACTORS = (
    # factor, least distance from the sensor [mm], unit of the positions, or of the sensors
    (1e3, 1.0, "m", "µm"),
    (1e-3, 200.0, "µm", "m"),
)
_NEARER = 5.0  # times: a contact is seldom farther from its sensor than the sensors are apart
_AT_SENSORS_MM = (1e-4, 0.01)  # implausible distances from a sensor: no stage is that precise


def misplaced(campaign: Campaign, recordings: Sequence[FrfRecording]) -> tuple[Mask, list[Finding], list[Finding]]:
    """Which recordings' positions are off by a factor of 1000, the findings on them, and the findings where many are.

    The mask holds the single ones only.
    """
    sensor_mm, contact_mm = _sensors_and_contacts(campaign, recordings)
    mask = np.zeros(len(recordings), dtype=bool)
    single, shared = [], []
    for factor, least, unit, sensors_unit in _UNIT_FACTORS:
        given, meant = (np.hypot(*(scale * contact_mm - sensor_mm).T) for scale in (1.0, factor))
        off = (given > least) & (_NEARER * meant < given)
        slip = {"too_small": factor > 1, "given_in": unit}
        if off.sum() > MOST_SHARE * len(recordings):
            shared.append(Finding(Reason.PLACES, "", "position_mm", {**slip, "sensors_in": sensors_unit}))
            continue
        single += [
            Finding(Reason.PLACE, recordings[index].id, "position_mm", slip) for index in np.flatnonzero(off).tolist()
        ]
        mask |= off
    return mask, single, shared


def at_sensors(campaign: Campaign, recordings: Sequence[FrfRecording]) -> list[Finding]:
    """Positions that differ from their sensors' by some µm at most: an offset series in m."""
    sensor_mm, contact_mm = _sensors_and_contacts(campaign, recordings)
    farthest = float(np.hypot(*(contact_mm - sensor_mm).T).max())
    if not _AT_SENSORS_MM[0] < farthest < _AT_SENSORS_MM[1]:
        return []
    return [Finding(Reason.PLACES_AT_SENSORS, "", "position_mm", {"farthest_mm": farthest})]


def _sensors_and_contacts(campaign: Campaign, recordings: Sequence[FrfRecording]) -> tuple[Floats, Floats]:
    """Positions of each recording's sensor and contact [mm], (recordings, 2) each."""
    positions = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
    sensor_mm: Floats = np.array([positions[recording.sensor] for recording in recordings]).reshape(-1, 2)
    contact_mm: Floats = np.array(
        [recording.position_mm or positions[recording.sensor] for recording in recordings]
    ).reshape(-1, 2)
    return sensor_mm, contact_mm
