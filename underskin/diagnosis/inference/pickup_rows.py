"""Rows that mains pick-up reaches: they weigh less, the more of it there is, and sums over rows lose as much."""

import numpy as np

from underskin.autodiff import contiguous
from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.sums import SlopeSums, Sums
from underskin.mechanisms.models.frf_design import FrfDesign
from underskin.mechanisms.models.pickup import Pickup
from underskin.units import Array, Floats, Indices
from underskin.weak_cache import cached_while_alive


class PickupRows:
    """Of all rows of the lines, those that pick-up reaches, in order of recordings.

    Attributes: `lines`, which of a model's distinct lines they are on; `line`, which of these each row is on; `every`,
    the rows themselves.
    """

    def __init__(self, lines: Lines, pickup: Pickup, design: FrfDesign) -> None:
        """The design says which distinct line each row of all is."""
        rows = pickup.rows
        self._precision = lines.deviation[rows] ** -2.0
        self._value = contiguous(lines.value[rows])
        self._recordings = lines.recordings
        self._recording = lines.recording[rows]
        self._alike = np.arange(len(rows)) if pickup.alike is None else pickup.alike
        self.lines, line = np.unique(design.line[rows], return_inverse=True)
        self.line: Indices = line.reshape(-1)
        self.every: Indices = np.arange(len(rows))

    def less(self, sums: Sums, line: Indices, u: Array, pickup: Floats, level: Floats) -> Sums:
        """The sums less what rows lose to pick-up of these distinct deviations (points, sets, distinct), at the
        directions u (points, lines) of the rows on these lines (rows,)."""
        from underskin.diagnosis.inference.pickup_kernel import lost

        shape = *level.shape[:2], self._recordings
        uu, uy, yy = (np.broadcast_to(x, shape).copy() for x in (sums.uu, sums.uy, sums.yy))
        log_determinant = np.zeros(shape[:2])
        square = np.ascontiguousarray(np.swapaxes((pickup / level) ** 2, 1, 2))
        of_rows = self._alike, self._precision, self._recording, self._value, line
        lost(square, *of_rows, contiguous(u.astype(complex, copy=False)), uu, uy, yy, log_determinant)
        return Sums(uu, uy, yy, log_determinant[..., None])

    def slopes_less(
        self, sums: SlopeSums, line: Indices, u: Array, v: Array, pickup: Floats, level: Floats
    ) -> SlopeSums:
        """The sums with derivatives v (points, parameters, lines) less what rows lose, likewise; deviations are
        (points, distinct), levels (points,)."""
        from underskin.diagnosis.inference.pickup_kernel import slopes_lost

        square = contiguous((pickup / level[:, None]) ** 2)
        of_rows = self._alike, self._precision, self._recording, self._value, line
        directions = (contiguous(x.astype(complex, copy=False)) for x in (u, v))
        uv, vy, vv = (np.array(x) for x in (sums.uv, sums.vy, sums.vv))
        slopes_lost(square, *of_rows, *directions, uv, vy, vv)
        return SlopeSums(uv, vy, vv)


@cached_while_alive  # a diagnosis weighs dozens of models of one design
def pickup_rows(lines: Lines, pickup: Pickup, design: FrfDesign) -> PickupRows:
    """Those of these lines that a pick-up reaches, for models of this design."""
    return PickupRows(lines, pickup, design)
