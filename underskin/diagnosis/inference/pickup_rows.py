"""Rows that mains pick-up reaches: they weigh less, the more of it there is, and sums over rows lose as much."""

import numpy as np

from underskin.autodiff import contiguous
from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.sums import SlopeSums, Sums
from underskin.units import Array, Floats, Indices


class PickupRows:
    """Of all rows of the lines, those that pick-up reaches.

    Attributes: `line`, which of a model's distinct lines each is; `value`, what was measured.
    """

    def __init__(self, lines: Lines, rows: Indices, line: Indices) -> None:
        """In order of recordings; `line` says which distinct line each row of all is."""
        self._variance = lines.deviation[rows] ** 2
        self.value = lines.value[rows]
        self._square = self.value.real**2 + self.value.imag**2
        self._recordings = lines.recordings
        self._recording = lines.recording[rows]
        self.line = line[rows]

    def less(self, sums: Sums, u: Array, pickup: Floats, level: Floats) -> Sums:
        """The sums less what rows lose to pick-up of these deviations (points, sets, pick-up rows), at the directions u
        (points, pick-up rows)."""
        from underskin.diagnosis.inference.pickup_kernel import lost

        shape = *level.shape[:2], self._recordings
        uu, uy, yy = (np.broadcast_to(x, shape).copy() for x in (sums.uu, sums.uy, sums.yy))
        log_determinant = np.zeros(shape[:2])
        of_rows = self._square, u.real**2 + u.imag**2, u.real * self.value.real + u.imag * self.value.imag
        pickup = np.broadcast_to(pickup, (*shape[:2], len(self.line)))
        arrays = contiguous(pickup), contiguous(level[..., 0]), self._variance, self._recording
        lost(*arrays, *map(contiguous, of_rows), uu, uy, yy, log_determinant)
        return Sums(uu, uy, yy, log_determinant[..., None])

    def slopes_less(self, sums: SlopeSums, u: Array, v: Array, pickup: Floats, level: Floats) -> SlopeSums:
        """The sums with derivatives v (points, parameters, pick-up rows) less what rows lose, likewise; deviations are
        (points, pick-up rows), levels (points,)."""
        from underskin.diagnosis.inference.pickup_kernel import slopes_lost

        pickup = contiguous(np.broadcast_to(pickup, u.shape))
        level = contiguous(np.broadcast_to(level, u.shape[:1]))
        of_rows = self._variance, self._recording, self.value, contiguous(u.astype(complex, copy=False))
        uv, vy, vv = (np.array(x) for x in (sums.uv, sums.vy, sums.vv))
        slopes_lost(pickup, level, *of_rows, contiguous(v.astype(complex, copy=False)), uv, vy, vv)
        return SlopeSums(uv, vy, vv)
