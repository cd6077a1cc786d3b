"""Rows that mains pick-up reaches: they weigh less, the more of it there is, and sums over rows lose as much."""

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.mechanisms.models.frf_design import Indices
from underskin.units import Array, Floats


class PickupRows:
    """Of all rows of the lines, those that pick-up reaches."""

    def __init__(self, lines: Lines, rows: Indices, line: Indices) -> None:
        """In order of recordings; `line` says which of a model's distinct lines each row of all is."""
        self._deviation = lines.deviation[rows]
        self._value = lines.value[rows]
        self._recordings = lines.recordings
        self._owner = lines.recording[rows]
        self._first = np.flatnonzero(np.diff(self._owner, prepend=-1))
        self.line = line[rows]

    def lost(self, pickup: Floats, level: Floats | float) -> tuple[Floats, Floats]:
        """The weight that rows lose to pick-up of these deviations (…, pick-up rows), of 1/d² each, and what that adds
        to the log of the determinant (…, 1)."""
        ratio = (pickup / (level * self._deviation)) ** 2
        return ratio / (1 + ratio) / self._deviation**2, np.asarray(2 * np.log1p(ratio).sum(axis=-1, keepdims=True))

    def summed(self, lost: Floats, one: Array, other: Array | None = None) -> Floats:
        """What Σ Re one* other of each recording loses (…, recordings), of rows (…, pick-up rows).

        `other` None stands for what was measured.
        """
        products = lost * (np.conj(one) * (self._value if other is None else other)).real
        sums = np.zeros((*products.shape[:-1], self._recordings))
        sums[..., self._owner[self._first]] = np.add.reduceat(products, self._first, axis=-1)
        return sums

    @property
    def value(self) -> Array:
        """What was measured."""
        return self._value
