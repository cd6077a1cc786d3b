"""A layer of any Poisson ratio on a glue line that yields in shear: its M(k), which `layer.py` gives for the bonded,
incompressible one.

Thickness 1, z from the free surface down to the base; Papkovich and Neuber's potentials psi and phi, harmonic::

    2 G u_z = (3 - 4 nu) psi - z psi' - phi',  2 G u_r = -d/dr (z psi + phi)
    s_zz = 2 (1 - nu) psi' - z psi'' - phi'',  s_rz = d/dr [(1 - 2 nu) psi - z psi' - phi']

For each wavenumber k, psi = (A f + B g) J0(kr) and phi = (C f + D g) J0(kr)/k, with f = exp(-k z) and
g = sinh(k z)/sinh(k); at z = 0, s_zz = -1 and s_rz = 0; at z = 1, u_z = 0 and s_rz = -kappa G u_r (thickness h:
kappa G/h). M = -s_zz at z = 1.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rig.unlisted.layer import transfer

Array = npt.NDArray[np.float64]


def layer_transfer(poisson_ratio: float, slip: float = 0.0) -> Array:
    """M at the wavenumbers of `transfer`, (200,); `slip` is 1/kappa, 0 for a bonded layer."""
    k, nu = transfer()[0], poisson_ratio
    fall, rise = np.exp(-k), 1.0 / np.tanh(k)
    zero, unit = np.zeros_like(k), np.ones_like(k)
    # f, f'/k and f''/k^2, then those of g, at the surface and at the base.
    surface = ((unit, -unit, unit), (zero, 1.0 / np.sinh(k), zero))
    base = ((fall, -fall, fall), (unit, rise, unit))

    def normal(at: tuple[tuple[Array, Array, Array], ...], z: float) -> list[Array]:
        return [2.0 * (1.0 - nu) * d - z * k * dd for _, d, dd in at] + [-dd for _, _, dd in at]

    def shear(at: tuple[tuple[Array, Array, Array], ...], z: float) -> list[Array]:
        return [(1.0 - 2.0 * nu) * v - z * k * d for v, d, _ in at] + [-d for _, d, _ in at]

    down = [(3.0 - 4.0 * nu) * v - k * d for v, d, _ in base] + [-d for _, d, _ in base]
    out = [k * v for v, _, _ in base] + [v for v, _, _ in base]
    glue = [a - 2.0 * slip * k * b for a, b in zip(out, shear(base, 1.0), strict=True)]
    matrix = np.stack([np.stack(row, axis=-1) for row in (normal(surface, 0.0), shear(surface, 0.0), down, glue)], 1)
    load = np.stack([-1.0 / k, zero, zero, zero], axis=-1)
    solution = np.linalg.solve(matrix, load[..., None])[..., 0]
    return np.asarray(-k * (np.stack(normal(base, 1.0), axis=-1) * solution).sum(axis=-1))
