"""Findings on stated times of recordings and places of sensors, which are used all the same, and on prepared curves.

They are the same on import and in a diagnosis. The clock only decides whether a recording lies further in the future
than time zones differ; no statement holds today's date, so a campaign keeps its findings on later days.
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
    """Impossible times, overlapping sensors, and the corrections of curves."""
    return [*_times(campaign), *overlapping_sensors(campaign), *prepared(campaign).findings]


def at_reading(campaign: Campaign) -> list[Finding]:
    """`implausible`, with slips of units of curves and of the dynamic force of all FRFs."""
    frfs = [recording for recording in campaign.recordings if isinstance(recording, FrfRecording)]
    return [*implausible(campaign), *curve_course.implausible(prepared(campaign).campaign), *loose_sphere(frfs)]


def loose_sphere(recordings: Sequence[FrfRecording]) -> list[Finding]:
    """A dynamic force that reaches the preload in all recordings, so that the sphere would lose contact."""
    if not recordings or any(recording.dynamic_force_n < recording.preload_n for recording in recordings):
        return []
    return [Finding(Reason.DYNAMIC_FORCE_LARGE, "", "dynamic_force_n")]


def _times(campaign: Campaign) -> Iterator[Finding]:
    """The first recording in the future, and the first from before such instruments existed."""
    latest = datetime.now(UTC) + _ZONES
    stated = [
        (recording.id, recording.recorded_at) for recording in campaign.recordings if recording.recorded_at is not None
    ]
    to_come = [stamp for stamp in stated if moment(stamp[1]) > latest]
    too_old = [stamp for stamp in stated if moment(stamp[1]) < _EARLIEST]
    limit = {"year": _EARLIEST.year}
    for reason, matching, bounds in ((Reason.TIME_TO_COME, to_come, {}), (Reason.TIME_TOO_OLD, too_old, limit)):
        if matching:
            (recording_id, written), *others = matching
            yield Finding(reason, recording_id, "recorded_at", {"written": written, "more": len(others), **bounds})


def moment(written: str) -> datetime:
    """A stated time, in UTC where it has no zone."""
    moment = datetime.fromisoformat(written)
    return moment if moment.tzinfo else moment.replace(tzinfo=UTC)


def overlapping_sensors(campaign: Campaign) -> list[Finding]:
    """Sensors at one place, or else the nearest two where they are nearer than their radius allows."""
    positions: dict[tuple[float, float], list[str]] = {}
    for sensor in campaign.skin.sensors:
        positions.setdefault((sensor.x_mm, sensor.y_mm), []).append(sensor.id)
    shared = [(position, ids) for position, ids in positions.items() if len(ids) > 1]
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
        "sensors": [campaign.skin.sensors[index].id for index in pair],
        "radius_mm": radius,
        "pitch_mm": pitch,
        "in_metres": in_metres,
    }
    return [Finding(Reason.SENSORS_TOO_NEAR, "", "skin.sensor_radius_mm", arguments)]


def pitch_mm(campaign: Campaign) -> float | None:
    """The least distance between two sensors [mm]; None for fewer than two."""
    nearest = nearest_pair(campaign.skin.sensors)
    return None if nearest is None else nearest[0]


def nearest_pair(sensors: Sequence[Sensor]) -> tuple[float, int, int] | None:
    """The least distance between two sensors [mm], and their indices; None for fewer than two."""
    if len(sensors) < 2:
        return None
    positions: Floats = np.array([(sensor.x_mm, sensor.y_mm) for sensor in sensors])
    distances, neighbours = (np.asarray(column) for column in KDTree(positions).query(positions, k=2))
    first = int(np.argmin(distances[:, 1]))
    if not np.isfinite(distances[first, 1]):
        return None
    second = next(int(index) for index in neighbours[first] if index != first)  # of two at one place either comes first
    return float(distances[first, 1]), min(first, second), max(first, second)
