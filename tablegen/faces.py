"""The two horizontal faces of the mesh: shape functions along them, and the Hertz pressure as nodal loads."""

from typing import Literal

import numpy as np

from tablegen.discretisation import Discretisation, Indices
from underskin.units import Floats


def hertz_load(d: Discretisation, a: float) -> Floats:
    """Nodal loads of the pressure √(1 − r²/a²) on r < a, acting downwards; the 2π is left out.

    It is a dead load: per undeformed area, its direction fixed. With r = a sin θ the integrand is analytic up to the
    contact's edge: q r dr = a² sin θ cos² θ dθ.
    """
    edges = np.unique(d.basis.mesh.p[0])
    theta = np.arcsin(np.clip(edges[edges <= a * (1 + 1e-12)] / a, 0, 1))
    x, w = np.polynomial.legendre.leggauss(3 * d.order + 4)
    half = np.diff(theta)[:, None] / 2
    angle = theta[:-1, None] + half * (1 + x)
    weight = half * w * a**2 * np.sin(angle) * np.cos(angle) ** 2
    values, numbers = shapes_along(d, a * np.sin(angle).ravel(), 1)
    load = np.zeros(d.size)
    np.add.at(load, 2 * numbers + 1, -weight.reshape(-1, 1) * values)
    return load


def shapes_along(d: Discretisation, r: Floats, z: Literal[0, 1]) -> tuple[Floats, Indices]:
    """Values (points, n) and scalar numbers (points, n) of the shape functions at radii r on the face at z."""
    mesh = d.basis.mesh
    columns, rows = (np.unique(coordinate) for coordinate in mesh.p)
    corner = mesh.p[:, mesh.t].min(axis=1)  # (2, elements): lower left corners
    on_face = np.flatnonzero(corner[1] == (rows[-2] if z == 1 else rows[0]))
    on_face = on_face[np.argsort(corner[0, on_face])]
    column = np.clip(np.searchsorted(columns, r, side="right") - 1, 0, len(columns) - 2)
    xi = (r - columns[column]) / np.diff(columns)[column]
    local = np.stack([np.full_like(xi, z), xi])  # the reference square of a tensor mesh has z first
    values = np.stack([d.basis.elem.lbasis(local, i)[0] for i in range(d.basis.Nbfun)], axis=-1)
    return values, d.basis.element_dofs[:, on_face[column]].T


def gauss_rule(edges: Floats, points: int) -> tuple[Floats, Floats]:
    """Gauss–Legendre radii and weights (dr · r), with so many points on every interval between `edges`."""
    x, w = np.polynomial.legendre.leggauss(points)
    half = np.diff(edges)[:, None] / 2
    r = edges[:-1, None] + half * (1 + x)
    return r.ravel(), (half * w * r).ravel()
