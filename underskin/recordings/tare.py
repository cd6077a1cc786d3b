"""The initial part of a curve over which a channel is set to 0: whether it rises there, as where it is in contact."""

from dataclasses import dataclass

import numpy as np

from underskin.units import Floats

_LEAST_TARED = 16  # samples needed for a level and its noise
_NOISES = 8.0  # least rise, in standard deviations of a sample's noise
_LEAST_RISE = 3e-3  # least rise, of the range of the whole curve


@dataclass(frozen=True)
class Rise:
    """A departure of the tared samples from their initial `level`: from sample `start` (from 0) on, by `height` at the
    end of the tared part, both in the column's unit."""

    start: int
    height: float
    level: float


def rise_of(column: Floats, count: int) -> Rise | None:
    """The rise of the first `count` samples of a column above the level of their first quarter; None without one, or
    with too few samples."""
    tared = column[:count]
    if count < _LEAST_TARED or not np.isfinite(column).all():
        return None
    level = float(tared[: count // 4].mean())
    height = float(tared[-max(1, count // 16) :].mean()) - level
    noise = float(np.median(np.abs(np.diff(tared)))) / (0.6745 * np.sqrt(2))  # of white noise; a rise is rare in it
    limit = max(_NOISES * noise, _LEAST_RISE * float(np.ptp(column)))
    if abs(height) <= limit:
        return None
    within = np.flatnonzero(np.abs(tared - level) <= max(4 * noise, _LEAST_RISE * float(np.ptp(column))))
    return Rise(int(within[-1]) + 1 if len(within) else 0, height, level)
