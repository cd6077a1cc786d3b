"""A tensor-product cubic spline at one point in plain Python, which is faster for a single point than array functions.

s(x, y, z) = Σ c_ijk b_i(x) b_j(y) b_k(z); in each cell four basis functions of each axis differ from 0, and each is a
cubic in the distance from the cell's lower node. The values agree with scipy's NdBSpline to rounding.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence
from struct import Struct

import numpy as np
from scipy.interpolate import BSpline, NdBSpline

from underskin.units import Floats

_DEGREE = 3
_FOUR_CUBICS = Struct("<16d").unpack_from

# Highest power first; the cubics of a cell's four basis functions.
Cubic = Sequence[float]
Basis = Sequence[Cubic]
Cell = tuple[int, int, int]


class PointSpline:
    """The three-dimensional cubic `spline`, for one point at a time.

    `cubics` (functions of x, cells of z, functions of y, powers): those in z, highest power first, that go with
    b_i(x) b_j(y); four of them in a row are read at once.
    """

    def __init__(self, spline: NdBSpline) -> None:
        """Decompose the spline: along z into cubics, along x and y into cubic basis functions, cell by cell."""
        self._nodes = [knots[_DEGREE:-_DEGREE].tolist() for knots in spline.t]
        in_x, in_y, in_z = (_basis_functions(np.asarray(knots)) for knots in spline.t)
        self._basis_x, self._basis_y = _of_cells(in_x), _of_cells(in_y)
        self.cubics: Floats = np.ascontiguousarray(np.einsum("ijk,ckp->icjp", spline.c, in_z))
        self._bytes = self.cubics.astype("<f8").tobytes()
        self._strides = self.cubics.strides

    def cell(self, x: float, y: float, z: float) -> Cell | None:
        """The cell of the point; None outside the spline's nodes (NaN included)."""
        x_nodes, y_nodes, z_nodes = self._nodes
        inside = x_nodes[0] <= x <= x_nodes[-1] and y_nodes[0] <= y <= y_nodes[-1] and z_nodes[0] <= z <= z_nodes[-1]
        return (cell_of(x_nodes, x), cell_of(y_nodes, y), cell_of(z_nodes, z)) if inside else None

    def value(self, cell: Cell, x: float, y: float, z: float) -> float:
        """s(x, y, z) in its cell."""
        i, j, k = cell
        x_nodes, y_nodes, z_nodes = self._nodes
        u = z - z_nodes[k]
        y0, y1, y2, y3 = _values(self._basis_y[j], y - y_nodes[j])
        total = 0.0
        next_i, next_cell, next_j, _ = self._strides
        offset = i * next_i + k * next_cell + j * next_j
        for weight in _values(self._basis_x[i], x - x_nodes[i]):
            a3, a2, a1, a0, b3, b2, b1, b0, c3, c2, c1, c0, d3, d2, d1, d0 = _FOUR_CUBICS(self._bytes, offset)
            total += weight * (
                y0 * (((a3 * u + a2) * u + a1) * u + a0)
                + y1 * (((b3 * u + b2) * u + b1) * u + b0)
                + y2 * (((c3 * u + c2) * u + c1) * u + c0)
                + y3 * (((d3 * u + d2) * u + d1) * u + d0)
            )
            offset += next_i
        return total


def _basis_functions(knots: Floats) -> Floats:
    """[cell, function, power]: each basis function's cubic in each cell, Taylor's at the cell's lower node."""
    count = len(knots) - _DEGREE - 1
    basis = BSpline(knots, np.eye(count), _DEGREE)
    nodes = knots[_DEGREE : -_DEGREE - 1]
    return np.stack([np.asarray(basis(nodes, nu=order)) / math.factorial(order) for order in (3, 2, 1, 0)], axis=-1)


def four_functions(knots: Floats) -> Floats:
    """The four basis functions that differ from 0 in each cell, as cubics (cells, functions, powers)."""
    return np.array(_of_cells(_basis_functions(np.asarray(knots))))


def _of_cells(functions: Floats) -> list[Basis]:
    """The four basis functions that differ from 0 in each cell."""
    return [basis[cell : cell + 4].tolist() for cell, basis in enumerate(functions)]


def cell_of(nodes: list[float], value: float) -> int:
    """The index of the cell of a value inside the nodes: at a node the cell above it, at the last node the last
    cell."""
    return bisect_right(nodes, value, 1, len(nodes) - 1) - 1


def _values(cubics: Basis, u: float) -> tuple[float, float, float, float]:
    (a3, a2, a1, a0), (b3, b2, b1, b0), (c3, c2, c1, c0), (d3, d2, d1, d0) = cubics
    return (
        ((a3 * u + a2) * u + a1) * u + a0,
        ((b3 * u + b2) * u + b1) * u + b0,
        ((c3 * u + c2) * u + c1) * u + c0,
        ((d3 * u + d2) * u + d1) * u + d0,
    )
