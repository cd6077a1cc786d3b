"""Two groups of sensors that are alike within and a factor apart, as by two ranges of an amplifier or two units: which
of them is right shows in no recording."""

from dataclasses import dataclass

import numpy as np

from underskin.units import Floats, Indices

LEAST_SPREAD = 0.03  # of d33, below which sensors are not distinguished
# Quotients of ranges in steps of 1, 2, 5 or 1, 2.5, 5 or 1, 3 or 1, 4, and of units
_RANGES = (2.0, 2.5, 3.0, 4.0, 5.0, 10.0, 1000.0)
_MOST = 20.0  # times: beyond it the lower ones are dead, unless the factor is one of these
_APART = 5.0  # deviations within the groups, as of an outlying sensor
_LEAST_FACTOR = 1 / 0.6  # as of a strong sensor
_LEAST_SHARE = 0.25  # of the sensors: fewer are faults of their own
_AGREES = 2.0  # standard errors of the factor


@dataclass(frozen=True)
class TwoGroups:
    """The sensors' indices in the `lower` and the `higher` group, and the factor between their geometric means."""

    lower: Indices
    higher: Indices
    factor: float


def two_groups(level: Floats, noise: Floats) -> TwoGroups | None:
    """The groups on both sides of the largest gap of ln level, if one holds half of four sensors or more, or if the
    factor is that of two ranges.

    Parameters
    ----------
    level, noise : (sensors,) arrays
        The magnitude of each sensor's d33, above 0, and its standard uncertainty, in one unit.

    Returns
    -------
    TwoGroups or None
        None also where the gap is not far beyond the scatter within the groups.
    """
    count, order = len(level), np.argsort(level, kind="stable")
    if count < 2:
        return None
    x = np.log(level)
    first = int(np.argmax(np.diff(x[order]))) + 1
    lower, higher = np.sort(order[:first]), np.sort(order[first:])
    within = np.concatenate([x[group] - x[group].mean() for group in (lower, higher)])
    scatter = float(np.sqrt((within**2).sum() / max(count - 2, 1)))
    scatter = max(scatter, LEAST_SPREAD, float(np.median(noise / level)))
    log_factor, fewer = float(x[higher].mean() - x[lower].mean()), min(first, count - first)
    gap = float(x[higher].min() - x[lower].max())
    if gap < _APART * scatter or log_factor < np.log(_LEAST_FACTOR) or fewer < _LEAST_SHARE * count:
        return None
    error = scatter * np.sqrt(1 / first + 1 / (count - first))
    is_half = 2 * fewer == count > 2 and log_factor < np.log(_MOST)
    of_ranges = bool((np.abs(log_factor - np.log(_RANGES)) <= _AGREES * error).any())
    return TwoGroups(lower, higher, float(np.exp(log_factor))) if of_ranges or is_half else None
