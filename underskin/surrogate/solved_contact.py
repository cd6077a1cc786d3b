"""A rigid sphere in frictionless contact with the bonded incompressible layer itself, as a contact model: `solved`.

The contact of the linear layer at the given force is exact at nodes (elastic_layer): its radius α = a/h, where with
P = F R/(E' h³) P = (4/3) α³ A(α), A(0) = 1; the transform p̂ of its pressure; and with M of the bonded layer the stress
on the base (hankel_transform). A is interpolated by a spline, and beyond the last node α is continued as a power of P,
sufficient to state how far a contact is beyond a limit. What finite strain adds is in the contact table, over α and
L^(1/3), L = F/(R² E):

    σ(α, ρ, L) = (1/3) ∫ p̂(k) M(k) [2 J1(kρ)/(kρ)] k dk + (2/ρ²) ∫₀^ρ correction(r; α, L) r dr

Both are tabulated at the nodes of one spline, once in a process. The mechanism `layered_contact` has the same σ, with
derivatives by more parameters (underskin/mechanisms/models/sigma_curves.py).
"""

from functools import lru_cache
from pathlib import Path

import numpy as np
from scipy.interpolate import RectBivariateSpline, make_interp_spline
from scipy.special import j0

from underskin.physics.charge_response import INCOMPRESSIBLE
from underskin.physics.elastic_layer import LARGEST_A_OVER_H, ContactEquation, Layer, mode_transforms
from underskin.physics.hankel_transform import disc_average, wave_numbers
from underskin.surrogate.hdf5_format import CONTACT_TABLE, ContactTable, load_contact
from underskin.surrogate.sigma_table import ContactModel, ContactName, ContactRadius, SigmaTable
from underskin.units import Floats

_NODES = 97


class LayeredRadius:
    """α of P, and P of α; solving takes hundredths of a second."""

    def __init__(self) -> None:
        """Solve at the nodes, which are densest at small contacts."""
        alpha = LARGEST_A_OVER_H * np.linspace(0.0, 1.0, _NODES) ** 1.5
        force = np.append(1.0, ContactEquation(alpha[1:]).solve(Layer()).sphere_force.value)
        self._ratio = make_interp_spline(alpha, force, k=3)
        root = np.cbrt(4 / 3 * force)  # of P, over α
        self._end = float(alpha[-1] * root[-1])
        self._over_root = make_interp_spline(alpha * root, 1 / root, k=3)
        self._power = 1 / float(self.log_slope(np.array(LARGEST_A_OVER_H)))  # exponent of α in P at the end

    def alpha(self, load: Floats) -> Floats:
        """a/h of P."""
        root = np.cbrt(load)
        inside = np.minimum(root, self._end)
        return np.asarray(inside * self._over_root(inside) * (root / inside) ** (3 / self._power))

    def load_over_cube(self, alpha: Floats) -> Floats:
        """P/α³ of α = a/h."""
        inside = np.minimum(alpha, LARGEST_A_OVER_H)
        return np.asarray(4 / 3 * self._ratio(inside) * (alpha / inside) ** (self._power - 3))

    def log_slope(self, alpha: Floats) -> Floats:
        """d ln α/d ln P: 1/3 for small contacts, less for wide ones."""
        inside = np.minimum(alpha, LARGEST_A_OVER_H)
        return np.asarray(1 / (3 + inside * self._ratio(inside, nu=1) / self._ratio(inside)))


_RHO = 3.0 * np.linspace(0.0, 1.0, 65) ** 1.5  # rT/h of the nodes: as far as the σ table's
_DISC_POINTS = 12  # of Gauss' rule along the disc's radius
_SPLINE_ERROR = 1e-6  # largest relative one of the linear contact's σ (tests/surrogate/test_solved_contact.py)


