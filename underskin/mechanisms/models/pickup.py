"""Charge that comes from elsewhere than the skin: random on each row, so it moves the covariance and not the mean."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from underskin.mechanisms.models.frf_design import Indices
from underskin.units import Floats

PICKUP_NAMES = ("pickup_charge", "pickup_width", "pickup_harmonics")


@dataclass(frozen=True)
class Pickup:
    """`deviation`: of real and of imaginary part on these rows [C/N], from the parameters by name in their units.

    Parameters (…, 1) give (…, rows).
    """

    rows: Indices
    deviation: Callable[[Mapping[str, Floats]], Floats]
