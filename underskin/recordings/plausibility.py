"""Findings on the times of recordings and the places of sensors that a campaign states, which are used all the same,
and on what is changed of its curves before anything is read from them (curve_preparation).

They are the same with the d33 of a campaign, on its import and in its diagnosis. The clock is only used to see whether
a recording lies in the future by more than time zones differ. No statement holds today's date, so that a campaign whose
times have passed has the same findings on every later day.
"""

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime, timedelta

import numpy as np
from scipy.spatial import KDTree

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings import curve_course
from underskin.recordings.campaign import Campaign, FrfRecording, Sensor
from underskin.recordings.curve_preparation import prepared
from underskin.units import Floats

_EARLIEST = datetime(1990, 1, 1, tzinfo=UTC)  # clocks that were never set begin in 1904, 1970 or 1980
_ZONES = timedelta(days=1)  # a time without a zone is taken as UTC
_IN_METRES = 1000.0
_LARGEST_IN_METRES_MM = 0.1


def implausible(campaign: Campaign) -> list[Finding]:
    """Times that no recording has, sensors that would lie in each other, and what is put right of curves."""
    return [*_times(campaign), *overlapping_sensors(campaign), *prepared(campaign).findings]


def at_reading(campaign: Campaign) -> list[Finding]:
    """The same, with slips of units that a diagnosis would find: in curves, and in the dynamic force of all FRFs."""
    frfs = [entry for entry in campaign.recordings if isinstance(entry, FrfRecording)]
    return [*implausible(campaign), *curve_course.implausible(campaign), *loose_sphere(frfs)]


def loose_sphere(entries: Sequence[FrfRecording]) -> list[Finding]:
    """A dynamic force that reaches the preload in all recordings, so that the sphere would leave the skin."""
    if not entries or any(entry.dynamic_force_n < entry.preload_n for entry in entries):
        return []
    return [Finding(Reason.DYNAMIC_FORCE_LARGE, "", "dynamic_force_n")]


def _times(campaign: Campaign) -> Iterator[Finding]:
    """The first recording that is still to come, and the first from before there were such instruments."""
    latest = datetime.now(UTC) + _ZONES
    stated = [(entry.id, entry.recorded_at) for entry in campaign.recordings if entry.recorded_at is not None]
    to_come = [entry for entry in stated if _moment(entry[1]) > latest]
    too_old = [entry for entry in stated if _moment(entry[1]) < _EARLIEST]
    limit = {"year": _EARLIEST.year}
    for reason, wrong, bounds in ((Reason.TIME_TO_COME, to_come, {}), (Reason.TIME_TOO_OLD, too_old, limit)):
        if wrong:
            (recording, written), *others = wrong
            yield Finding(reason, recording, "recorded_at", {"written": written, "more": len(others), **bounds})


def _moment(written: str) -> datetime:
    moment = datetime.fromisoformat(written)
    return moment if moment.tzinfo else moment.replace(tzinfo=UTC)


def overlapping_sensors(campaign: Campaign) -> list[Finding]:
    """Sensors at one place, or else the nearest two where they are nearer to each other than their radius allows."""
    places: dict[tuple[float, float], list[str]] = {}
    for sensor in campaign.skin.sensors:
        places.setdefault((sensor.x_mm, sensor.y_mm), []).append(sensor.id)
    shared = [(place, ids) for place, ids in places.items() if len(ids) > 1]
    if shared:
        ((x, y), ids), *others = shared
        arguments = {"sensors": ids, "x_mm": x, "y_mm": y, "more": len(others)}
        return [Finding(Reason.SENSORS_AT_ONE_PLACE, "", "skin.sensors", arguments)]
    radius, nearest = campaign.skin.sensor_radius_mm, nearest_pair(campaign.skin.sensors)
    if radius is None or nearest is None or nearest[0] >= 2 * radius:
        return []
    pitch, *pair = nearest
    in_metres = _IN_METRES * pitch >= 2 * radius and pitch < _LARGEST_IN_METRES_MM
    arguments = {
        "sensors": [campaign.skin.sensors[number].id for number in pair],
        "radius_mm": radius,
        "pitch_mm": pitch,
        "in_metres": in_metres,
    }
    return [Finding(Reason.SENSORS_TOO_NEAR, "", "skin.sensor_radius_mm", arguments)]


def pitch_mm(campaign: Campaign) -> float | None:
    """The distance of the two sensors that lie nearest to each other; None of fewer than two."""
    nearest = nearest_pair(campaign.skin.sensors)
    return None if nearest is None else nearest[0]


def nearest_pair(sensors: Sequence[Sensor]) -> tuple[float, int, int] | None:
    """The least distance between two sensors [mm], and the numbers of these two; None of fewer than two."""
    if len(sensors) < 2:
        return None
    places: Floats = np.array([(sensor.x_mm, sensor.y_mm) for sensor in sensors])
    distances, neighbours = (np.asarray(column) for column in KDTree(places).query(places, k=2))
    one = int(np.argmin(distances[:, 1]))
    if not np.isfinite(distances[one, 1]):
        return None
    other = next(int(number) for number in neighbours[one] if number != one)  # of two at one place either comes first
    return float(distances[one, 1]), min(one, other), max(one, other)
