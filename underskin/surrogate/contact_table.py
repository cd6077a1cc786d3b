"""The correction by finite strain and friction to the exact linear layer's contact with a rigid frictionless sphere.

A sphere of radius R is pressed with the force F into the bonded layer. All is over α = a/h of the linear layer's
frictionless contact at the same F, R, E, ν, h, and x = L^(1/3), L = F/(R² E) · (0.75/(1 − ν²))². The correction of the
incompressible neo-Hookean layer is the solved stress on the base less that of the linear contact. Over c₂ of Yeoh's
energy, (G/2)(K + c₂ K²), K = I₁ − 3, over ν, and for a sphere that sticks the table holds what is added to that
correction.
"""

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline, make_interp_spline

from underskin.physics.sphere_law import FULL_SPHERE_OF_LOAD
from underskin.surrogate.hdf5_format import CONTACT_SCHEMA, Table
from underskin.surrogate.sigma_table import tables_folder
from underskin.units import Floats

CONTACT_TABLE = "contact.h5"
_STATE = "frictionless"
# The group of each further property
_FURTHER = {"second_over_first": "yeoh", "poisson_ratio": "compressible", "friction": "sticking"}


class ContactTable(Table):
    """A verified table of the corrections.

    Attributes
    ----------
    axes : tuple of ndarray
        a/h of the linear contact, L^(1/3) and r/h.
    correction_error : ndarray, (a, L^(1/3), r)
        Bound on the absolute error of the correction, in σ's scale.
    contact_radius, indentation, stiffness : ndarray, (a, L^(1/3))
        Over those of the linear layer at the same force.
    """

    schema = CONTACT_SCHEMA

    def _take(self, data: Mapping[str, Floats]) -> None:
        state = {name.partition("/")[2]: values for name, values in data.items() if name.startswith(f"{_STATE}/")}
        self.axes = state["a_over_h"], state["cbrt_load_parameter"], state["r_over_h"]
        self.correction_error = state["correction_error"]
        self.contact_radius, self.indentation = state["contact_radius"], state["indentation"]
        self.stiffness = state["stiffness"]
        x = self.axes[1][1:, None]
        coefficients = np.linalg.lstsq(x ** np.array([1.0, 2.0, 3.0]), self.indentation[:, 1:].T - 1, rcond=None)[0]
        self._softening = CubicSpline(self.axes[0], coefficients.T)
        self._over_radius = make_interp_spline(self.axes[2], state["correction"], k=3, axis=2)
        self._further = {
            name: (
                data[f"{group}/{name}"],
                make_interp_spline(self.axes[2], data[f"{group}/correction"], k=3, axis=3),
            )
            for name, group in _FURTHER.items()
        }

    @property
    def domain(self) -> dict[str, tuple[float, float]]:
        """Lowest and highest a_over_h, load_parameter and r_over_h, limits included."""
        a, x, r = self.axes
        return {
            "a_over_h": (float(a[0]), float(a[-1])),
            "load_parameter": (float(x[0]) ** 3, float(x[-1]) ** 3),
            "r_over_h": (float(r[0]), float(r[-1])),
        }

    @property
    def contact_axes(self) -> tuple[Floats, Floats]:
        """a/h and L^(1/3) of the contacts that the table holds."""
        return self.axes[0], self.axes[1]

    def profile_over(self, r_over_h: Floats) -> Floats:
        """The correction at distances inside the domain (radii,), for all of `contact_axes`: (a, L^(1/3), radii).

        In σ's scale: T3 = −(3F/2πh²) · (linear contact + correction).
        """
        return np.asarray(self._over_radius(r_over_h))

    def further_profiles_over(self, name: str, r_over_h: Floats) -> tuple[Floats, Floats]:
        """The nodes of a further property, `second_over_first`, `poisson_ratio` or `friction`, and what is added at
        each of them at these distances (radii,): (nodes, a, L^(1/3), radii)."""
        nodes, over_radius = self._further[name]
        return nodes, np.asarray(over_radius(r_over_h))

    def softening_coefficients(self, a_over_h: Floats) -> Floats:
        """p0, p1 and p2 (…, 3) of δ/δ_linear − 1 = x (p0 + p1 x + p2 x²) at the same force, x = L^(1/3).

        Within 2e-5 of the table at its nodes; wider contacts have the value of the last a/h.
        """
        return np.asarray(self._softening(np.minimum(a_over_h, self.axes[0][-1])))

    def softening(self, a_over_h: Floats, cbrt_load: Floats, full_sphere: bool) -> Floats:
        """δ/δ_linear − 1 at the same force; larger L have the value of the last one.

        The linear contact is that of a paraboloid, or with `full_sphere` of the full sphere.
        """
        x = np.minimum(cbrt_load, self.axes[1][-1])
        p0, p1, p2 = np.moveaxis(self.softening_coefficients(a_over_h), -1, 0)
        return np.asarray(x * (p0 + x * (p1 - (FULL_SPHERE_OF_LOAD if full_sphere else 0.0) + x * p2)))


def load_contact(path: Path | None = None) -> ContactTable:
    """The contact table at `path`, or the default one, read once; raises TableError with the reason."""
    return _read(path or tables_folder() / CONTACT_TABLE)


@lru_cache(maxsize=2)
def _read(path: Path) -> ContactTable:
    return ContactTable(path)