class SolvedContact(ContactModel):
    """The contact with the layer itself, by its table."""

    name = "solved"

    def __init__(self, table: ContactTable) -> None:
        """Tabulate; takes tenths of a second."""
        self.sha256 = table.sha256
        self._linear_radius = LayeredRadius()
        nodes, cbrt_load, _ = table.axes
        a, r = (np.sort(np.append(axis, (axis[1:] + axis[:-1]) / 2)) for axis in (nodes, table.axes[2]))
        linear, profile = linear_contact(a, _RHO, r)
        # A spline over the table's nodes is also one over these.
        added = make_interp_spline(nodes, _disc_mean(table, _RHO), k=3)(a)
        error = make_interp_spline(nodes, _disc_maximum(table, _RHO), k=1)(a)
        sigma = linear[:, :, None] + added
        profile = profile[:, :, None] + make_interp_spline(nodes, table.profile_over(r).swapaxes(1, 2), k=3)(a)
        self._tabulate((a, _RHO, cbrt_load), sigma, error / sigma + _SPLINE_ERROR, r, profile)
        self._radius_ratio = RectBivariateSpline(nodes, cbrt_load, table.contact_radius, s=0)

    def radius(
        self, force: Floats, indenter_radius: Floats, youngs_modulus: Floats, poisson_ratio: Floats, thickness: Floats
    ) -> ContactRadius:
        """NaN where ν is not 0.5; outside the table the radius is that at small strain."""
        load = force * indenter_radius * (1 - INCOMPRESSIBLE**2) / (youngs_modulus * thickness**3)
        a = np.where(poisson_ratio == INCOMPRESSIBLE, self._linear_radius.alpha(load), np.nan)
        cbrt_load = np.cbrt(force / (indenter_radius**2 * youngs_modulus))
        inside = (a <= self.axes[0][-1]) & (cbrt_load <= self.axes[2][-1])
        ratio = np.where(inside, self._radius_ratio.ev(np.where(inside, a, 0.0), np.where(inside, cbrt_load, 0.0)), 1.0)
        return ContactRadius(a, a * ratio * thickness)

    def load_over_cube(self, a_over_h: Floats) -> tuple[Floats, Floats]:
        """P/(a/h)³ and d ln a/d ln P of the linear layer's contact."""
        return self._linear_radius.load_over_cube(a_over_h), self._linear_radius.log_slope(a_over_h)


def contact_model(table: SigmaTable, name: ContactName) -> ContactModel:
    """The contact of this name: `paper`, the σ table itself, or `solved`, of the contact table in the same folder.

    Raises TableError where that cannot be read.
    """
    return table if name == "paper" else solved_contact(table.path.parent / CONTACT_TABLE)


@lru_cache(maxsize=2)
def solved_contact(path: Path | None = None) -> SolvedContact:
    """The solved contact by the contact table at `path`, or the default one; raises TableError with the reason."""
    return SolvedContact(load_contact(path))


def linear_contact(a: Floats, rho: Floats, r: Floats) -> tuple[Floats, Floats]:
    """Stress on discs (a, rho) and on the base (a, r) under contacts a/h, from 0 on, with the linear layer."""
    k, weight = wave_numbers(float(a[-1] + max(rho[-1], r[-1])))
    equation = ContactEquation(a[1:])
    modes = mode_transforms(np.multiply.outer(a[1:], k), equation.modes)
    pressure = np.einsum("akn,an->ak", modes, equation.solve(Layer()).sphere_shape.value)
    passed = np.vstack([np.ones_like(k), pressure]) * (Layer().transmission(k).value * k / 3 * weight)
    return passed @ disc_average(np.outer(k, rho)), passed @ j0(np.outer(k, r))


def _disc_mean(table: ContactTable, rho: Floats) -> Floats:
    """The mean of the correction over discs (a, rho, L^(1/3))."""
    x, weight = np.polynomial.legendre.leggauss(_DISC_POINTS)
    radii = np.outer(rho, (1 + x) / 2)
    profile = table.profile_over(radii.ravel())
    return np.asarray((profile.reshape(*profile.shape[:2], *radii.shape) @ (weight * (1 + x) / 2)).swapaxes(1, 2))


def _disc_maximum(table: ContactTable, rho: Floats) -> Floats:
    """The largest bound on the correction's error on each disc (a, rho, L^(1/3))."""
    so_far = np.maximum.accumulate(table.correction_error, axis=2)
    last = np.minimum(np.searchsorted(table.axes[2], rho), so_far.shape[2] - 1)
    return so_far[:, :, last].swapaxes(1, 2)
