"""Contacts other than Hertz's: with adhesion (JKR), on a layer, and with an edge that moves.

Each gives the transform p(k a) of its static pressure for unit force at the wavenumbers of `layer.transfer`.
Lengths in mm, forces in N, moduli in MPa, work of adhesion in J/m^2; Poisson ratio 0.5, E' = E/0.75.

JKR (Johnson, Kendall & Roberts 1971), half space::

    a^3 = (3 R/4 E') [F + 3 pi w R + sqrt(6 pi w R F + (3 pi w R)^2)]
    p = [F_H p_Hertz + (F - F_H) p_punch]/F,  F_H = 4 E' a^3/(3 R)

Sphere on the bonded layer, frictionless: the integral equation in `layer.py` with the right side delta - x^2/R and
phi(a) = 0; p(k) = int phi cos(k t) dt / int phi dt.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

from rig.unlisted.layer import contact_equation, hertz_transform, punch_transform, transfer

Array = npt.NDArray[np.float64]


def adhesive_contact(
    force_n: Array, radius_mm: Array, modulus_mpa: float, work: float, thickness_mm: float
) -> tuple[Array, Array]:
    """Contact radius (n,) and transform of the pressure (n, 200) with a work of adhesion."""
    plane = modulus_mpa / 0.75
    pull = 3.0 * np.pi * 1e-3 * work * radius_mm
    a = np.cbrt(0.75 * radius_mm / plane * (force_n + pull + np.sqrt(2.0 * pull * force_n + pull**2)))
    share = 4.0 * plane * a**3 / (3.0 * radius_mm) / force_n
    s = transfer()[0] * (a / thickness_mm)[:, None]
    pressure = share[:, None] * hertz_transform(s) + (1.0 - share)[:, None] * punch_transform(s)
    return np.asarray(a), np.asarray(pressure)


def _sphere(a: float) -> tuple[Array, Array, Array]:
    """Nodes, weights and phi of a sphere of radius 1 that makes a contact of radius a; E' = 1."""
    t, w, matrix, edge = contact_equation(a)
    flat, bowl = np.linalg.solve(matrix, np.column_stack([np.ones(t.size), t**2])).T
    delta = (a * a + edge @ bowl) / (1.0 + edge @ flat)
    return t, w, np.asarray(delta * flat - bowl)


@lru_cache(maxsize=1)
def _force_table() -> tuple[CubicSpline, CubicSpline]:
    radii = np.linspace(0.05, 3.0, 60)
    ratio = []
    for a in radii:
        _, w, phi = _sphere(float(a))
        ratio.append(1.5 * np.pi * float(w @ phi) / a**3)
    x, y = np.concatenate([[0.0], radii]), np.concatenate([[1.0], ratio])
    return CubicSpline(x, y), CubicSpline(x * np.cbrt(y), x)


def force_over_hertz(a: Array) -> Array:
    """F/F_Hertz(a) of a sphere on the layer; a in h, up to 3."""
    return np.asarray(_force_table()[0](a))


def layered_contact(hertz: Array) -> tuple[Array, Array]:
    """Contact radius (n,) and transform of the pressure (n, 200) on the layer, from Hertz's radius; both in h."""
    levels, which = np.unique(hertz, return_inverse=True)
    radii = np.asarray(_force_table()[1](levels))
    k, pressure = transfer()[0], []
    for a in radii:
        t, w, phi = _sphere(float(a))
        pressure.append(np.cos(np.outer(k, t)) @ (w * phi) / (w @ phi))
    return radii[which], np.array(pressure)[which]
