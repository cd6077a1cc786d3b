"""The pressure under spheres that are pressed into the linear layer without friction, many at once.

On a layer that is thin compared with the contact, the contact is smaller and the pressure more peaked than in Hertz
theory: at a/h = 1 by 9 % of the radius and 10 % of the stress on a sensor beneath (bonded, incompressible). With φ of
the contact equation over its mean, f(x) at x = r/a, where f(1) = 0 without adhesion, the pressure of the force F is

    p(r) = −F/(2πa²) ∫ f'(x)/√(x² − r²/a²) dx     from r/a to 1     (Sneddon; Hertz: f = (3/2)(1 − x²))
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre, polynomial

from underskin.physics.elastic_layer import LARGEST_A_OVER_H, ContactEquation, Layer, curves_of
from underskin.units import Floats

MOST_A_OVER_H = LARGEST_A_OVER_H
_PARTS = 40  # Hertz pressures that make up another one


@dataclass(frozen=True)
class SpherePressure:
    """Pressure of one contact.

    Attributes
    ----------
    radius : float
        Contact radius a [m].
    shape : ndarray, (modes,)
        Legendre coefficients of f, as in `elastic_layer`.
    """

    radius: float
    shape: Floats

    def ring_share(self, t: Floats) -> Floats:
        """Share of the force on the ring at r = a √(1 − t²), per dt: t² ∫₀¹ G(1 − t² + t²v²) dv with G(x²) = −f'(x)/x.

        Parameters
        ----------
        t : ndarray, (points,)
            0 to 1.

        Returns
        -------
        ndarray, (points,)
            3t² in Hertz theory.
        """
        v, weight = np.polynomial.legendre.leggauss(self.shape.size)
        x = np.sqrt(1 - t[:, None] ** 2 * (1 - ((1 + v) / 2) ** 2))
        share: Floats = -(t**2) * (legendre.legval(x, self._derivative()) / x @ weight) / 2
        return share

    def hertz_parts(self) -> tuple[Floats, Floats]:
        """Radii over a and shares of the force of the Hertz pressures whose sum is this one (parts,).

        By parts, with G of `ring_share` and G(1)/3 = 1 in Hertz theory: p is G(1)/3 of the Hertz pressure of radius a,
        and −G'(x) x³/3 dx of that of each radius x a.
        """
        g = -legendre.leg2poly(self._derivative())[1:]
        x, weight = np.polynomial.legendre.leggauss(_PARTS)
        x, weight = (1 + x) / 2, weight / 2
        shares = -polynomial.polyval(x, polynomial.polyder(g)) * x**3 * weight / 3
        return np.append(x, 1.0), np.append(shares, polynomial.polyval(1.0, g) / 3)

    def _derivative(self) -> Floats:
        """Coefficients of f' in Legendre polynomials of all orders."""
        order = np.arange(self.shape.size)
        series = np.zeros(2 * order.size - 1)
        series[::2] = np.sqrt(4 * order + 1) * (-1.0) ** order * self.shape
        return np.asarray(legendre.legder(series))


def sphere_pressures(
    layer: Layer, thickness: float, youngs_modulus: float, indenter_radii: Floats, forces: Floats
) -> list[SpherePressure | None]:
    """Pressures of spheres pressed into one layer.

    Parameters
    ----------
    layer : Layer
    thickness : float
        h [m].
    youngs_modulus : float
        E [Pa].
    indenter_radii : ndarray, (contacts,)
        R [m].
    forces : ndarray, (contacts,)
        Normal forces above 0 [N].

    Returns
    -------
    list of SpherePressure or None, (contacts,)
        None where a/h would exceed 4.
    """
    plane_modulus = youngs_modulus / (1 - layer.poisson_ratio**2)
    load = forces * indenter_radii / (plane_modulus * thickness**3)
    different, row = np.unique(load, return_inverse=True)
    alpha = curves_of(layer).at_load(different, np.zeros_like(different)).alpha.value
    valid = np.isfinite(alpha)
    shapes = iter(ContactEquation(alpha[valid]).solve(layer).sphere_shape.value if valid.any() else ())
    pressures = [SpherePressure(float(a) * thickness, next(shapes)) if a == a else None for a in alpha]
    return [pressures[i] for i in row]
