"""Rows that mains pick-up reaches: they weigh less, the more of it there is, and sums over rows lose as much."""

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.units import Array, Floats, Indices

_TOGETHER = 8  # factors of the determinant whose logarithm is taken together: below 1e38 each, they do not overflow


class PickupRows:
    """Of all rows of the lines, those that pick-up reaches.

    Attributes: `line`, which of a model's distinct lines each is; `value`, what was measured.
    """

    def __init__(self, lines: Lines, rows: Indices, line: Indices) -> None:
        """In order of recordings; `line` says which distinct line each row of all is."""
        self._variance = lines.deviation[rows] ** 2
        self.value = lines.value[rows]
        self._recordings = lines.recordings
        owner = lines.recording[rows]
        self._first = np.flatnonzero(np.diff(owner, prepend=-1))
        self._owner = owner[self._first]
        self._groups = np.arange(0, len(rows), _TOGETHER)
        self.line = line[rows]

    def lost(self, pickup: Floats, level: Floats) -> tuple[Floats, Floats]:
        """The weight that rows lose to pick-up of these deviations (…, pick-up rows), of 1/d² each, and what that adds
        to the log of the determinant (…, 1)."""
        ratio = pickup**2 / (level**2 * self._variance)
        more = 1 + ratio
        ratio /= more
        ratio /= self._variance
        log_determinant = 2 * np.log(np.multiply.reduceat(more, self._groups, axis=-1)).sum(axis=-1, keepdims=True)
        return ratio, log_determinant

    def summed(self, lost: Floats, products: Array) -> Floats:
        """What sums of products lose in each recording, rows (…, pick-up rows) to (…, recordings)."""
        losses = lost * products
        sums = np.zeros((*losses.shape[:-1], self._recordings))
        sums[..., self._owner] = np.add.reduceat(losses, self._first, axis=-1)
        return sums
