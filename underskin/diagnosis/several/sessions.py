"""Campaigns of one skin in parts: files that hold a sensor, a press or a preload each are one campaign together.

Two campaigns tell a change over time by the sensors that both record. Parts of one day, or without dates, are put
together where no sensor is recorded twice under the same conditions, or where one of them has too few recordings for a
diagnosis; campaigns of any days where they share no sensor. Parts that state different skins stay apart. They are
joined as `recordings.reading.join` does.
"""

from collections.abc import Callable, Sequence

import numpy as np

from underskin.diagnosis.pipeline import LEAST_RECORDINGS
from underskin.diagnosis.several.sensors import first_date, in_order
from underskin.recordings.campaign import Campaign, FrfRecording, frf_recordings
from underskin.recordings.reading import Reading, join
from underskin.units import Floats

_SAME = 0.1  # relative, of preload and indenter, and of the sensor's radius between places: presses aim at one of them

_LATEST_FIRST = slice(None, None, -1)

_Parts = list[Campaign]


def by_session(campaigns: Sequence[Campaign]) -> list[Campaign]:
    """The campaigns of FRFs in the order of `in_order`, those that are parts of one put together.

    Raises InvalidInput that names the field and two campaigns where parts of one are of different skins.
    """
    ordered = in_order(campaigns)
    days: dict[str | None, list[_Parts]] = {}
    for campaign in ordered:
        days.setdefault(first_date(campaign), []).append([campaign])
    if None in days:  # in any order: by sensor, or by date
        sessions = _put_together([[campaign] for campaign in ordered], _repeat, slice(None))
    else:
        sessions = [session for parts in days.values() for session in _put_together(parts, _repeat, _LATEST_FIRST)]
    return [_joined(parts) for parts in _put_together(sessions, _share_sensor, _LATEST_FIRST)]


def _put_together(groups: Sequence[_Parts], are_apart: Callable[[_Parts, _Parts], bool], order: slice) -> list[_Parts]:
    """The groups, each with the first in this order of those before it that it complements."""
    sessions: list[_Parts] = []
    for group in groups:
        complemented = (
            one
            for one in sessions[order]
            if not _are_of_different_skins(one, group)
            and (not are_apart(one, group) or (_is_too_few(one, group) and not _are_of_different_days(one, group)))
        )
        session = next(complemented, None)
        if session is None:
            sessions.append(list(group))
        else:
            session += group
    return sessions


def _are_of_different_skins(first: _Parts, second: _Parts) -> bool:
    return len({part.skin.id for part in (*first, *second)} - {None}) > 1


def _are_of_different_days(first: _Parts, second: _Parts) -> bool:
    return len({first_date(part) for part in (*first, *second)} - {None}) > 1


def _is_too_few(first: _Parts, second: _Parts) -> bool:
    return min(len(_recordings(parts)) for parts in (first, second)) < LEAST_RECORDINGS


def _recordings(parts: _Parts) -> list[FrfRecording]:
    return [recording for part in parts for recording in frf_recordings(part)]


def _share_sensor(first: _Parts, second: _Parts) -> bool:
    return not {entry.sensor for entry in _recordings(first)}.isdisjoint(entry.sensor for entry in _recordings(second))


def _repeat(first: _Parts, second: _Parts) -> bool:
    """Whether a sensor is recorded in both on different days, or under the same conditions."""
    shared = {entry.sensor for entry in _recordings(first)} & {entry.sensor for entry in _recordings(second)}
    if shared and _are_of_different_days(first, second):
        return True
    for sensor in shared:
        conditions, others = _conditions(first, sensor), _conditions(second, sensor)
        if (np.abs(conditions[:, None] - others) < _SAME).all(axis=2).any():
            return True
    return False


def _conditions(parts: _Parts, sensor: str) -> Floats:
    """ln of indenter radius and preload, and the place in radii of the sensor, of each recording of a sensor."""
    rows = []
    for part in parts:
        centres = {centre.id: (centre.x_mm, centre.y_mm) for centre in part.skin.sensors}
        for entry in frf_recordings(part):
            if entry.sensor == sensor:
                place = np.divide(entry.position_mm or centres[sensor], part.skin.sensor_radius_mm or 1.0)
                rows.append([np.log(entry.indenter_radius_mm), np.log(entry.preload_n), *place])
    return np.array(rows)


def _joined(parts: _Parts) -> Campaign:
    """The parts as one campaign, named after the first."""
    if len(parts) == 1:
        return parts[0]
    name = f"{parts[0].name} and {len(parts) - 1} more"
    files = [(part.name, Reading(part, [], [])) for part in parts]
    return join(name, files, parts[0].skin.id).campaign
