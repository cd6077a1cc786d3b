"""Recordings so far off their sensor's others that something went wrong with them: a slip of units, a wrong range.

One of these would rule the array's d33, whose mixed model takes recordings to be log-normal about their sensor's.
Anything that a skin may really do is kept: what all sensors do under a condition, the scatter that the array shows, and
what a misplaced sphere makes of a recording beside the centre.
"""

import numpy as np
from numpy.typing import NDArray

from underskin.inversion.sensor_flags import typical_size
from underskin.units import Floats

_FAR = 8.0  # deviations
_LEAST_DEVIATION = 0.1  # of the array's d33: only recordings that are off by 80 % or more are looked at
_ENOUGH = 3  # recordings for a sensor, sensors for a condition, to have a median that one of them does not rule


def strays(
    sensor: NDArray[np.intp], condition: NDArray[np.intp], d33: Floats, noise: Floats, position: Floats
) -> NDArray[np.bool_]:
    """Which recordings lie beyond 8 robust deviations of their sensor's d33, as its condition changes all sensors'.

    `position` is each recording's relative deviation if the sphere is misplaced as far as spheres are. A sensor all of
    whose recordings are off is no matter of recordings: none of its is named.
    """
    array = typical_size(d33)
    own = _over_usual(sensor, d33, array)
    rest = own - _common(sensor, condition, own)
    scatter = 1.4826 * float(np.median(np.abs(rest)))
    expected = np.hypot(np.hypot(_LEAST_DEVIATION, position), noise / array)
    far: NDArray[np.bool_] = np.abs(rest) > _FAR * np.maximum(scatter, expected)
    for number in np.unique(sensor[far]):
        if far[sensor == number].all():
            far[sensor == number] = False
    return far


def _over_usual(sensor: NDArray[np.intp], d33: Floats, array: float) -> Floats:
    """Each recording over what is usual with its sensor, or with the array where the sensor has few recordings.

    A dead sensor's recordings are 1 + their distance from its own, in units of the array's.
    """
    over = d33 / array
    for number in np.unique(sensor):
        same = sensor == number
        if same.sum() >= _ENOUGH:
            middle = float(np.median(d33[same]))
            over[same] = 1 + (d33[same] - middle) / (middle if abs(middle) > _LEAST_DEVIATION * array else array)
    return over


def _common(sensor: NDArray[np.intp], condition: NDArray[np.intp], own: Floats) -> Floats:
    """What the condition of each recording makes of all sensors'; their overall median where few saw it."""
    common = np.full(len(own), float(np.median(own)))
    for number in np.unique(condition):
        alike = condition == number
        if len(np.unique(sensor[alike])) >= _ENOUGH:
            common[alike] = np.median(own[alike])
    return common
