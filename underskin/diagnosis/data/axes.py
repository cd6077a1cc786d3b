"""The campaign's axes as numbers: what each recording was made at, on a scale where like distances mean alike."""

from datetime import UTC, datetime

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


def recording_axes(campaign: Campaign) -> dict[str, Floats]:
    """Of each axis on which the recordings differ, one row a recording (recordings, 1 or 2).

    `position_mm` is the contact's place seen from the sensor's centre, `sensor` the sensor's own place on the skin
    [mm], `recorded_at` is in hours from the first. An axis that a recording lacks is left out.
    """
    entries = campaign.recordings
    columns_by_axis: dict[str, Floats] = {}
    for name in (*_LOGARITHMIC, *_FROM_ZERO):
        values = [getattr(entry, name, None) for entry in entries]
        if None in values:
            continue
        column = np.array(values, dtype=float)
        columns_by_axis[name] = (np.log(column) if name in _LOGARITHMIC else np.log1p(column))[:, None]
    frf = [entry for entry in entries if isinstance(entry, FrfRecording)]
    if frf:
        columns_by_axis["position_mm"] = 1e3 * offsets(campaign)
        centres = {sensor.id: (sensor.x_mm, sensor.y_mm) for sensor in campaign.skin.sensors}
        columns_by_axis["sensor"] = np.array([centres[entry.sensor] for entry in frf])
    times = [entry.recorded_at for entry in entries]
    if None not in times:
        columns_by_axis["recorded_at"] = hours(times)[:, None]
    return {name: column for name, column in columns_by_axis.items() if np.ptp(column, axis=0).max() > 1e-9}


def hours(times: list[str | None]) -> Floats:
    """Hours since the first of these times (ISO 8601; UTC where they do not say)."""
    read = [datetime.fromisoformat(str(time).replace("Z", "+00:00")) for time in times]
    known = [time if time.tzinfo else time.replace(tzinfo=UTC) for time in read]
    since = np.array([(time - known[0]).total_seconds() for time in known])
    return (since - since.min()) / 3600
