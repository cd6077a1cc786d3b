"""The discs of a map of an array: how wide they are, and the ring around the one that is chosen."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from underskin.figures.style import INK
from underskin.units import Floats

SHARE = 0.42  # radius of a disc over the smallest distance of two sensors, so that none overlap at any size
_SEEN = 1 / 80  # of the map's longer side: a smaller radius cannot be seen
AROUND = 1.17  # times it, the ring around the chosen one, which touches no neighbour's disc
_ALONE_MM = 1.0  # radius where there is no other


def disc_size(x_mm: ArrayLike, y_mm: ArrayLike, sensor_radius_mm: float | None) -> str:
    """A sentence: of which size the discs of such a map are, beside the sensors themselves."""
    if sensor_radius_mm is None:
        return "Discs do not have the sensors' size, which is not declared."
    drawn = radius_of(np.asarray(x_mm, dtype=float), np.asarray(y_mm, dtype=float), sensor_radius_mm)
    if drawn == sensor_radius_mm:
        return "Discs have the sensors' size."
    return f"Discs are {drawn / sensor_radius_mm:.3g} times as wide as the sensors."


def smallest_distance(x: Floats, y: Floats) -> float:
    """The smallest distance of two sensors in different places [mm]; of a single one that at which its disc ends."""
    apart = np.hypot(x[:, None] - x, y[:, None] - y)
    apart = apart[apart > 0]
    return float(apart.min()) if len(apart) else _ALONE_MM / SHARE


def radius_of(x: Floats, y: Floats, sensor_radius_mm: float | None) -> float:
    """Of all discs [mm]: the sensors', unless it is unknown, too small to be seen, or discs would overlap."""
    widest = SHARE * smallest_distance(x, y)
    side = max(float(np.ptp(x)), float(np.ptp(y)))
    if sensor_radius_mm is None or sensor_radius_mm < _SEEN * side:
        return widest
    alone = side == 0
    return sensor_radius_mm if alone else min(sensor_radius_mm, widest / SHARE / 2)


def ring(x: float, y: float, radius: float) -> dict[str, Any]:
    """The shape of the ring around a disc in (x, y) of this radius [mm]."""
    around = AROUND * radius
    ends = {"x0": x - around, "x1": x + around, "y0": y - around, "y1": y + around}
    return {"type": "circle", "line": {"color": INK, "width": 2}, "layer": "below", **ends}
