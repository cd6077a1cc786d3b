"""Charge that comes from elsewhere than the skin: random on each row, so it moves the covariance and not the mean."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from underskin.units import Floats, Indices


@dataclass(frozen=True, eq=False)
class Pickup:
    """`deviation`: of real and of imaginary part on these rows [C/N], from the parameters by name in their units.

    Parameters (…, 1) give (…, rows); where rows are `alike` (rows,), they give (…, distinct), of which each row has the
    one named there.
    """

    rows: Indices
    deviation: Callable[[Mapping[str, Floats]], Floats]
    alike: Indices | None = None

    def on_rows(self, distinct: Floats) -> Floats:
        """Deviations as `deviation` gives them (…, distinct), on the rows (…, rows)."""
        return distinct if self.alike is None else distinct[..., self.alike]


def together(pickups: Sequence[Pickup]) -> Pickup | None:
    """Independent charges as one: their variances add on the rows that several reach; None where there is none."""
    if len(pickups) < 2:
        return pickups[0] if pickups else None
    rows = np.unique(np.concatenate([pickup.rows for pickup in pickups]))

    def deviation(values: Mapping[str, Floats]) -> Floats:
        each = [(np.searchsorted(rows, pickup.rows), pickup.on_rows(pickup.deviation(values))) for pickup in pickups]
        variance = np.zeros((*np.broadcast_shapes(*(sd.shape[:-1] for _, sd in each)), len(rows)))
        for places, sd in each:
            variance[..., places] += sd**2
        return np.sqrt(variance)

    return Pickup(rows, deviation)
