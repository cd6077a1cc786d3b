"""How coarse an array may be so that it still tells two equal loads apart at a distance.

The criterion is that of `underskin.prediction.skin_design`: the responses of two contacts add, and they show as two
where a sensor between two others reads less than both, by `dip` times the reading above a sensor, wherever the row of
sensors lies and from that distance on. `largest_pitch` evaluates it on few placements and distances, to search many
designs; `separation` on all of them.

The pitch cannot exceed half the distance: where the middle between the contacts lies midway between two sensors, each
of these is then nearer to its contact than the sensor beyond it and reads more, so that nothing dips.
"""

import numpy as np

from underskin.units import Floats, Mask

_PLACEMENTS = 7  # over half a pitch: the other half is its mirror image
_DISTANCES = 16
_FULL_PLACEMENTS, _FULL_DISTANCES, _FINEST = 13, 160, 25.0  # as `resolution` has them
_PARTS = 8  # in which those distances are looked at
_STEPS = 7  # of a bisection


def largest_pitch(offset: Floats, response: Floats, distance: float, finest: float, dip: float) -> float:
    """The largest pitch [m], from `finest` on, at which two contacts are told apart from `distance` [m] on; NaN where
    they are not even at `finest`.

    Parameters
    ----------
    offset, response
        (n,) distance of a contact from the sensor's centre [m], from 0 on, and the response there [-].
    dip
        Over the response above a sensor [-].
    """
    if finest > distance / 2 or not _told_apart(offset, response, finest, distance, dip):
        return float("nan")
    low, high = finest, distance / 2
    for _ in range(_STEPS):
        middle = (low + high) / 2
        if _told_apart(offset, response, middle, distance, dip):
            low = middle
        else:
            high = middle
    return low


def _told_apart(offset: Floats, response: Floats, pitch: float, distance: float, dip: float) -> bool:
    """Whether two contacts show as two at this and at every larger distance, for every placement of the row."""
    width = 2 * float(offset[int(np.argmax(response < response[0] / 2))])
    farthest = distance + 2 * pitch + 2 * width  # beyond it each contact is seen on its own, again and again
    distances = np.linspace(distance, farthest, _DISTANCES)
    return bool(_seen(offset, response, pitch, distances, _PLACEMENTS, dip).all())


def separation(offset: Floats, response: Floats, pitch: float, nearest: float, dip: float) -> float:
    """The two-point separation [m] of `underskin.prediction.skin_design.resolution`, from as many distances and
    placements, without what else that calculates; NaN where two contacts are not told apart everywhere.

    Parameters
    ----------
    nearest
        Smallest distance of two contacts [m].
    """
    last = int(np.argmax(response < response[0] / 2))
    pair = [last, last - 1]
    width = 2 * float(np.interp(float(response[0]) / 2, response[pair], offset[pair]))
    spacing = max(pitch, width / _FINEST)
    distances = np.linspace(nearest, nearest + 4 * spacing + 3 * width, _FULL_DISTANCES)
    least = float("nan")
    for some in np.array_split(distances, _PARTS)[::-1]:  # the farthest first: below a missed one nothing matters
        missed = np.flatnonzero(~_seen(offset, response, spacing, some, _FULL_PLACEMENTS, dip))
        if missed.size:
            return float([*some, least][missed[-1] + 1])
        least = float(some[0])
    return least


def _seen(offset: Floats, response: Floats, pitch: float, distances: Floats, placements: int, dip: float) -> Mask:
    """At which distances two contacts show as two for every placement of the row."""
    count = int(np.ceil(distances[-1] / 2 / pitch)) + 2
    half = distances[:, None, None] / 2
    sensors = pitch * np.arange(-count, count + 1) + pitch * np.linspace(0, 0.5, placements)[:, None]
    first, second = (np.interp(np.abs(sensors + side), offset, response, right=0.0) for side in (-half, half))
    reading = first + second
    from_left = np.maximum.accumulate(reading, axis=2)[:, :, :-2]
    from_right = np.maximum.accumulate(reading[:, :, ::-1], axis=2)[:, :, ::-1][:, :, 2:]
    depth = np.minimum(from_left, from_right) - reading[:, :, 1:-1]
    return np.asarray((depth.max(axis=2) >= dip * response[0]).all(axis=1))
