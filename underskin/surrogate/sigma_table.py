"""Contact models: the radius of a sphere's contact with the skin, and σ(a/h, rT/h, L) with derivatives, error and
domain; and the one from the finite-element table of σ under a dead Hertz pressure, `paper`.

a/h is that of the contact at small strain, at the given force; L = F/(R² E) measures finite strain. A cubic spline in
a/h, rT/h and L^(1/3) interpolates σ at nodes; σ is smooth in L^(1/3), which is proportional to the strain (a/R,
Seminara 2018, equation 16). Rows outside the domain are NaN, never extrapolated.

The splines are tensor products of cubic ones through values on a grid (not-a-knot ends), evaluated by `spline_kernel`.
"""

import math
import sys
from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline, make_interp_spline

from underskin.autodiff import Differentiated, as_columns, contiguous, unfilled
from underskin.physics import hertz
from underskin.physics.charge_response import Sigma
from underskin.surrogate.hdf5_format import SIGMA_SCHEMA, Table, tables_folder
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

    def functions(self, x: float) -> tuple[int, int, list[float]]:
        """The cell that holds x, which lies within the nodes, the first of the four functions there, their values."""
        inner, cells = self._floats
        cell = bisect_right(inner, x)
        first, lower, cubics = cells[cell]
        u = x - lower
        return cell, first, [c0 + u * (c1 + u * (c2 + u * c3)) for c0, c1, c2, c3 in cubics]

    @cached_property
    def _floats(self) -> tuple[list[float], list[tuple[int, float, list[list[float]]]]]:
        """The inner nodes; of each cell the first function, its lower end, its cubics (functions, powers)."""
        cubics = self.cubics.swapaxes(1, 2).tolist()
        cells = list(zip(self.first.tolist(), self.lower.tolist(), cubics, strict=True))
        return self.nodes[1:-1].tolist(), cells

    def coefficients(self, values: Floats, axis: int) -> Floats:
        """The spline's coefficients, along one axis of the values.

        Summed without BLAS, whose last bits depend on the number of its threads: a server and a script answer alike.
        """
        return np.moveaxis(np.einsum("ij,j...->i...", self.to_coefficients, np.moveaxis(values, axis, 0)), 0, axis)

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

        In plain floats, faster for one point than arrays and without compiled code, which takes half a second to load;
        in the order of `spline_kernel.sigma_rows`, so that the bits are the same.
        """
        if not all(axis.nodes[0] <= x <= axis.nodes[-1] for axis, x in zip(self.axes, point, strict=True)):
            return math.nan, (0,) * len(point)
        cells, firsts, weights = zip(*map(CubicAxis.functions, self.axes, point), strict=True)
        within = self.coefficients[(0,) * (4 - len(point)) + tuple(slice(first, first + 4) for first in firsts)]
        values = within.ravel().tolist()
        for w0, w1, w2, w3 in reversed(weights):
            fours = zip(values[::4], values[1::4], values[2::4], values[3::4], strict=True)
            values = [v0 * w0 + v1 * w1 + v2 * w2 + v3 * w3 for v0, v1, v2, v3 in fours]
        return values[0], cells

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


ContactName = Literal["paper", "solved"]


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

    def _tabulate(
        self, axes: tuple[Floats, Floats, Floats], sigma: Floats, rel_error: Floats, radii: Floats, profile: Floats
    ) -> None:
        """Set up the splines of σ and the profile (a/h, radii, L^(1/3)), and the bound on σ's error in each cell."""
        self.axes = axes
        self._sigma = TensorSpline.through(axes, sigma)
        self._cell_error = _largest_at_corners(rel_error)
        self._radii = radii
        self._profile = TensorSpline.through((axes[0], radii, axes[2]), profile)
        self._over_radius = make_interp_spline(radii, np.moveaxis(profile, 1, 0), k=3)

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
        return float(self._radii[-1])

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
        columns = np.asarray(a_over_h, dtype=float), np.asarray(rt_over_h, dtype=float), np.cbrt(load_parameter)
        shape = np.broadcast_shapes(*(column.shape for column in columns))
        if math.prod(shape) == 1:
            sigma, rel_error = (np.full(shape, x) for x in self._at_point(*(column.item() for column in columns)))
            return Sigma(sigma, rel_error, np.isfinite(sigma))
        from underskin.surrogate.spline_kernel import sigma_rows

        full = (c if c.size == 1 or c.shape == shape else np.broadcast_to(c, shape) for c in columns)
        sigma, rel_error = np.empty(shape), np.empty(shape)
        flat = (contiguous(column.ravel()) for column in full)
        sigma_rows(*self._sigma.compiled, self._cell_error, *flat, sigma.ravel(), rel_error.ravel())
        return Sigma(sigma, rel_error, np.isfinite(sigma))

    def at(self, a_over_h: float, rt_over_h: float, load_parameter: float = 0.0) -> tuple[float, float] | None:
        """σ and the bound on its relative error at one point; None outside the domain."""
        sigma, rel_error = self._at_point(a_over_h, rt_over_h, math.cbrt(load_parameter))
        return None if math.isnan(sigma) else (sigma, rel_error)

    def _at_point(self, *point: float) -> tuple[float, float]:
        """σ and the bound at a/h, rT/h and L^(1/3), NaN outside: by compiled code where that is loaded, since it is
        faster; the bits are the same."""
        sigma_rows = getattr(sys.modules.get("underskin.surrogate.spline_kernel"), "sigma_rows", None)
        if sigma_rows is None:
            sigma, cell = self._sigma.at_point(*point)
            return sigma, math.nan if math.isnan(sigma) else float(self._cell_error[cell])
        at, answer = np.array(point), np.empty(2)
        sigma_rows(*self._sigma.compiled, self._cell_error, at[:1], at[1:2], at[2:], answer[:1], answer[1:])
        sigma, rel_error = answer.tolist()
        return sigma, rel_error

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
        x = np.cbrt(load_parameter)
        by_a, by_rho, by_x = self._sigma.gradient(a_over_h, rt_over_h, x)
        with np.errstate(divide="ignore"):
            return by_a, by_rho, by_x / (3 * x**2)

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
        return self._profile.values(a_over_h, r_over_h, np.cbrt(load_parameter))

    def profile_over(self, r_over_h: Floats) -> Floats:
        """The profile at distances inside the domain (r,), for all contacts of `contact_axes`: (a, L^(1/3), r)."""
        return np.moveaxis(np.asarray(self._over_radius(r_over_h)), 0, -1)

    @property
    def contact_axes(self) -> tuple[Floats, Floats]:
        """a/h and L^(1/3) of the contacts whose profiles the table holds."""
        return self.axes[0], self.axes[2]


