"""Surface loads as point forces, and the charge that they put on every sensor of an array.

A contact presses with the Hertz pressure of its normal force; its tangential force is spread in the same way, as where
a sphere slides. A pressure map is constant in each of its cells. All in SI; x and y in the sensors' frame.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from underskin import hertz
from underskin.influence import Influence, SensorStress
from underskin.units import Floats

_FINE_CELL = 0.02  # of the thickness: below, one point a cell; γ turns over lengths of about 0.3
_MIDDLING_CELL = 0.1  # two points each way; above, three in every _SUBCELL
_SUBCELL = 0.4


@dataclass(frozen=True)
class Load:
    """Point forces (F1, F2, F3) [N], (points, 3), at places (points, 2) [m]."""

    places: Floats
    forces: Floats


@dataclass(frozen=True)
class Contact:
    """A sphere of `indenter_radius` [m] at x, y [m]; `force` (F1, F2, F3) [N], F3 > 0 into the skin."""

    x: float
    y: float
    indenter_radius: float
    force: tuple[float, float, float]

    def radius(self, youngs_modulus: float, poisson_ratio: float) -> float:
        """a [m] by Hertz."""
        return float(hertz.contact_radius(self.force[2], self.indenter_radius, youngs_modulus, poisson_ratio))


def contact_load(contact: Contact, contact_radius: float, thickness: float) -> Load:
    """A contact as point forces.

    With t = √(1 − r²/a²) the Hertz pressure's share of a ring is 3 t² dt, so that Gauss' rule in t and equal angles
    integrate γ, which is analytic, to machine precision.
    """
    wide = int(np.ceil(contact_radius / thickness))
    t, weight = np.polynomial.legendre.leggauss(6 + 4 * wide)
    t, weight = (1 + t) / 2, weight / 2
    count = 12 + 12 * wide
    angle = 2 * np.pi * (np.arange(count) + 0.5) / count
    r = contact_radius * np.sqrt(1 - t**2)
    places = np.stack([np.outer(r, np.cos(angle)), np.outer(r, np.sin(angle))], axis=-1).reshape(-1, 2)
    share = np.repeat(3 * t**2 * weight / count, count)
    return Load(places + np.array([contact.x, contact.y]), np.outer(share, contact.force))


def pressure_map_load(x: Floats, y: Floats, pressure: Floats, thickness: float) -> Load:
    """A map as point forces: `pressure` (y, x) [Pa] into the skin, constant in cells around evenly spaced x and y."""
    width, height = x[1] - x[0], y[1] - y[0]
    across, across_share = _cell_rule(width / thickness)
    along, along_share = _cell_rule(height / thickness)
    row, column = np.nonzero(pressure)
    places = np.empty((row.size, along.size, across.size, 2))
    places[..., 0] = x[column, None, None] + width * across
    places[..., 1] = y[row, None, None] + height * along[:, None]
    force = pressure[row, column, None, None] * width * height * np.outer(along_share, across_share)
    forces = np.zeros((force.size, 3))
    forces[:, 2] = force.ravel()
    return Load(places.reshape(-1, 2), forces)


def map_points(x: Floats, y: Floats, pressure: Floats, thickness: float) -> int:
    """How many point forces `pressure_map_load` makes of a map."""
    width, height = (_rule_of((axis[1] - axis[0]) / thickness) for axis in (x, y))
    return int(np.count_nonzero(pressure)) * width[0] * width[1] * height[0] * height[1]


def together(loads: Sequence[Load]) -> Load:
    """Several loads as one."""
    return Load(np.concatenate([load.places for load in loads]), np.concatenate([load.forces for load in loads]))


def charge(stress: Floats, d33: float, sensor_radius: float) -> Floats:
    """Q = −d33 π rT² T̄ [C]: positive in compression for a positive d33."""
    return -d33 * np.pi * sensor_radius**2 * stress


def array_stress(influence: Influence, thickness: float, sensors: Floats, load: Load) -> SensorStress:
    """Mean stress on sensors (sensors, 2) [m] under a load."""
    return influence.stress(thickness, sensors, load.places, load.forces)


def _rule_of(size: float) -> tuple[int, int]:
    """Points in each part of a cell of `size` thicknesses, and how many parts."""
    points = 1 if size <= _FINE_CELL else 2 if size <= _MIDDLING_CELL else 3
    return points, max(1, int(np.ceil(size / _SUBCELL)))


def _cell_rule(size: float) -> tuple[Floats, Floats]:
    """Places in a cell, −1/2 to 1/2, and their shares, for a cell of `size` thicknesses."""
    points, parts = _rule_of(size)
    node, weight = np.polynomial.legendre.leggauss(points)
    start = (np.arange(parts) - parts / 2) / parts
    places = (start[:, None] + (1 + node) / 2 / parts).ravel()
    return places, np.tile(weight / 2 / parts, parts)
