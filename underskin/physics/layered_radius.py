"""The radius of a sphere's frictionless contact with the bonded incompressible linear layer at a given force.

With α = a/h and P = F R/(E' h³): P = (4/3) α³ A(α), where A, 1 at α = 0, is exact at nodes (contact_curves)
and interpolated by a spline. Beyond the last node α is continued as a power of P, sufficient to state how far a contact
is beyond a limit.
"""

import numpy as np
from scipy.interpolate import make_interp_spline

from underskin.physics.contact_curves import LARGEST_A_OVER_H, ContactEquation
from underskin.physics.elastic_layer import Layer
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
