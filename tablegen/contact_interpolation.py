"""Contact radius, indentation, stiffness and σ of a sphere on the finite-strain layer, interpolated in `contact.h5`.

No answer is computed from them: they are what the base model's contact (Hertz) and the mechanism `layered_contact` are
compared with.

A rigid frictionless sphere of radius R is pressed with the force F into an incompressible neo-Hookean layer bonded to a
rigid base; L = F/(R² E). Splines of degree 5 in ln(R/h), L^(1/3) and rT/h. Rows outside the domain are NaN.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import NdBSpline, make_interp_spline

from underskin.physics import hertz
from underskin.surrogate.contact_table import ContactTable
from underskin.units import Floats

_DEGREE = 5
_RATIOS = ("contact_radius", "indentation", "stiffness")
_STRESSES = ("sigma", "sigma_increment")
_CONTACT_FIELDS = (
    *("a_over_h", "indentation_over_h", "stiffness"),
    *("a_error", "indentation_error", "stiffness_error"),
)
_STRESS_FIELDS = (*_STRESSES, "sigma_error", "sigma_increment_error")


@dataclass(frozen=True)
class PressedContact:
    """What presses: equal shapes, NaN outside the table.

    `a_over_h`, `indentation_over_h`; `stiffness` = dF/dδ over E h; the errors are relative.
    """

    a_over_h: Floats
    indentation_over_h: Floats
    stiffness: Floats
    a_error: Floats
    indentation_error: Floats
    stiffness_error: Floats
    inside: NDArray[np.bool_]


@dataclass(frozen=True)
class ContactStress:
    """What a centred sensor bears: equal shapes, NaN outside the table.

    `sigma`: mean stress 3Fσ/(2πh²); `sigma_increment`: d(Fσ)/dF at fixed R, the contact's edge moving with the force;
    the errors are absolute.
    """

    sigma: Floats
    sigma_increment: Floats
    sigma_error: Floats
    sigma_increment_error: Floats
    inside: NDArray[np.bool_]


class ContactInterpolation(ContactTable):
    """Splines through the nodes of a verified table of contacts."""

    def _take(self, data: Mapping[str, Floats]) -> None:
        super()._take(data)
        self._contact = _Splines(self._spline_axes[:2], [data[f"contact/{name}"] for name in _RATIOS])
        self._contact_errors = [data[f"contact/{name}_error"] for name in _RATIOS]
        self._stress = _Splines(self._spline_axes, [data[f"stress/{name}"] for name in _STRESSES])
        self._stress_errors = [data[f"stress/{name}_error"] for name in _STRESSES]

    def contact(self, indenter_radius_over_h: ArrayLike, load_parameter: ArrayLike) -> PressedContact:
        """Contact radius, indentation and tangent stiffness of a sphere.

        Parameters
        ----------
        indenter_radius_over_h
            R/h [-].
        load_parameter
            L = F/(R² E) [-]; the arguments broadcast.

        Returns
        -------
        PressedContact
            Ratios to the thickness and relative errors, NaN outside the table.
        """
        radius, load = np.broadcast_arrays(
            np.asarray(indenter_radius_over_h, dtype=float), np.asarray(load_parameter, dtype=float)
        )
        points, inside = self._points(radius, load)
        ratio_a, ratio_depth, ratio_stiffness = self._contact(points)
        errors = _largest_around(self._spline_axes[:2], self._contact_errors, points)
        with np.errstate(invalid="ignore"):
            a = hertz.contact_radius_over_indenter_radius(load) * radius
        columns = (ratio_a * a, ratio_depth * a**2 / radius, ratio_stiffness * 2 * a / 0.75, *errors)
        known = dict(zip(_CONTACT_FIELDS, (np.where(inside, values, np.nan) for values in columns), strict=True))
        return PressedContact(**known, inside=inside)

    def stress(
        self, indenter_radius_over_h: ArrayLike, load_parameter: ArrayLike, rt_over_h: ArrayLike
    ) -> ContactStress:
        """Mean stress on a centred sensor, of the force and of its increment.

        Parameters
        ----------
        indenter_radius_over_h, load_parameter, rt_over_h
            R/h, L and rT/h [-]; the arguments broadcast.

        Returns
        -------
        ContactStress
            In units of 3F/(2πh²), with absolute errors, NaN outside the table.
        """
        columns = np.broadcast_arrays(
            *(np.asarray(x, dtype=float) for x in (indenter_radius_over_h, load_parameter, rt_over_h))
        )
        points, inside = self._points(*columns)
        values = (*self._stress(points), *_largest_around(self._spline_axes, self._stress_errors, points))
        known = dict(zip(_STRESS_FIELDS, (np.where(inside, column, np.nan) for column in values), strict=True))
        return ContactStress(**known, inside=inside)

    @property
    def _spline_axes(self) -> tuple[Floats, ...]:
        return np.log(self.axes[0]), self.axes[1], self.axes[2]

    def _points(self, radius: Floats, load: Floats, *others: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """Spline coordinates (…, axes) and which rows are inside; outside rows are moved inside."""
        with np.errstate(divide="ignore", invalid="ignore"):
            points = np.stack([np.log(radius), np.cbrt(load), *others], axis=-1)
        axes = self._spline_axes[: points.shape[-1]]
        low, high = np.array([axis[0] for axis in axes]), np.array([axis[-1] for axis in axes])
        inside: NDArray[np.bool_] = np.all((points >= low) & (points <= high), axis=-1)
        points[~inside] = low
        return points, inside


class _Splines:
    """Several functions on one grid."""

    def __init__(self, axes: Sequence[Floats], functions: Sequence[Floats]) -> None:
        knots = tuple(np.asarray(make_interp_spline(axis, axis, k=_DEGREE).t) for axis in axes)
        self._splines = [NdBSpline(knots, _coefficients(axes, values), _DEGREE) for values in functions]

    def __call__(self, points: Floats) -> list[Floats]:
        return [np.asarray(spline(points)) for spline in self._splines]


def _coefficients(axes: Sequence[Floats], values: Floats) -> Floats:
    for number, nodes in enumerate(axes):
        values = np.moveaxis(np.asarray(make_interp_spline(nodes, values, k=_DEGREE, axis=number).c), 0, number)
    return np.ascontiguousarray(values)


def _largest_around(axes: Sequence[Floats], errors: Sequence[Floats], points: Floats) -> list[Floats]:
    """The largest of each error at the corners of the points' cells."""
    cells = [np.searchsorted(axis[1:-1], points[..., number], side="right") for number, axis in enumerate(axes)]
    corners = np.stack(np.meshgrid(*[[0, 1]] * len(axes), indexing="ij"), axis=-1).reshape(-1, len(axes))
    at = [tuple(cell + step for cell, step in zip(cells, corner, strict=True)) for corner in corners]
    return [np.max([values[corner] for corner in at], axis=0) for values in errors]
