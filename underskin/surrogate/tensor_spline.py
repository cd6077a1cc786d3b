"""Tensor products of cubic splines through values on a grid (not-a-knot ends), evaluated by `spline_kernel`."""

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline, make_interp_spline

from underskin.autodiff import Differentiated, as_columns, contiguous, unfilled
from underskin.units import Array, Floats, Indices

_DEGREE = 3
_RADIAL, _ANGULAR = 10, 20  # quadrature over a disc


class CubicAxis:
    """The cubic splines through values at `nodes`, and where their cells are.

    Attributes
    ----------
    nodes : ndarray, (nodes,)
    to_coefficients : ndarray, (functions, nodes)
    starts, lower, first, cubics, limits, buckets : ndarray
        As `spline_kernel` describes them, of this axis alone.
    """

    def __init__(self, nodes: Floats) -> None:
        """Write each basis function of each cell as a cubic in the distance from the cell's lower knot."""
        self.nodes = nodes
        interpolating = make_interp_spline(nodes, np.eye(len(nodes)), k=_DEGREE)
        self.to_coefficients = np.asarray(interpolating.c)
        knots = np.asarray(interpolating.t)
        lower = knots[_DEGREE : -_DEGREE - 1]
        basis = BSpline(knots, np.eye(len(nodes)), _DEGREE)
        powers = [np.asarray(basis(lower, nu=order)) / math.factorial(order) for order in range(4)]
        cells = np.arange(len(lower))[:, None]
        cubics = np.stack([power[cells, cells + np.arange(4)] for power in powers], axis=1)
        of_spline = np.clip(np.arange(len(nodes)) - 1, 0, len(lower) - 1)
        self._locate(nodes, lower[of_spline], of_spline, cubics[of_spline])

    def _locate(self, nodes: Floats, lower: Floats, first: Array, cubics: Floats) -> None:
        """Set the compiled functions' arrays; the parts are half as long as the shortest cell."""
        self.starts, self.lower, self.first, self.cubics = np.append(nodes[:-1], np.inf), lower, first, cubics
        scale = 2 / float(np.diff(nodes).min())
        self.limits = [nodes[0], nodes[-1], scale]
        parts = ((nodes - nodes[0]) * scale).astype(np.int64)
        self.buckets = np.searchsorted(parts[1:-1], np.arange(parts[-1] + 1))

    def coefficients(self, values: Floats, axis: int) -> Floats:
        """The spline's coefficients, along one axis of the values."""
        return np.moveaxis(np.tensordot(self.to_coefficients, values, (1, axis)), 0, axis)

    def disc_averages(self, offsets: Floats, disc_radius: float) -> Floats:
        """The matrix (offsets, nodes) that averages a radial profile, given at the nodes, over discs beside its axis.

        Beyond the last node the profile is 0.
        """
        from underskin.surrogate.spline_kernel import disc_averages

        x, weight = np.polynomial.legendre.leggauss(_RADIAL)
        radius = disc_radius * (x + 1) / 2
        cosine = np.cos(np.pi * (np.arange(_ANGULAR) + 0.5) / _ANGULAR)
        total = np.zeros((len(offsets), len(self.nodes)))
        disc_averages(joined([self]), contiguous(offsets), radius, weight * (x + 1) / 2 / _ANGULAR, cosine, total)
        return total @ self.to_coefficients


class _Constant(CubicAxis):
    """The axis of a single function, 1."""

    def __init__(self) -> None:
        cubics = np.zeros((2, 4, 4))
        cubics[:, 0, 0] = 1.0
        self._locate(np.arange(2.0), np.zeros(2), np.zeros(2, dtype=np.int64), cubics)


def joined(axes: Sequence[CubicAxis]) -> tuple[Array, ...]:
    """The arrays of several axes as `spline_kernel` takes them."""
    begin = np.cumsum([[0, 0], *([len(axis.starts), len(axis.buckets)] for axis in axes)], axis=0)[:-1]
    return (
        np.concatenate([axis.starts for axis in axes]),
        np.concatenate([axis.lower for axis in axes]),
        np.concatenate([axis.first for axis in axes]).astype(np.int64),
        np.concatenate([axis.cubics for axis in axes]),
        np.array([axis.limits for axis in axes]),
        np.concatenate([axis.buckets + cell for axis, (cell, _) in zip(axes, begin, strict=True)]).astype(np.int64),
        begin.astype(np.int64),
    )


