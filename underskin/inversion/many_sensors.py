"""Many sensors in a few numbers: their median, the range of most of them, and which stand apart."""

from dataclasses import dataclass

import numpy as np

from underskin.units import Floats

MOST_NAMED = 12  # sensors that a figure draws and names one by one
_MIDDLE = (0.05, 0.95)  # quantiles between which most lie
_ROBUST = 1.4826  # standard deviations of a normal distribution in its median absolute deviation
_APART = 4.5  # deviations about the median; by chance one lies so far off in 4 % of arrays of 13, 0.6 % of 60


@dataclass(frozen=True)
class ManySensors:
    """`median`, and `low` and `high` between which 90 % lie, in the unit of the values; `apart`: the places of those
    that stand apart, the furthest first."""

    median: float
    low: float
    high: float
    apart: tuple[int, ...]


def many_sensors(values: Floats, uncertainties: Floats) -> ManySensors:
    """Of values (sensors,), one at least, with their standard uncertainties, in the same unit.

    One stands apart where it lies more than 4.5 standard deviations off the median: of the sensors', by the median
    absolute deviation, which those apart do not widen, or of its own, whichever is larger.
    """
    median = float(np.median(values))
    off = np.abs(values - median)
    deviation = np.maximum(_ROBUST * np.median(off), uncertainties)
    far = np.flatnonzero(off > _APART * deviation)
    low, high = np.quantile(values, _MIDDLE)
    return ManySensors(median, float(low), float(high), tuple(far[np.argsort(-off[far], kind="stable")].tolist()))
