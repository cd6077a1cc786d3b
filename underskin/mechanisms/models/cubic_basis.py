"""The four cubic B-splines that differ from 0 at a point: values and slopes, for many points at once."""

import math

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from underskin.units import Floats, Indices

_DEGREE = 3


class CubicBasis:
    """The cubic splines through values at `nodes` (not-a-knot ends).

    Attributes: `to_coefficients` (functions, nodes); `knots`, the ends of the cells; `cubics` (cells, powers,
    functions), the four functions of each cell in the distance from its lower knot, lowest power first.
    """

    def __init__(self, nodes: Floats) -> None:
        """Write each basis function of each cell as a cubic in the distance from the cell's lower knot."""
        self.nodes = nodes
        interpolating = make_interp_spline(nodes, np.eye(len(nodes)), k=_DEGREE)
        self.to_coefficients = np.asarray(interpolating.c)
        knots = np.asarray(interpolating.t)
        count = len(knots) - _DEGREE - 1
        self.knots = knots[_DEGREE:-_DEGREE]
        basis = BSpline(knots, np.eye(count), _DEGREE)
        powers = [np.asarray(basis(self.knots[:-1], nu=order)) / math.factorial(order) for order in range(4)]
        cells = np.arange(len(self.knots) - 1)[:, None]
        self.cubics = np.ascontiguousarray(np.stack([power[cells, cells + np.arange(4)] for power in powers], axis=1))

    def coefficients(self, values: Floats, axis: int) -> Floats:
        """The spline's coefficients, along one axis of the values."""
        return np.moveaxis(np.tensordot(self.to_coefficients, values, (1, axis)), 0, axis)

    def weights(self, at: Floats) -> tuple[Indices, Floats, Floats]:
        """For each point (…): the first of its four functions, their values (…, 4) and their slopes (…, 4).

        Beyond the nodes every function is continued along its tangent.
        """
        inside = np.minimum(np.maximum(at, self.nodes[0]), self.nodes[-1])
        cell = np.searchsorted(self.knots[1:-1], inside, side="right")
        u = inside - self.knots[cell]
        square = u * u
        powers = np.empty((*u.shape, 2, 4))
        powers[..., 0, 0], powers[..., 0, 1], powers[..., 0, 2], powers[..., 0, 3] = 1.0, u, square, square * u
        powers[..., 1, 0], powers[..., 1, 1], powers[..., 1, 2], powers[..., 1, 3] = 0.0, 1.0, 2 * u, 3 * square
        weights = powers @ self.cubics[cell]
        value, slope = weights[..., 0, :], weights[..., 1, :]
        beyond = at - inside
        return cell, value + slope * beyond[..., None] if beyond.any() else value, slope
