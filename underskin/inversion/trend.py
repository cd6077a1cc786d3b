"""Drift of a repeatedly measured quantity: slope over time, its uncertainty and its significance."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

FEWEST = 3  # two points always lie on a line
SIGNIFICANT = 0.05


@dataclass(frozen=True)
class Trend:
    """A straight line through the values; `p_value` is that of the slope if there were no drift."""

    slope: float  # unit of the values per unit of time
    slope_uncertainty: float  # one standard deviation
    p_value: float


def trend(time: ArrayLike, value: ArrayLike, uncertainty: ArrayLike) -> Trend | None:
    """A straight line by weighted least squares, weights 1/u².

    Where the values scatter more than by u, the uncertainty grows by the Birge ratio √(χ²/(n−2)); it never shrinks.
    The slope is tested two-sided against Student's t with n−2 degrees of freedom.

    Parameters
    ----------
    time, value, uncertainty : (n,) arrays
        Times, values and their standard uncertainties u, in any units.

    Returns
    -------
    Trend or None
        None for fewer than three values, or times that do not differ.
    """
    from scipy.special import stdtr

    t, y, u = (np.asarray(given, dtype=float) for given in (time, value, uncertainty))
    if len(t) < FEWEST or np.ptp(t) == 0:
        return None
    weights = 1 / np.square(np.maximum(u, 1e-6 * np.abs(y).max() + np.finfo(float).tiny))
    total = weights.sum()
    centred = t - (weights @ t) / total
    spread = weights @ centred**2
    slope = float(weights @ (centred * y) / spread)
    residuals = y - (weights @ y) / total - slope * centred
    freedom = len(t) - 2
    birge = max(1.0, float(weights @ residuals**2) / freedom)
    error = float(np.sqrt(birge / spread))
    return Trend(slope, error, float(2 * stdtr(freedom, -abs(slope / error))))


def interval(slope: float, slope_uncertainty: float, count: int) -> tuple[float, float]:
    """The slope's 95 % interval through `count` values, by Student's t of count − 2 degrees of freedom."""
    from scipy.special import stdtrit

    half = float(stdtrit(count - 2, 1 - SIGNIFICANT / 2)) * slope_uncertainty
    return slope - half, slope + half


def holm(p_values: Sequence[float]) -> list[float]:
    """The p-values adjusted for their number, in the order given (Holm 1979)."""
    order = np.argsort(p_values, kind="stable")
    adjusted = np.empty(len(p_values))
    factors = np.arange(len(p_values), 0, -1)
    adjusted[order] = np.minimum(1.0, np.maximum.accumulate(np.asarray(p_values)[order] * factors))
    return adjusted.tolist()
