"""The campaign's axes as numbers: what each recording was made at, on a scale where like distances mean alike."""

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np

from underskin.recordings.campaign import Campaign, FrfRecording
from underskin.recordings.conditions import offsets
from underskin.units import Floats

_LOGARITHMIC = ("preload_n", "indenter_radius_mm", "dynamic_force_n")
WORDS = {  # of each axis: what it is called, and its unit
    "preload_n": ("preload", "N"),
    "indenter_radius_mm": ("radius of the sphere", "mm"),
    "sensor": ("sensor", ""),
    "position_mm": ("distance from the sensor's centre", "mm"),
    "dwell_s": ("time under preload", "s"),
    "load_cycles": ("load cycles", ""),
    "dynamic_force_n": ("dynamic force", "N"),
    "recorded_at": ("day", ""),
    "frequency_hz": ("frequency", "Hz"),
    "phase": ("phase", ""),
    "displacement_mm": ("displacement", "mm"),
}
_FROM_ZERO = ("load_cycles", "dwell_s")  # log(1 + x)
_SAME = 0.01  # on a logarithmic scale: values within a percent were meant to be one


def recording_axes(campaign: Campaign) -> dict[str, Floats]:
    """Of each axis on which the recordings differ, one row a recording (recordings, 1 or 2).

    `position_mm` is the contact's place seen from the sensor's centre, `sensor` the sensor's own place on the skin
    [mm], `recorded_at` is in hours from the first. An axis that a recording lacks is left out, and one on which all
    agree, on a logarithmic scale within a percent.
    """
    entries = campaign.recordings
    columns_by_axis: dict[str, Floats] = {}
    for name in (*_LOGARITHMIC, *_FROM_ZERO):
        values: list[Any] = [getattr(entry, name, None) for entry in entries]
        if None in values:
            continue
        if not agree(name, values):
            columns_by_axis[name] = _scaled(name, values)[:, None]
    frf = [entry for entry in entries if isinstance(entry, FrfRecording)]
    if frf:
        columns_by_axis["position_mm"] = 1e3 * offsets(campaign)
        centres = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
        columns_by_axis["sensor"] = np.array([centres[entry.sensor] for entry in frf])
    times = [entry.recorded_at for entry in entries]
    if None not in times:
        columns_by_axis["recorded_at"] = hours(times)[:, None]
    return {name: column for name, column in columns_by_axis.items() if np.ptp(column, axis=0).max() > 1e-9}


def agree(name: str, values: Sequence[float | None]) -> bool:
    """Whether values on an axis of a logarithmic scale were meant to be one: they lie within a percent, or none is
    known."""
    known = [value for value in values if value is not None]
    return len(known) in (0, len(values)) and (not known or float(np.ptp(_scaled(name, known))) <= _SAME)


def _scaled(name: str, values: Sequence[float]) -> Floats:
    column = np.array(values, dtype=float)
    return np.asarray(np.log(column) if name in _LOGARITHMIC else np.log1p(column))


def hours(times: list[str | None]) -> Floats:
    """Hours since the first of these times (ISO 8601; UTC where they do not say)."""
    read = [datetime.fromisoformat(str(time).replace("Z", "+00:00")) for time in times]
    known = [time if time.tzinfo else time.replace(tzinfo=UTC) for time in read]
    since = np.array([(time - known[0]).total_seconds() for time in known])
    return (since - since.min()) / 3600
