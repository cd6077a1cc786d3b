"""A rigid sphere pressed into the linear layer without friction, with or without adhesion (JKR), one contact at a time.

The exact solution behind the curves that serve many contacts at once (elastic_layer); lengths in m, forces in N.
With E' = E/(1 − ν²), α = a/h and U = √(w/(E' h³)) R, the sphere without adhesion and a flat punch whose φ at the edge
is −√(2awE'/π) add up (Johnson, Kendall and Roberts 1971; Dimitriadis et al. 2002):

    F = E'h³/R [(4/3) α³ A − U √(8π α³) G],   δ = h²/R [α² B − U √(2πα) V],   k = 2E'a S

with A, B, G, V, S the ratios to the half space (contact_equation). k is dF/dδ with the edge held; without adhesion that
is dF/dδ altogether.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from underskin.errors import InvalidInput
from underskin.physics.elastic_layer import ContactEquation, Layer, mode_transforms
from underskin.units import Floats

LARGEST = 10.0  # a/h
_SMALL = 1e-3  # of the half space's radius, where a search begins


@dataclass(frozen=True)
class SphereContact:
    """One contact: a [m], F [N], δ [m] and k = dF/dδ [N/m] with the edge held."""

    contact_radius: float
    force: float
    indentation: float
    stiffness: float
    _modes: Floats  # Legendre coefficients of 2π φ a, in N

    def pressure_transform(self, s: Floats) -> Floats:
        """2π p̂ [N] at s = k a, of any shape; F at s = 0. `hankel.normal_stress` makes F σ of it."""
        return mode_transforms(s, self._modes.size) @ self._modes


@dataclass(frozen=True)
class SphereOnLayer:
    """Sphere radius [m], Young's modulus [Pa], thickness [m], the layer's ν and glue line, work of adhesion w [J/m²].

    InvalidInput where a length or the modulus is not positive and finite, or w is negative.
    """

    indenter_radius: float
    youngs_modulus: float
    thickness: float
    layer: Layer
    work_of_adhesion: float = 0.0

    def __post_init__(self) -> None:
        for name in ("indenter_radius", "youngs_modulus", "thickness"):
            if not 0 < getattr(self, name) < np.inf:
                raise InvalidInput(name, getattr(self, name), "must be finite and greater than 0")
        if not 0 <= self.work_of_adhesion < np.inf:
            raise InvalidInput("work_of_adhesion", self.work_of_adhesion, "must be finite and at least 0")

    @property
    def plane_modulus(self) -> float:
        """E' = E/(1 − ν²) [Pa]."""
        return float(self.youngs_modulus / (1 - self.layer.poisson_ratio**2))

    def at_radius(self, contact_radius: float) -> SphereContact:
        """The equilibrium of a given a [m]; InvalidInput unless 0 < a/h ≤ 10."""
        alpha = contact_radius / self.thickness
        if not 0 < alpha <= LARGEST:
            raise InvalidInput("contact_radius", contact_radius, f"must be above 0 and at most {LARGEST:g} thicknesses")
        solved = ContactEquation(np.array([alpha])).solve(self.layer)
        stiffness = 2 * self.plane_modulus * contact_radius * solved.stiffness.value[0]
        sphere = self._force_unit * 4 / 3 * alpha**3 * solved.sphere_force.value[0]
        punch = -self._force_unit * self._root_adhesion * np.sqrt(8 * np.pi * alpha**3) * solved.edge_force.value[0]
        depth = alpha**2 * solved.sphere_depth.value[0]
        depth -= self._root_adhesion * np.sqrt(2 * np.pi * alpha) * solved.edge_depth.value[0]
        return SphereContact(
            contact_radius=contact_radius,
            force=sphere + punch,
            indentation=depth * self.thickness**2 / self.indenter_radius,
            stiffness=stiffness,
            _modes=sphere * solved.sphere_shape.value[0] + punch * solved.punch_shape.value[0],
        )

    def at_force(self, force: float) -> SphereContact:
        """The equilibrium under a given force [N] on the branch that is stable under force control.

        InvalidInput below pull-off, at no force without adhesion, and where a/h would exceed 10.
        """
        low = _SMALL * min(self._half_space_radius(force), LARGEST * self.thickness)
        if self.work_of_adhesion > 0:
            lowest = self.pull_off()
            if not force >= lowest.force:
                raise InvalidInput("force", force, f"must be at least the pull-off force, {lowest.force:.6g} N")
            low = lowest.contact_radius
        elif not force > 0:
            raise InvalidInput("force", force, "must be greater than 0 without adhesion")
        high = LARGEST * self.thickness
        if force > self.at_radius(high).force:
            raise InvalidInput("force", force, f"must keep the contact radius below {LARGEST:g} thicknesses")
        return self.at_radius(
            brentq(lambda a: self.at_radius(a).force - force, low, high, xtol=low * 1e-12, rtol=1e-14)
        )

    def pull_off(self) -> SphereContact:
        """The smallest force at which it sticks; InvalidInput without adhesion, or where a/h would exceed 10."""
        if self.work_of_adhesion == 0:
            raise InvalidInput("work_of_adhesion", 0.0, "must be greater than 0 for a pull-off")
        guess = min(self._half_space_radius(-np.inf), LARGEST * self.thickness / 4)
        least = minimize_scalar(
            lambda ratio: self.at_radius(ratio * guess).force,
            bounds=(0.1, 4),
            method="bounded",
            options={"xatol": 1e-9},
        )
        radius = float(least.x) * guess
        if radius > 0.999 * LARGEST * self.thickness:
            allowed = f"must let the sphere come off below a radius of {LARGEST:g} thicknesses"
            raise InvalidInput("work_of_adhesion", self.work_of_adhesion, allowed)
        return self.at_radius(radius)

    @property
    def _force_unit(self) -> float:
        return self.plane_modulus * self.thickness**3 / self.indenter_radius

    @property
    def _root_adhesion(self) -> float:
        """U."""
        return float(np.sqrt(self.work_of_adhesion / (self.plane_modulus * self.thickness**3))) * self.indenter_radius

    def _half_space_radius(self, force: float) -> float:
        """JKR's radius on a half space; the one at pull-off for a force below it."""
        jkr = 3 * np.pi * self.work_of_adhesion * self.indenter_radius
        force = max(force, -jkr / 2)
        equivalent = force + jkr + np.sqrt(max(jkr * (2 * force + jkr), 0.0))
        return float(np.cbrt(0.75 * equivalent * self.indenter_radius / self.plane_modulus))
