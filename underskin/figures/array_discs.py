"""The discs of an array map: their radius, and the ring around the chosen one."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from underskin.figures.style import INK
from underskin.units import Floats

SHARE = 0.42  # radius of a disc over the smallest distance of two sensors, so that none overlap at any size
_LEAST_SHARE = 1 / 80  # of the map's longer side: a smaller radius cannot be seen
AROUND = 1.17  # times it, the ring around the chosen one, which touches no neighbour's disc
_SINGLE_RADIUS_MM = 1.0  # radius where there is no other


def disc_size(x_mm: ArrayLike, y_mm: ArrayLike, sensor_radius_mm: float | None) -> str:
    """A sentence on the size of the discs relative to the sensors."""
    if sensor_radius_mm is None:
        return "Discs do not have the sensors' size, which is not declared."
    drawn = radius_of(np.asarray(x_mm, dtype=float), np.asarray(y_mm, dtype=float), sensor_radius_mm)
    if drawn == sensor_radius_mm:
        return "Discs have the sensors' size."
    return f"Discs are {drawn / sensor_radius_mm:.3g} times as wide as the sensors."


def smallest_distance(x: Floats, y: Floats) -> float:
    """The smallest distance between sensors at different positions [mm]; for a single sensor a default."""
    distance = np.hypot(x[:, None] - x, y[:, None] - y)
    distance = distance[distance > 0]
    return float(distance.min()) if len(distance) else _SINGLE_RADIUS_MM / SHARE


def radius_of(x: Floats, y: Floats, sensor_radius_mm: float | None) -> float:
    """The radius of all discs [mm]: the sensors', unless it is unknown, too small to be seen, or discs would
    overlap."""
    widest = SHARE * smallest_distance(x, y)
    side = max(float(np.ptp(x)), float(np.ptp(y)))
    if sensor_radius_mm is None or sensor_radius_mm < _LEAST_SHARE * side:
        return widest
    is_single = side == 0
    return sensor_radius_mm if is_single else min(sensor_radius_mm, widest / SHARE / 2)


def ring(x: float, y: float, radius: float) -> dict[str, Any]:
    """The shape of the ring around a disc in (x, y) of this radius [mm]."""
    around = AROUND * radius
    ends = {"x0": x - around, "x1": x + around, "y0": y - around, "y1": y + around}
    return {"type": "circle", "line": {"color": INK, "width": 2}, "layer": "below", **ends}
