"""The pressure under spheres that are pressed into the linear layer without friction, many at once.

On a layer that is thin beside the contact, contacts are smaller and more peaked than Hertz's on a half space: at a/h 1
by 9 % of the radius and 10 % of the stress on a sensor beneath (bonded, incompressible). With φ of
the contact equation over its mean, f(x) at x = r/a, where f(1) = 0 without adhesion, a pressure of the force F is
    p(r) = −F/(2πa²) ∫ f'(x)/√(x² − r²/a²) dx     from r/a to 1     (Sneddon; Hertz: f = (3/2)(1 − x²))
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.polynomial import legendre

from underskin.physics.contact_curves import REACH, CurveGrid
from underskin.physics.contact_integral_equation import ContactEquation
from underskin.physics.elastic_layer import Layer
from underskin.units import Floats

MOST_A_OVER_H = REACH
HERTZ_SHAPE: Floats = np.array([1.0, 1 / np.sqrt(5)])


@dataclass(frozen=True)
class SpherePressure:
    """Pressure on r < `radius` [m]; `shape` (modes,): Legendre coefficients of f, as in contact_equation."""

    radius: float
    shape: Floats

    def ring_share(self, t: Floats) -> Floats:
        """Share of the force on the ring at r = a √(1 − t²), for each dt: (points,); 3t² by Hertz.

        t² ∫ G(1 − t² + t²v²) dv from 0 to 1, with G(x²) = −f'(x)/x, a polynomial.
        """
        order = np.arange(self.shape.size)
        series = np.zeros(2 * order.size - 1)
        series[::2] = np.sqrt(4 * order + 1) * (-1.0) ** order * self.shape
        v, weight = np.polynomial.legendre.leggauss(order.size)
        x = np.sqrt(1 - t[:, None] ** 2 * (1 - ((1 + v) / 2) ** 2))
        share: Floats = -(t**2) * (legendre.legval(x, legendre.legder(series)) / x @ weight) / 2
        return share


def sphere_pressures(
    layer: Layer, thickness: float, youngs_modulus: float, indenter_radii: Floats, forces: Floats
) -> list[SpherePressure | None]:
    """The pressures of spheres (contacts,) [m] under forces (contacts,) [N] > 0; None where a/h would exceed 4."""
    plane_modulus = youngs_modulus / (1 - layer.poisson_ratio**2)
    load = forces * indenter_radii / (plane_modulus * thickness**3)
    different, place = np.unique(load, return_inverse=True)
    alpha = _grid().curves(layer).at_load(different, np.zeros_like(different)).alpha.value
    known = np.isfinite(alpha)
    shapes = iter(ContactEquation(alpha[known]).solve(layer).sphere_shape[0] if known.any() else ())
    found = [SpherePressure(float(a) * thickness, next(shapes)) if a == a else None for a in alpha]
    return [found[i] for i in place]


@cache
def _grid() -> CurveGrid:
    return CurveGrid(np.zeros(0))
