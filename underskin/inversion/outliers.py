"""Recordings that are far off the others of their sensor: a slip of units, or a wrong range of an instrument.

One of them would dominate the array's d33, since the mixed model takes recordings to be log-normal about their sensor's
d33. What a skin may really do is no outlier: an effect of a condition on all sensors, the scatter that the array shows,
and the effect of a misplaced sphere on a recording beside the centre.
"""

import numpy as np

from underskin.inversion.sensor_flags import typical_size
from underskin.units import Floats, Indices, Mask

_FAR = 8.0  # deviations
_LEAST_DEVIATION = 0.1  # of the array's d33: only recordings that are off by 80 % or more are looked at
_ENOUGH = 3  # recordings for a sensor, sensors for a condition, to have a median that one of them does not rule


def outlying(sensor: Indices, condition: Indices, d33: Floats, noise: Floats, position: Floats) -> Mask:
    """Which recordings lie more than 8 robust deviations from their sensor's d33, less the effect of their condition.

    Where all recordings of a sensor are, the sensor is off and none of its recordings is an outlier.

    Parameters
    ----------
    sensor, condition : (recordings,) arrays of int
        The number of each recording's sensor, and of its condition (indenter and preload).
    d33, noise : (recordings,) arrays
        d33 of each recording and its standard uncertainty by line noise [C/N].
    position : (recordings,) array
        Relative deviation of each recording where the sphere is misplaced as far as spheres are.

    Returns
    -------
    (recordings,) array of bool
    """
    array = typical_size(d33)
    own = _over_usual(sensor, d33, array)
    rest = own - _common(sensor, condition, own)
    scatter = 1.4826 * float(np.median(np.abs(rest)))
    expected = np.hypot(np.hypot(_LEAST_DEVIATION, position), noise / array)
    far: Mask = np.abs(rest) > _FAR * np.maximum(scatter, expected)
    for number in np.unique(sensor[far]):
        if far[sensor == number].all():
            far[sensor == number] = False
    return far


def _over_usual(sensor: Indices, d33: Floats, array: float) -> Floats:
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


def _common(sensor: Indices, condition: Indices, own: Floats) -> Floats:
    """What the condition of each recording makes of all sensors'; their overall median where few saw it."""
    common = np.full(len(own), float(np.median(own)))
    for number in np.unique(condition):
        alike = condition == number
        if len(np.unique(sensor[alike])) >= _ENOUGH:
            common[alike] = np.median(own[alike])
    return common
