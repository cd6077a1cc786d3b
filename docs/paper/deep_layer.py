"""The exact answer that the block is judged by: an endless incompressible layer, read one unit below its top.

Lengths in units of the depth h of the sensors' plane; the rigid base lies `depth` ≥ 1 below the top. With
u_z = W(z) J0(kr) and, by incompressibility, u_r = −W'(z)/k · J1(kr), equilibrium leaves W = a combination of
e^(±kz) and z e^(±kz); the shear stress is −(W'' + k² W)/k and T3 = 3 W' − W'''/k² (shear modulus 1). Four
conditions at base and top fix the combination for each wavenumber k. For depth 1 this is
`tablegen.linear_layer`, for depth → ∞ `underskin.physics.half_space`.
"""

import numpy as np

from underskin.physics.hankel_transform import disc_average, hertz_transform
from underskin.units import Floats

_LAST_WAVENUMBER = 44.0  # the transmission falls like (1 + k) e^(−k)
_POINTS = 400


def sigma(depth: float, a: float, rho: Floats, *, bonded: bool = True) -> Floats:
    """σ under the Hertz pressure of radius `a` (a/h) for sensors of radii `rho` (rT/h, array), all below 3.

    `bonded`: the base holds the layer; otherwise it only carries it, without friction.
    """
    x, weight = np.polynomial.legendre.leggauss(_POINTS)
    k, weight = _LAST_WAVENUMBER / 2 * (1 + x), _LAST_WAVENUMBER / 2 * weight
    transmitted = np.array([_transmission(wavenumber, depth, bonded) for wavenumber in k])
    return disc_average(np.multiply.outer(rho, k)) @ (hertz_transform(k * a) * transmitted * k * weight / 3)


def _transmission(k: float, depth: float, bonded: bool) -> float:
    """−T3 on the sensors' plane over the pressure on the top, at wavenumber k."""
    base, top, plane = (_solutions(k, depth, z) for z in (0.0, depth, depth - 1.0))
    held = base[1] / k if bonded else (base[2] + k**2 * base[0]) / k**2
    conditions = np.stack([base[0], held, (top[2] + k**2 * top[0]) / k**2, _stress(top, k) / k])
    return -float(_stress(plane, k) @ np.linalg.solve(conditions, [0.0, 0.0, 0.0, -1 / k]))


def _stress(w: Floats, k: float) -> Floats:
    return 3 * w[1] - w[3] / k**2


def _solutions(k: float, depth: float, z: float) -> Floats:
    """W, W', W'', W''' (rows) of the four solutions at z, scaled so that none overflows."""
    columns = []
    for s, origin in ((k, depth), (-k, 0.0)):
        e = np.exp(s * (z - origin))
        columns.append(e * np.array([1, s, s**2, s**3]))
        columns.append(e * np.array([z, 1 + s * z, s * (2 + s * z), s**2 * (3 + s * z)]))
    return np.stack(columns, axis=1)
