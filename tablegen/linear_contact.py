"""The exact linear contact of a frictionless sphere with the bonded layer: radius, depth, stress on the base.

Lengths in thicknesses, forces in G h², E' = E/(1 − ν²) = 2 G/(1 − ν). The pressure is that of
`underskin.physics.elastic_layer` under the same force, and the stress on the base its transform times the layer's
transmission:
s(r) = (1/3) ∫₀^∞ p̂(k; α) M(k) J0(kr) k dk.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import j0

from tablegen import linear_layer
from underskin.physics.charge_response import INCOMPRESSIBLE
from underskin.physics.elastic_layer import LARGEST_A_OVER_H, CurveGrid, Layer
from underskin.physics.hankel_transform import disc_average, wave_numbers
from underskin.units import Floats


@dataclass(frozen=True)
class LinearSphere:
    """Contact radius α = a/h, indentation δ/h and dF/dδ over G h."""

    alpha: float
    indentation: float
    stiffness: float


class LinearContact:
    """Contacts with one layer, and their stress at fixed distances `r` from the axis and on centred discs `rho`."""

    def __init__(self, r: Floats, rho: Floats, poisson_ratio: float = INCOMPRESSIBLE) -> None:
        layer, self._plane_strain = Layer(poisson_ratio), 2 / (1 - poisson_ratio)
        farthest = LARGEST_A_OVER_H + max(float(r.max(initial=0.0)), float(rho.max(initial=0.0)))
        k, weight = wave_numbers(farthest)
        self._curves = CurveGrid(k).curves(layer)
        transmission = linear_layer.transmission(k) if poisson_ratio == INCOMPRESSIBLE else layer.transmission(k).value
        passed = self._curves.sphere_transform.value * (weight * k / 3 * transmission)
        interval = self._curves.interval
        self._profile = interval.coefficients(passed @ j0(np.multiply.outer(k, r)))
        self._sigma = interval.coefficients(passed @ disc_average(np.multiply.outer(k, rho)))

    def sphere(self, force: float, radius: float) -> LinearSphere:
        """The contact of a sphere of `radius` under `force`; NaN beyond a/h = 4."""
        load = np.array([force * radius / self._plane_strain])
        rows = self._curves.at_load(load, np.zeros(1))
        alpha = float(rows.alpha.value[0])
        stiffness = 2 * self._plane_strain * alpha * float(rows.stiffness.value[0])
        return LinearSphere(alpha, float(rows.depth.value[0]) / radius, stiffness)

    def profile(self, alpha: float) -> Floats:
        """The stress on the base at `r`, in σ's scale."""
        return np.asarray(self._curves.interval.basis(np.array([alpha])) @ self._profile)[0]

    def sigma(self, alpha: float) -> Floats:
        """Its means over the discs `rho`."""
        return np.asarray(self._curves.interval.basis(np.array([alpha])) @ self._sigma)[0]
