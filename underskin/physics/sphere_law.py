"""A rigid sphere pressed into an elastic half space or a bonded layer without adhesion, to any depth. SI.

On the half space, with the contact radius a and E' = E/(1 − ν²) (Sneddon, Int. J. Eng. Sci. 3 (1965) 47):

    δ = (a/2) ln((R + a)/(R − a)),   F = (E'/2) [(a² + R²) ln((R + a)/(R − a)) − 2aR]

For small a/R these are Hertz's δ = a²/R and F = 4E'a³/(3R); at a given depth the force is lower than Hertz's by about a
tenth of δ/R. On a layer of thickness h, δ is multiplied by the layer's ratio B(a/h), and F = ∫ k dδ with the stiffness
k = 2E'a S(a/h) of the flat punch (elastic_layer).

Finite strain makes δ larger at the same force, by a function of a/h of the linear contact and of L = F/(R²E).
"""

from collections.abc import Callable

import numpy as np

from underskin.physics.elastic_layer import LARGEST_A_OVER_H, Layer, curves_of
from underskin.units import Floats

_NODES = 4001
_SMALLEST = 1e-9  # a/h
_WIDEST = 0.999  # of R, up to which the contact radius is tabulated
_PARABOLOID_TO = 10.0  # of R, the same for a paraboloid, which a diverging fit may need
PARABOLOID = 0.4  # of R: pressed less deep, a paraboloid's force is within 4 % of the sphere's
LOAD_OF_REDUCED = 4 / 3  # L = F/(R²E) over F/(R²E'), at ν = ½
# δ of the full sphere over that of the paraboloid at the same force is 1 + this L^(2/3): Sneddon's law to second order,
# with a/R = (9L/16)^(1/3).
FULL_SPHERE_OF_LOAD = (9 / 16) ** (2 / 3) / 15

# δ over that of the linear contact at the same force, less 1, by a/h, L^(1/3), and whether the contact is a full sphere
Softening = Callable[[Floats, Floats, bool], Floats]


class SphereLaw:
    """F/E' [m²] over the depth [m] under a sphere; `thickness` is that of the layer, None on a half space.

    The sphere is approximated by a paraboloid unless `full_sphere`.

    Attributes
    ----------
    deepest : float
        Largest depth [m] of the law: on a layer that at a/h = LARGEST_A_OVER_H.
    """

    def __init__(
        self,
        radius: float,
        thickness: float | None,
        poisson_ratio: float,
        softening: Softening | None = None,
        *,
        full_sphere: bool = False,
    ) -> None:
        """Tabulate the law."""
        widest = (_WIDEST if full_sphere else _PARABOLOID_TO) * radius
        if thickness is not None:
            widest = min(widest, LARGEST_A_OVER_H * thickness)
        a = widest * np.linspace(0.0, 1.0, _NODES)
        depth, stiffness = (a * np.arctanh(a / radius) if full_sphere else a**2 / radius), 2 * a
        if thickness is not None:
            ratio = curves_of(Layer(poisson_ratio)).ratios_at(np.maximum(a / thickness, _SMALLEST))
            depth, stiffness = depth * ratio[:, 1], stiffness * ratio[:, 2]
        steps = np.diff(depth) * (stiffness[1:] + stiffness[:-1]) / 2
        force = np.append(0.0, np.cumsum(steps))
        if softening is not None:
            cbrt_load = np.cbrt(LOAD_OF_REDUCED * force) / np.cbrt(radius) ** 2
            alpha = np.zeros_like(a) if thickness is None else a / thickness
            depth = depth * (1 + softening(alpha, cbrt_load, full_sphere))
        self._depth, self._root = depth, np.cbrt(force) ** 2
        self.deepest = float(depth[-1])

    def __call__(self, depth: Floats) -> Floats:
        """F/E' at depths (samples,), 0 out of contact; beyond `deepest` that of the last depth."""
        return np.asarray(np.interp(np.maximum(depth, 0.0), self._depth, self._root) ** 1.5)