def _largest_at_corners(values: Floats) -> Floats:
    """The largest value at the corners of each cell of the grid."""
    for axis in range(values.ndim):
        count = values.shape[axis]
        low, high = (np.take(values, range(first, count - 1 + first), axis=axis) for first in (0, 1))
        values = np.maximum(low, high)
    return values


SIGMA_TABLE = "sigma.h5"


class SigmaTable(ContactModel, Table):
    """A verified table of the transmission factor σ(a/h, rT/h, L) and of the stress profile on the base.

    The contact is Hertz' on a half space.
    """

    name = "paper"
    schema = SIGMA_SCHEMA

    def _take(self, data: Mapping[str, Floats]) -> None:
        axes = data["sigma/a_over_h"], data["sigma/rt_over_h"], data["sigma/cbrt_load_parameter"]
        rel_error = data["sigma/discretisation_error"] + data["sigma/interpolation_error"]
        self._tabulate(axes, data["sigma/sigma"], rel_error, data["profile/r_over_h"], data["profile/profile"])
        self.fem_linear_error = data["sigma/fem_linear_error"]

    def radius(
        self, force: Floats, indenter_radius: Floats, youngs_modulus: Floats, poisson_ratio: Floats, thickness: Floats
    ) -> ContactRadius:
        """Hertz' radius, which finite strain does not change."""
        a = hertz.contact_radius(force, indenter_radius, youngs_modulus, poisson_ratio)
        return ContactRadius(a / thickness, a)

    def load_over_cube(self, a_over_h: Floats) -> tuple[Floats, Floats]:
        """4/3 and 1/3, by Hertz."""
        return np.full_like(a_over_h, 4 / 3), np.full_like(a_over_h, 1 / 3)


def load_table(path: Path | None = None) -> SigmaTable:
    """The σ table at `path`, or the default one; raises TableError with the reason.

    It is read again where its file's time of change is another; `SigmaTable` reads it in any case.
    """
    path = path or tables_folder() / SIGMA_TABLE
    try:
        changed_ns = path.stat().st_mtime_ns
    except OSError:
        changed_ns = 0
    return _of_file(path, changed_ns)


@lru_cache(maxsize=1)
def _of_file(path: Path, _changed_ns: int) -> SigmaTable:
    """A table, read once until its file changes: to read and verify it takes a quarter of a second."""
    return SigmaTable(path)
