"""The largest pitch of an array that still separates two equal loads at a distance.

The criterion is that of `underskin.prediction.skin_design`: the responses of two contacts add, and they show as two if
a sensor between two others reads less than both, by `dip` times the reading above a sensor, for every position of the
row of sensors and from that distance on. It is evaluated on fewer placements and distances, in order to search many
designs.

The pitch cannot exceed half the distance: if the middle between the contacts lies midway between two sensors, each of
these is nearer to its contact than the sensor beyond it and reads more, so that there is no dip.
"""

import numpy as np

from underskin.prediction.skin_design import are_resolved
from underskin.units import Floats

_PLACEMENTS = 7  # over half a pitch: the other half is its mirror image
_DISTANCES = 16
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
    if finest > distance / 2 or not _are_resolved(offset, response, finest, distance, dip):
        return float("nan")
    low, high = finest, distance / 2
    for _ in range(_STEPS):
        middle = (low + high) / 2
        if _are_resolved(offset, response, middle, distance, dip):
            low = middle
        else:
            high = middle
    return low


def _are_resolved(offset: Floats, response: Floats, pitch: float, distance: float, dip: float) -> bool:
    """Whether two contacts show as two at this and every larger distance, for every placement of the row."""
    width = 2 * float(offset[int(np.argmax(response < response[0] / 2))])
    farthest = distance + 2 * pitch + 2 * width  # beyond it each contact is seen on its own, again and again
    distances = np.linspace(distance, farthest, _DISTANCES)
    return bool(are_resolved(offset, response, pitch, distances, _PLACEMENTS, dip).all())
