"""Whether the times of curves add information to their displacements; else no law of time can be identified."""

from collections.abc import Sequence

import numpy as np

from underskin.recordings.campaign import CurveConditions

_TURNED_BACK = 0.02  # of the span
_UNEVEN = 0.1  # of the duration
_LIKE_SPEEDS = 1.5


def time_runs_with_displacement(recordings: Sequence[CurveConditions]) -> bool:
    """True where all curves move in one direction at the same constant speed; recordings without time_s are ignored."""
    speeds = []
    for recording in recordings:
        if recording.time_s is None:
            continue
        moved = np.abs(recording.displacement_mm - recording.displacement_mm[0])
        elapsed = recording.time_s - recording.time_s[0]
        span, duration = float(moved.max()), float(elapsed[-1])
        if span <= 0 or duration <= 0:
            return False
        turned = float((np.maximum.accumulate(moved) - moved).max())
        uneven = float(np.abs(moved / span - elapsed / duration).max())
        if turned > _TURNED_BACK * span or uneven > _UNEVEN:
            return False
        speeds.append(span / duration)
    return bool(speeds) and max(speeds) < _LIKE_SPEEDS * min(speeds)
