"""Which of several values differ beyond chance: from the others, or from zero."""

import numpy as np
from scipy.special import ndtri

from underskin.units import Floats, Mask

BY_CHANCE = 0.05  # probability that of values that are all alike any one is said to differ
_OF_MEDIAN = np.pi / 2  # variance of a median of many over that of their mean


def threshold(count: int) -> float:
    """In standard deviations, for each of `count` values: all together exceed it by chance with 5 % at most."""
    return float(ndtri(1 - BY_CHANCE / (2 * max(count, 1))))


def differ_from_zero(values: Floats, uncertainties: Floats) -> Mask:
    """Of values (n,) with standard uncertainties (n,), in the same unit; False where either is not known."""
    with np.errstate(invalid="ignore"):
        return np.abs(values) > threshold(int(np.isfinite(values).sum())) * uncertainties


def differ_from_others(values: Floats, uncertainties: Floats) -> Mask:
    """Each from the median of all, of two from the other: of values (n,) with standard uncertainties (n,), in the same
    unit; False where either is not known, or where there is no other."""
    known = np.isfinite(values) & np.isfinite(uncertainties)
    count = int(known.sum())
    differs = np.zeros(len(values), dtype=bool)
    if count == 2:
        differs[known] = abs(np.diff(values[known])) > threshold(1) * np.linalg.norm(uncertainties[known])
    elif count > 2:
        variance = uncertainties[known] ** 2
        of_median = _OF_MEDIAN * np.mean(variance) / count
        gap = np.abs(values[known] - np.median(values[known]))
        differs[known] = gap > threshold(count) * np.sqrt(variance + of_median)
    return differs
