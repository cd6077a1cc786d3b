"""Worlds that the solved rig draws: the plain one, and one with an additional effect.

The plain world is a rigid frictionless sphere in true contact with one incompressible neo-Hookean layer, with a moving
contact edge. `exact_name` and `nearest_names` are the names of PHYSICS.md section 8 for the effect.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from rig.solved.charge import Skin
from rig.solved.layer import Floats, Material, Sublayer

PLAIN, STIFFENING, FOAM, CREEP = "plain", "stiffening", "foam", "creep"
TWO_LAYER, FINITE_SKIN = "two_layer", "finite_skin"
SHARES = {PLAIN: 0.3, STIFFENING: 0.16, FOAM: 0.16, CREEP: 0.16, TWO_LAYER: 0.14, FINITE_SKIN: 0.08}
EXACT = {
    PLAIN: None,
    STIFFENING: "strain_stiffening",
    FOAM: "compressible_layer",
    CREEP: "contact_creep",
    TWO_LAYER: "surface_film",
    FINITE_SKIN: "finite_skin",
}
NEAREST = {
    PLAIN: (),
    STIFFENING: ("modulus_error",),
    FOAM: ("interface_slip",),
    CREEP: (),
    TWO_LAYER: ("modulus_error", "thickness_error", "strain_stiffening", "interface_slip", "compressible_layer"),
    FINITE_SKIN: ("compressible_layer", "interface_slip", "modulus_error"),
}


@dataclass(frozen=True)
class World:
    """An effect and its parameters; lengths over the thickness, moduli over that of the main layer."""

    effect: str
    parameters: Mapping[str, float] = field(default_factory=dict)

    def skin(self) -> Skin:
        """The solved problem."""
        bulk = Material(poisson=self.parameters.get("poisson_ratio", 0.5), c2=self.parameters.get("c2", 0.0))
        film = self.parameters.get("film_thickness", 0.0)
        sublayers = [Sublayer(1.0 - film, bulk)]
        if film:
            sublayers.append(Sublayer(film, Material(modulus=self.parameters["film_modulus"])))
        return Skin(tuple(sublayers), self.parameters.get("lateral_radius"))

    def relaxed(self, dwell_s: Floats) -> Floats:
        """E after a dwell over that at once: 1/J(t) of the solid that relaxes as 1 − g (1 − e^(−t/τ))."""
        if self.effect != CREEP:
            return np.ones_like(dwell_s)
        g, tau = self.parameters["fraction"], self.parameters["time_s"]
        return 1 / (1 + g / (1 - g) * (1 - np.exp(-(1 - g) * dwell_s / tau)))


def drawn_world(random: np.random.Generator, effect: str) -> World:
    """An effect of a strength from subtle to strong."""
    parameters: dict[str, float] = {}
    if effect == STIFFENING:
        parameters = {"c2": evenly_in_log(random, 0.3, 6.0)}
    elif effect == FOAM:
        parameters = {"poisson_ratio": round(float(random.uniform(0.30, 0.45)), 3)}
    elif effect == CREEP:
        parameters = {
            "fraction": round(float(random.uniform(0.15, 0.6)), 3),
            "time_s": evenly_in_log(random, 5.0, 50.0),
        }
    elif effect == TWO_LAYER:
        soft = random.random() < 0.5
        parameters = {
            "film_thickness": round(float(random.uniform(0.1, 0.3) if soft else random.uniform(0.04, 0.3)), 3),
            "film_modulus": evenly_in_log(random, 0.3, 0.7) if soft else evenly_in_log(random, 2.0, 12.0),
        }
    elif effect == FINITE_SKIN:
        parameters = {"lateral_radius": round(float(random.uniform(1.6, 3.5)), 2)}
    return World(effect, parameters)


def evenly_in_log(random: np.random.Generator, low: float, high: float) -> float:
    """A log-uniform value between two bounds, to three digits."""
    return float(f"{math.exp(random.uniform(math.log(low), math.log(high))):.3g}")
