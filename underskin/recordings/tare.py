"""The part of a curve over which its force is taken for 0: whether it is one level, as in the air."""

from dataclasses import dataclass

import numpy as np

from underskin.units import Floats

_LEAST = 16  # samples of which a level and its noise are told
_NOISES = 8.0  # standard deviations of a sample's noise: more is a rise
_LEAST_RISE = 3e-3  # of the range of the whole curve: less does not matter


@dataclass(frozen=True)
class Rise:
    """Where the samples leave their first `level`: from the sample `start` on, counted from 0, by `height` at the
    tared part's end, both in the column's unit."""

    start: int
    height: float
    level: float


def rise(column: Floats, count: int) -> Rise | None:
    """How the first `count` samples of a column leave the level of their first quarter; None where they do not, or
    are too few to tell."""
    tared = column[:count]
    if count < _LEAST or not np.isfinite(column).all():
        return None
    level = float(tared[: count // 4].mean())
    height = float(tared[-max(1, count // 16) :].mean()) - level
    noise = float(np.median(np.abs(np.diff(tared)))) / (0.6745 * np.sqrt(2))  # of white noise; a rise is rare in it
    limit = max(_NOISES * noise, _LEAST_RISE * float(np.ptp(column)))
    if abs(height) <= limit:
        return None
    within = np.flatnonzero(np.abs(tared - level) <= max(4 * noise, _LEAST_RISE * float(np.ptp(column))))
    return Rise(int(within[-1]) + 1 if len(within) else 0, height, level)
