"""Summary of many sensors: their median, the range of 90 %, and outliers."""

from dataclasses import dataclass

import numpy as np

from underskin.units import Floats

MOST_NAMED = 12  # sensors that a figure draws and names one by one
_MIDDLE = (0.05, 0.95)  # quantiles of the range
ROBUST = 1.4826  # standard deviation over median absolute deviation of a normal distribution
_APART = 4.5  # standard deviations about the median; by chance exceeded in 4 % of arrays of 13, 0.6 % of 60


@dataclass(frozen=True)
class ManySensors:
    """`median`, and `low` and `high` between which 90 % lie, in the unit of the values; `apart`: the indices of the
    outliers, the furthest first."""

    median: float
    low: float
    high: float
    apart: tuple[int, ...]


def many_sensors(values: Floats, uncertainties: Floats) -> ManySensors:
    """The summary of at least one value (sensors,) with standard uncertainties (sensors,), in the same unit.

    An outlier lies more than 4.5 standard deviations from the median: that of the sensors by the median absolute
    deviation, or its own standard uncertainty, whichever is larger.
    """
    median = float(np.median(values))
    distance = np.abs(values - median)
    deviation = np.maximum(ROBUST * np.median(distance), uncertainties)
    outliers = np.flatnonzero(distance > _APART * deviation)
    low, high = np.quantile(values, _MIDDLE)
    return ManySensors(
        median, float(low), float(high), tuple(outliers[np.argsort(-distance[outliers], kind="stable")].tolist())
    )
