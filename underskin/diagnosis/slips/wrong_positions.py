"""Positions of contacts that contradict their sensors': given in m or µm where sensors are in mm.

A position p is in another unit where f·p, with f = 1000 or 1/1000, lies nearer to its sensor: the density of contacts
falls with the distance squared, as every distance is as likely as ten times as much. At a sensor in the origin this
cannot be detected, and has little effect.
"""

from collections.abc import Iterator

import numpy as np

from underskin.diagnosis.slips.levels import Alternative
from underskin.diagnosis.slips.table import GAIN, Screened
from underskin.diagnosis.slips.wrong_units import MOST_SHARE
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.units import Floats, Mask

_POSITIONS = (
    # factor, least distance from the sensor [mm], unit of the positions, or of the sensors
    (1e3, 1.0, "m", "µm"),
    (1e-3, 200.0, "µm", "m"),
)
_AT_SENSORS_MM = (1e-4, 0.01)  # implausible distances from a sensor: no stage is that precise


def wrong_positions(screened: Screened) -> Iterator[Alternative]:
    """The recordings whose position is off by a factor of 1000."""
    for reason, off, nats, arguments in _positions(screened):
        if reason is Reason.PLACE and off.any():
            ids = [screened.recordings[index].id for index in np.flatnonzero(off).tolist()]
            findings = [Finding(reason, name, "position_mm", arguments) for name in ids]
            yield Alternative(0.0, float(nats[off].sum()), undo=screened.without(off, *findings))


def all_positions(screened: Screened) -> list[Finding]:
    """The finding on the unit of all positions where those of many are off by a factor of 1000."""
    shared = [(reason, arguments) for reason, _, _, arguments in _positions(screened) if reason is Reason.PLACES]
    return [Finding(reason, "", "position_mm", arguments) for reason, arguments in shared]


def _positions(screened: Screened) -> Iterator[tuple[Reason, Mask, Floats, dict[str, object]]]:
    """For each wrong unit the recordings that it explains, with the gain of ln evidence."""
    sensor_mm, contact_mm = _sensors_and_contacts(screened)
    for factor, least, unit, sensors_unit in _POSITIONS:
        given, meant = (np.hypot(*(scale * contact_mm - sensor_mm).T) for scale in (1.0, factor))
        with np.errstate(divide="ignore"):
            nats = 2 * np.log(np.maximum(given, 1e-12) / np.maximum(meant, 1e-12))
        off = (given > least) & (nats > GAIN)
        slip = {"too_small": factor > 1, "given_in": unit}
        if off.sum() > MOST_SHARE * len(off):
            yield Reason.PLACES, off, nats, {**slip, "sensors_in": sensors_unit}
        else:
            yield Reason.PLACE, off, nats, slip


def at_sensors(screened: Screened) -> list[Finding]:
    """Positions that differ from their sensors' by some µm at most: an offset series in m."""
    sensor_mm, contact_mm = _sensors_and_contacts(screened)
    farthest = float(np.hypot(*(contact_mm - sensor_mm).T).max())
    if not _AT_SENSORS_MM[0] < farthest < _AT_SENSORS_MM[1]:
        return []
    return [Finding(Reason.PLACES_AT_SENSORS, "", "position_mm", {"farthest_mm": farthest})]


def _sensors_and_contacts(screened: Screened) -> tuple[Floats, Floats]:
    """Positions of each recording's sensor and contact [mm], (recordings, 2) each."""
    sensors = [screened.positions[recording.sensor] for recording in screened.recordings]
    contacts = [recording.position_mm or here for recording, here in zip(screened.recordings, sensors, strict=True)]
    return np.reshape(sensors, (-1, 2)), np.reshape(contacts, (-1, 2))
