"""A tensor-product cubic spline at one point in plain Python, which is faster there than the machinery of arrays.

s(x, y, z) = Σ c_ijk b_i(x) b_j(y) b_k(z); in each cell four basis functions of each axis differ from 0, and each is a
cubic in the distance from the cell's lower node. The values agree with scipy's NdBSpline to rounding.
"""

import math
from bisect import bisect_right

import numpy as np
from scipy.interpolate import BSpline, NdBSpline

from underskin.units import Floats

_DEGREE = 3

# Highest power first; the cubics of a cell's four basis functions.
Cubic = tuple[float, ...]
Basis = tuple[Cubic, ...]
Cell = tuple[int, int, int]


class PointSpline:
    """The three-dimensional cubic `spline`, for one point at a time."""

    def __init__(self, spline: NdBSpline) -> None:
        """Take the basis functions apart into cubics, cell by cell."""
        self._nodes = [knots[_DEGREE:-_DEGREE].tolist() for knots in spline.t]
        self._basis = [_basis(np.asarray(knots)) for knots in spline.t]
        self._coefficients = np.asarray(spline.c).tolist()

    def cell(self, x: float, y: float, z: float) -> Cell | None:
        """Where the point lies, or None outside the spline's nodes (NaN included)."""
        x_nodes, y_nodes, z_nodes = self._nodes
        inside = x_nodes[0] <= x <= x_nodes[-1] and y_nodes[0] <= y <= y_nodes[-1] and z_nodes[0] <= z <= z_nodes[-1]
        return (cell_of(x_nodes, x), cell_of(y_nodes, y), cell_of(z_nodes, z)) if inside else None

    def value(self, cell: Cell, x: float, y: float, z: float) -> float:
        """s(x, y, z) in its cell."""
        i, j, k = cell
        in_x, in_y, in_z = self._basis
        z0, z1, z2, z3 = _values(in_z[k], z - self._nodes[2][k])
        weights_y = _values(in_y[j], y - self._nodes[1][j])
        total = 0.0
        for weight_x, plane in zip(_values(in_x[i], x - self._nodes[0][i]), self._coefficients[i : i + 4], strict=True):
            in_plane = 0.0
            for weight_y, line in zip(weights_y, plane[j : j + 4], strict=True):
                c0, c1, c2, c3 = line[k : k + 4]
                in_plane += weight_y * (c0 * z0 + c1 * z1 + c2 * z2 + c3 * z3)
            total += weight_x * in_plane
        return total


def _basis(knots: Floats) -> list[Basis]:
    """For each cell the cubics of its four basis functions: Taylor's coefficients at its lower node."""
    count = len(knots) - _DEGREE - 1
    basis = BSpline(knots, np.eye(count), _DEGREE)
    nodes = knots[_DEGREE : -_DEGREE - 1]
    c0, c1, c2, c3 = (np.asarray(basis(nodes, nu=order)) / math.factorial(order) for order in range(4))
    cubics = np.stack([c3, c2, c1, c0], axis=-1).tolist()
    return [tuple(map(tuple, cubics[cell][cell : cell + 4])) for cell in range(count - _DEGREE)]


def cell_of(nodes: list[float], value: float) -> int:
    """Between which two nodes a value inside them lies: at a node above it, at the last one below it."""
    return bisect_right(nodes, value, 1, len(nodes) - 1) - 1


def _values(cubics: Basis, u: float) -> Cubic:
    (a3, a2, a1, a0), (b3, b2, b1, b0), (c3, c2, c1, c0), (d3, d2, d1, d0) = cubics
    return (
        ((a3 * u + a2) * u + a1) * u + a0,
        ((b3 * u + b2) * u + b1) * u + b0,
        ((c3 * u + c2) * u + c1) * u + c0,
        ((d3 * u + d2) * u + d1) * u + d0,
    )