class TensorSpline:
    """s(x₁, x₂, …) = Σ c_ij… b_i(x₁) b_j(x₂) … of three or four axes.

    Attributes
    ----------
    axes : sequence of CubicAxis
    coefficients : ndarray
        (functions of each axis), of four axes: before three there is one of a single function.
    """

    def __init__(self, axes: Sequence[CubicAxis], coefficients: Floats) -> None:
        """The spline of these coefficients."""
        self.axes = axes
        self.coefficients = contiguous(coefficients.reshape(*(1,) * (4 - coefficients.ndim), *coefficients.shape))

    @classmethod
    def through(cls, nodes: Sequence[Floats], values: Floats) -> "TensorSpline":
        """The spline through values on the grid of these nodes."""
        axes = [CubicAxis(along) for along in nodes]
        for number, axis in enumerate(axes):
            values = axis.coefficients(values, number)
        return cls(axes, values)

    @cached_property
    def compiled(self) -> tuple[Floats, tuple[Array, ...]]:
        """Its coefficients and axes as `spline_kernel` takes them."""
        constant = [_Constant()] * (4 - len(self.axes))
        return self.coefficients, joined([*constant, *self.axes])

    def at_point(self, *point: float) -> tuple[float, tuple[int, ...]]:
        """The value at one point and the cells that hold it; NaN outside the nodes.

        Without compiled code, which takes half a second to load, and in the order of `spline_kernel.sigma_rows`: the
        bits are the same.
        """
        if not all(axis.nodes[0] <= x <= axis.nodes[-1] for axis, x in zip(self.axes, point, strict=True)):
            return math.nan, (0,) * len(point)
        cells = [int(np.searchsorted(axis.nodes[1:-1], x, "right")) for axis, x in zip(self.axes, point, strict=True)]
        value = self.coefficients[(0,) * (4 - len(point))]
        for number, (axis, cell) in enumerate(zip(self.axes, cells, strict=True)):
            low = int(axis.first[cell])
            value = np.take(value, range(low, low + _DEGREE + 1), axis=number)
        for axis, cell, x in reversed([*zip(self.axes, cells, point, strict=True)]):
            u, (c0, c1, c2, c3) = x - axis.lower[cell], axis.cubics[cell]
            terms = value * (c0 + u * (c1 + u * (c2 + u * c3)))
            value = terms[..., 0] + terms[..., 1] + terms[..., 2] + terms[..., 3]
        return float(value), tuple(cells)

    def at(self, *variables: Differentiated, chosen: Indices | None = None, end: float = math.inf) -> Differentiated:
        """Values (…, rows) at the variables (…, rows), one for each axis, with derivatives.

        It is continued along its tangent beyond the nodes, and is 0 where the last variable is beyond `end`. With
        `chosen` (rows,) the first two of four variables hold further entries, of which each row takes one.
        """
        from underskin.surrogate.spline_kernel import spline_rows

        if chosen is None:
            shape = np.broadcast_shapes(*(variable.value.shape for variable in variables))
            chosen = np.arange(shape[-1])
        points = np.broadcast_shapes(*(variable.value.shape[:-1] for variable in variables))
        parameters = len(variables[0].slopes)
        result = unfilled(parameters, (*points, len(chosen)))
        constant = [Differentiated(np.zeros((1, 1)), np.zeros((parameters, 1, 1)))] * (4 - len(variables))
        columns = [array for variable in (*constant, *variables, result) for array in as_columns(variable)]
        spline_rows(*self.compiled, end, chosen, *columns)
        return result

    def values(self, *columns: ArrayLike) -> Floats:
        """Values at columns of each variable, which broadcast; NaN outside the nodes."""
        return self._at_columns(columns, np.empty((len(columns), 0, 1, 1))).value

    def gradient(self, *columns: ArrayLike) -> Floats:
        """Derivatives by each variable along the first axis, as `values`."""
        return self._at_columns(columns, np.eye(len(columns))[:, :, None, None]).slopes

    def _at_columns(self, columns: Sequence[ArrayLike], slopes: Floats) -> Differentiated:
        arrays = [np.asarray(column, dtype=float) for column in columns]
        shape = np.broadcast_shapes(*(array.shape for array in arrays))
        given = [np.broadcast_to(array, shape) for array in arrays]
        result = self.at(*(Differentiated(x.reshape(1, -1), by) for x, by in zip(given, slopes, strict=True)))
        outside = np.zeros(shape, dtype=bool)
        for axis, column in zip(self.axes, given, strict=True):
            outside |= ~((column >= axis.nodes[0]) & (column <= axis.nodes[-1]))
        value, by_column = result.value.reshape(shape), result.slopes.reshape(len(result.slopes), *shape)
        value[outside] = by_column[:, outside] = np.nan
        return Differentiated(value, by_column)
