"""Contacts that stick, solved over growing edges."""

import numpy as np

from tablegen.contact_column import SphereSolution, press_spheres
from tablegen.sticking import Touched
from underskin.units import Floats


def grown(edges: list[float], radius: float, rho: Floats, order: int) -> list[SphereSolution]:
    """One sphere that sticks, as its contact grows over these edges; the discs' radii are rho."""
    earlier: list[Touched] = []
    spheres = []
    for a in edges:
        (sphere,) = press_spheres(a, np.array([radius]), rho, order, earlier=earlier)
        strain = np.array([a / radius])
        earlier.append(Touched(a, strain, (sphere.contact_radius / a - 1) / strain))
        spheres.append(sphere)
    return spheres
