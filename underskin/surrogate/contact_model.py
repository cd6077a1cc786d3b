"""Contact models: the radius of a sphere's contact with the skin, and σ(a/h, rT/h, L) with derivatives, error and
domain.

a/h is that of the contact at small strain, at the given force; L = F/(R² E) measures finite strain. A cubic spline in
a/h, rT/h and L^(1/3) interpolates σ at nodes; σ is smooth in L^(1/3), which is proportional to the strain (a/R,
Seminara 2018, equation 16). Rows outside the domain are NaN, never extrapolated.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import NdBSpline, make_interp_spline

from underskin.autodiff import contiguous
from underskin.physics.charge_response import Sigma
from underskin.surrogate.point_spline import PointSpline, cell_of, four_functions
from underskin.units import Array, Floats, Indices, Mask

ContactName = Literal["paper", "solved"]
_MANY = 10_000  # rows
_ROWS_AT_ONCE = 100_000  # in one call of a compiled function


@dataclass(frozen=True)
class ContactRadius:
    """`small_strain_over_h`: a/h at small strain, over which σ is tabulated; `radius`: a [m] with finite strain."""

    small_strain_over_h: Floats
    radius: Floats


class ContactModel(ABC):
    """Radius of a sphere's contact, and σ(a/h, rT/h, L) and the stress profile on the base from nodes.

    Attributes
    ----------
    name : str
        The name in requests.
    sha256 : str
        Of its table.
    axes : tuple of ndarray
        a/h, rT/h and L^(1/3) of the nodes.
    """

    name: ClassVar[ContactName]
    sha256: str

    @abstractmethod
    def radius(
        self, force: Floats, indenter_radius: Floats, youngs_modulus: Floats, poisson_ratio: Floats, thickness: Floats
    ) -> ContactRadius:
        """The contact of a force F [N] on a sphere R [m] with a layer of E [Pa], ν and h [m], columns of one shape."""

    @abstractmethod
    def load_over_cube(self, a_over_h: Floats) -> tuple[Floats, Floats]:
        """P/(a/h)³ of the contact at small strain, P = F R (1 − ν²)/(E h³), and d ln a/d ln P."""

    def _tabulate(self, data: Mapping[str, Floats]) -> None:
        """Set up splines of σ, its errors and the profile at nodes, by "group/name" as in the file of the σ table."""
        self.axes = tuple(data[f"sigma/{name}"] for name in ("a_over_h", "rt_over_h", "cbrt_load_parameter"))
        self._sigma = _spline(self.axes, data["sigma/sigma"])
        self._point_sigma = PointSpline(self._sigma)
        self._point_axes = [axis.tolist() for axis in self.axes]
        self._cell_error = _largest_at_corners(data["sigma/discretisation_error"] + data["sigma/interpolation_error"])
        self._profile_axes = (data["profile/a_over_h"], data["profile/r_over_h"], self.axes[2])
        self._profile = _spline(self._profile_axes, data["profile/profile"])
        by_radius = np.moveaxis(data["profile/profile"], 1, 0)
        self._over_radius = make_interp_spline(self._profile_axes[1], by_radius, k=3)

    @property
    def domain(self) -> dict[str, tuple[float, float]]:
        """Lowest and highest a_over_h, rt_over_h and load_parameter, limits included."""
        a, rho, x = self.axes
        return {
            "a_over_h": (float(a[0]), float(a[-1])),
            "rt_over_h": (float(rho[0]), float(rho[-1])),
            "load_parameter": (float(x[0]) ** 3, float(x[-1]) ** 3),
        }

    @property
    def profile_end(self) -> float:
        """The largest r/h of the profile, included."""
        return float(self._profile_axes[1][-1])

    def sigma(self, a_over_h: ArrayLike, rt_over_h: ArrayLike, load_parameter: ArrayLike = 0.0) -> Sigma:
        """The transmission factor: charge = d33 · (3/2) (rT/h)² · σ · F.

        Parameters
        ----------
        a_over_h, rt_over_h
            Contact radius and sensor radius over the thickness [-].
        load_parameter
            L = F/(R² E) [-]; 0 is the linear layer. The arguments broadcast.

        Returns
        -------
        Sigma
            σ, the bound on its relative error, and which rows are inside; NaN where not.
        """
        if max(map(np.size, (a_over_h, rt_over_h, load_parameter))) >= _MANY:
            return self._sigma_of_many(a_over_h, rt_over_h, load_parameter)
        points, inside, shape = _points(self.axes, a_over_h, rt_over_h, load_parameter)
        sigma = self._sigma(points)
        rel_error = self._cell_error[_cells(self.axes, points)]
        outside = ~inside
        if outside.any():
            sigma[outside] = np.nan
            rel_error[outside] = np.nan
        return Sigma(sigma.reshape(shape), rel_error.reshape(shape), inside.reshape(shape))

    def _sigma_of_many(self, a_over_h: ArrayLike, rt_over_h: ArrayLike, load_parameter: ArrayLike) -> Sigma:
        """`sigma` by a compiled function, whose import takes longer than a few rows."""
        from underskin.surrogate.table_kernel import sigma_rows

        columns = np.asarray(a_over_h, dtype=float), np.asarray(rt_over_h, dtype=float), np.cbrt(load_parameter)
        shape = np.broadcast_shapes(*(column.shape for column in columns))
        full = (c if c.size == 1 or c.shape == shape else np.broadcast_to(c, shape) for c in columns)
        flat = [contiguous(column.ravel()) for column in full]
        sigma, rel_error = np.empty(shape), np.empty(shape)
        for start in range(0, sigma.size, _ROWS_AT_ONCE):  # other threads wait for each call
            part = slice(start, start + _ROWS_AT_ONCE)
            sigma_rows(
                self._point_sigma.cubics,
                self._cell_error,
                *self._cells_of_axes,
                *(column if column.size == 1 else column[part] for column in flat),
                sigma.ravel()[part],
                rel_error.ravel()[part],
            )
        return Sigma(sigma, rel_error, np.isfinite(sigma))

    @cached_property
    def _cells_of_axes(self) -> list[Array]:
        """Arguments of `sigma_rows` for the axes: lookup of the table's cells, and the spline's cells with
        functions."""
        ends, parts = [], []
        for nodes, knots in zip(self.axes, self._sigma.t, strict=True):
            starts, buckets, scale = _buckets(nodes)
            ends.append([nodes[0], nodes[-1], scale])
            functions = np.ascontiguousarray(four_functions(knots).transpose(0, 2, 1))
            parts += [starts, buckets, contiguous(knots[3:-3]), functions]
        return [np.array(ends), *parts[:-1]]  # along x the spline is in cubics

    def at(self, a_over_h: float, rt_over_h: float, load_parameter: float = 0.0) -> tuple[float, float] | None:
        """σ and the bound on its relative error at one point, without the cost of arrays; None outside the domain."""
        point = (a_over_h, rt_over_h, math.cbrt(load_parameter))
        cell = self._point_sigma.cell(*point)
        if cell is None:
            return None
        # The spline's cells differ from the table's: next to the ends one spans two of them (not-a-knot).
        a, rho, x = map(cell_of, self._point_axes, point)
        return self._point_sigma.value(cell, *point), float(self._cell_error[a, rho, x])

    def gradient(
        self, a_over_h: ArrayLike, rt_over_h: ArrayLike, load_parameter: ArrayLike = 0.0
    ) -> tuple[Floats, Floats, Floats]:
        """The derivatives of σ.

        Parameters
        ----------
        a_over_h, rt_over_h, load_parameter
            As for `sigma`.

        Returns
        -------
        tuple
            ∂σ/∂(a/h), ∂σ/∂(rT/h) and ∂σ/∂L, NaN outside the domain. ∂σ/∂L is infinite at L = 0, where σ grows like
            L^(1/3).
        """
        points, inside, shape = _points(self.axes, a_over_h, rt_over_h, load_parameter)
        slopes = [self._sigma(points, nu=order) for order in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
        with np.errstate(divide="ignore"):
            slopes[2] = slopes[2] / (3 * points[:, 2] ** 2)
        da, drho, dload = (np.where(inside, slope, np.nan).reshape(shape) for slope in slopes)
        return da, drho, dload

    def profile(self, r_over_h: ArrayLike, a_over_h: ArrayLike, load_parameter: ArrayLike = 0.0) -> Floats:
        """The normal stress on the base: T3 = −(3F/2πh²) · profile. A sensor averages it over its disc.

        Parameters
        ----------
        r_over_h
            Distance from the contact's axis over the thickness [-].
        a_over_h, load_parameter
            As for `sigma`; the arguments broadcast.

        Returns
        -------
        array
            In σ's scale, NaN outside the domain.
        """
        points, inside, shape = _points(self._profile_axes, a_over_h, r_over_h, load_parameter)
        return np.where(inside, self._profile(points), np.nan).reshape(shape)

    def profile_over(self, r_over_h: Floats) -> Floats:
        """The profile at distances inside the domain (r,), for all contacts of `contact_axes`: (a, L^(1/3), r)."""
        return np.moveaxis(np.asarray(self._over_radius(r_over_h)), 0, -1)

    @property
    def contact_axes(self) -> tuple[Floats, Floats]:
        """a/h and L^(1/3) of the contacts whose profiles the table holds."""
        return self._profile_axes[0], self._profile_axes[2]


def interpolation_coefficients(axes: Sequence[Floats], values: Floats) -> tuple[tuple[Floats, ...], Floats]:
    """Knots and coefficients of the cubic spline through values on a grid (not-a-knot ends)."""
    knots = []
    for axis, nodes in enumerate(axes):
        spline = make_interp_spline(nodes, values, k=3, axis=axis)
        knots.append(np.asarray(spline.t))
        values = np.moveaxis(np.asarray(spline.c), 0, axis)
    return tuple(knots), values


def _spline(axes: Sequence[Floats], values: Floats) -> NdBSpline:
    knots, coefficients = interpolation_coefficients(axes, values)
    return NdBSpline(knots, np.ascontiguousarray(coefficients), 3)


def _points(
    axes: Sequence[Floats], a_over_h: ArrayLike, second: ArrayLike, load_parameter: ArrayLike
) -> tuple[Floats, Mask, tuple[int, ...]]:
    """Grid coordinates (rows, 3), which rows are inside, and the broadcast shape; outside rows are moved inside."""
    columns = np.broadcast_arrays(
        np.asarray(a_over_h, dtype=float), np.asarray(second, dtype=float), np.cbrt(load_parameter)
    )
    points = np.stack([column.ravel() for column in columns], axis=-1)
    low = np.array([axis[0] for axis in axes])
    high = np.array([axis[-1] for axis in axes])
    inside: Mask = np.all((points >= low) & (points <= high), axis=1)
    if not inside.all():
        points[~inside] = low
    return points, inside, columns[0].shape


def _buckets(nodes: Floats) -> tuple[Floats, NDArray[np.int64], float]:
    """The starts of an axis' cells, then infinity; the cell before each part of the axis; and the parts per unit.

    The parts are half as long as the shortest cell, so that at most one cell starts in each.
    """
    scale = 2 / float(np.diff(nodes).min())
    parts = ((nodes - nodes[0]) * scale).astype(np.int64)
    before = np.searchsorted(parts[1:-1], np.arange(parts[-1] + 1))
    return np.append(nodes[:-1], np.inf), before.astype(np.int64), scale


def _cells(axes: Sequence[Floats], points: Floats) -> tuple[Indices, ...]:
    return tuple(np.searchsorted(axis[1:-1], points[:, index], side="right") for index, axis in enumerate(axes))


def _largest_at_corners(values: Floats) -> Floats:
    """The largest value at the corners of each cell of the grid."""
    for axis in range(values.ndim):
        count = values.shape[axis]
        low, high = (np.take(values, range(first, count - 1 + first), axis=axis) for first in (0, 1))
        values = np.maximum(low, high)
    return values
