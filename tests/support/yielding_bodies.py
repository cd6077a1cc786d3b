"""A rigid or yielding sphere on a linear bonded incompressible layer, and a sensor's film on a glue line beneath it.

Independent of the library: the layer's state is a matrix exponential, the contact a set of rings of uniform pressure,
the film finite differences. Units: the layer's thickness and shear modulus are 1, so that E' is 4.
"""

from functools import cache

import numpy as np
from scipy.linalg import expm, solve_banded
from scipy.special import ellipe, ellipk, j0, j1

from underskin.units import Floats

REDUCED = 4.0
_RINGS = 120
# u, w, σ_zz/k and τ_rz/k by kz, of transforms of order 1, 0, 0 and 1
_STATE = np.array([[0.0, 1, 0, 1], [-1, 0, 0, 0], [0, 0, 0, -1], [4, 0, 1, 0]])
_x, _w = np.polynomial.legendre.leggauss(16)
WAVE_NUMBERS: Floats = (0.25 * (np.arange(80)[:, None] + (1 + _x) / 2)).ravel()
WEIGHTS: Floats = np.tile(0.125 * _w, 80)


@cache
def layer() -> tuple[Floats, Floats, Floats]:
    """Base pressure, base shear and surface deflection (of the half space: 1) under a pressure of 1."""
    answers = []
    for k in WAVE_NUMBERS:
        through = expm(_STATE * k)
        base = np.linalg.solve(through[2:, 2:], [-1.0, 0.0])
        answers.append([-base[0], base[1], -2 * through[1, 2:] @ base])
    pressure, shear, deflection = np.array(answers).T
    return pressure, shear, deflection


def transmitted(transform: Floats, rho: float, offset: float = 0.0) -> float:
    """σ of what reaches the base with this transform, averaged over a disc at an offset."""
    k = WAVE_NUMBERS
    return float(np.sum(WEIGHTS * k * transform * 2 * j1(k * rho) / (k * rho) * j0(k * offset)) / 3)


def press(radius: float, depth: float, tip: float) -> tuple[float, Floats]:
    """Force and transform (1 at k = 0) of the pressure of a sphere with E'/E'_tip = `tip`, without friction."""
    edges = np.linspace(0.0, np.sqrt(radius * depth / 0.4), _RINGS + 1)
    middle = (edges[1:] + edges[:-1]) / 2
    k = WAVE_NUMBERS
    discs = edges * j1(np.multiply.outer(k, edges)) / k[:, None]
    rings = np.diff(discs, axis=1)
    held = j0(np.multiply.outer(middle, k)) @ ((WEIGHTS * (1 - layer()[2]))[:, None] * rings)
    moved = 2 / REDUCED * ((1 + tip) * np.diff(_half_space(middle, edges), axis=1) - held)
    touching = np.ones(_RINGS, dtype=bool)
    while True:
        pressure = np.zeros(_RINGS)
        gap = depth - middle**2 / (2 * radius)
        pressure[touching] = np.linalg.solve(moved[np.ix_(touching, touching)], gap[touching])
        if (pressure >= 0).all():
            break
        touching &= pressure > 0
    force = float(np.pi * np.diff(edges**2) @ pressure)
    return force, 2 * np.pi * rings @ pressure / force


def _half_space(at: Floats, discs: Floats) -> Floats:
    """∫ p̂ J0(kr) dk of unit pressure on discs: (at, discs)."""
    r, c = np.broadcast_arrays(at[:, None], discs)
    m = np.where(r < c, r / np.where(c > 0, c, 1.0), c / r) ** 2
    return 2 / np.pi * np.where(r < c, c * ellipe(m), r * (ellipe(m) - (1 - m) * ellipk(m)))


def film_strain(transform: Floats, rho: float, shear_lag: float) -> float:
    """h³/(F) · C · mean of u' + u/r over a centred disc, C u'' + … = k_g u − τ, times 2π/3, as σ is of the pressure."""
    r = np.linspace(0.0, 12.0, 6001)[1:]
    step = r[0]
    k = WAVE_NUMBERS
    shear = j1(np.multiply.outer(r, k)) @ (WEIGHTS * k * transform * layer()[1]) / 3
    below, above = 1 / step**2 - 1 / (2 * r * step), 1 / step**2 + 1 / (2 * r * step)
    middle = -2 / step**2 - 1 / r**2 - 1 / shear_lag**2
    bands = np.array([np.append(0.0, above[:-1]), middle, np.append(below[1:], 0.0)])
    moved = solve_banded((1, 1), bands, -shear)
    return float(2 * np.interp(rho, r, moved) / rho)
