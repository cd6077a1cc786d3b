"""A cylinder compressed between platens: area · (λ⁻² − λ)/3 of an incompressible neo-Hookean solid, λ = 1 − u/H;
stiffer with strain and friction, softer while a wedge closes.

Its force on a body of unit modulus, F₁(u), relaxes as  F(t) = ∫₀^t E(t − s) dF₁(u(s)).
"""

from collections.abc import Mapping

import numpy as np

from rig import effects
from rig.effects import Values
from rig.layer import Floats
from rig.layer_contacts import stiffening
from rig.relaxation import of_effects


def cylinder_force(on: Mapping[str, Values], shape: Mapping[str, float], time: Floats, shortening: Floats) -> Floats:
    """Force over the modulus at rest [mm²] at times [s] and shortenings u [mm], (samples,)."""
    elastic = _elastic(on, shape, shortening)
    if "contact_creep" not in on:
        return elastic
    middle = (time[1:] + time[:-1]) / 2
    elapsed = time[:, None] - middle
    relaxed = np.where(elapsed > 0, of_effects(on).remaining(np.maximum(elapsed, 0)), 0.0)
    return np.asarray(relaxed @ np.diff(elastic))


def _elastic(on: Mapping[str, Values], shape: Mapping[str, float], shortening: Floats) -> Floats:
    height, diameter = shape["sample_height_mm"], shape["sample_diameter_mm"]
    held = 1 + 2 * effects.of(on, "platen_friction", "friction") * (diameter / (4 * height)) ** 2
    wedge = effects.of(on, "tilted_platen", "wedge_mm")
    touched = shortening
    if wedge:
        closing = np.clip(shortening, 0, wedge)
        touched = np.where(shortening > 0, shortening - closing + closing**2 / (2 * wedge), shortening)
    stretch = 1 - touched / height
    force = np.pi / 4 * diameter**2 * held * (stretch**-2 - stretch) / 3
    if "strain_stiffening" in on:
        force = force * stiffening(on["strain_stiffening"], np.abs(shortening) / height)
    return np.asarray(force)
