"""Rows that mains pick-up reaches: they weigh less, the more of it there is, and sums over rows lose as much."""

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.mechanisms.models.frf_design import Indices
from underskin.units import Floats


class PickupRows:
    """Of all rows of the lines, those that pick-up reaches."""

    def __init__(self, lines: Lines, rows: Indices) -> None:
        """In order of recordings."""
        self.rows = rows
        self._deviation = lines.deviation[rows]
        self._recordings = lines.recordings
        self._owner = lines.recording[rows]
        self._first = np.flatnonzero(np.diff(self._owner, prepend=-1))

    def lost(self, pickup: Floats, level: Floats | float) -> tuple[Floats, Floats]:
        """The share of their weight 1/(κ d)² that rows lose to pick-up of these deviations (…, pick-up rows), and what
        that adds to the log of the determinant (…, 1)."""
        ratio = (pickup / (level * self._deviation)) ** 2
        return np.asarray(ratio / (1 + ratio)), np.asarray(2 * np.log1p(ratio).sum(axis=-1, keepdims=True))

    def over_recordings(self, products: Floats) -> Floats:
        """Sums over the pick-up rows of each recording: (…, pick-up rows) to (…, recordings)."""
        sums = np.zeros((*products.shape[:-1], self._recordings))
        sums[..., self._owner[self._first]] = np.add.reduceat(products, self._first, axis=-1)
        return sums
