"""The layer under a preload: contact radius, spectrum of the stress on its base, contact stiffness (mm, N, MPa).

Base model: half-space Hertz radius a³ = 3FR(1 − ν²)/(4E), Hertz pressure of that radius, the bonded layer with finite
strain. Effects change the modulus first (error, creep, stiffening with the contact strain), then contact and pressure
(layer, adhesion), then the layer's own transmission (ν, glue line). What finite strain adds is that of the Hertz
pressure as a dead load, with the layer's contact that of a sphere in true contact; both of the bonded incompressible
layer.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rig import effects, finite_strain
from rig.contact import SphereContact, sphere_contact
from rig.effects import Values
from rig.errors import RigError
from rig.layer import WAVENUMBERS, Floats, Layer, base_stress, hertz_shape

_CONTACT_STRAIN = 0.2  # of a/R (Tabor)
_LOCKS = 0.9  # of the limited law's c e, at which it would be infinite: as far as it goes
_STIFFENING_STEPS = 40


@dataclass(frozen=True)
class LayerContacts:
    """Spheres pressed into a layer.

    Attributes
    ----------
    thickness : float
        h [mm].
    modulus : float
        Young's modulus at rest [MPa].
    on : mapping
        Effects that are switched on, with their parameters.
    radius, force, dwell : ndarray, (rows,)
        Radius of the sphere [mm], preload [N], time under preload [s].
    """

    thickness: float
    modulus: float
    on: Mapping[str, Values]
    radius: Floats
    force: Floats
    dwell: Floats

    def at(self, force: Floats) -> "LayerContacts":
        """The same contacts under another force (rows,); cached."""
        key = force.tobytes()
        if key not in self._by_force:
            self._by_force[key] = LayerContacts(self.thickness, self.modulus, self.on, self.radius, force, self.dwell)
        return self._by_force[key]

    @cached_property
    def _by_force(self) -> dict[bytes, "LayerContacts"]:
        return {}

    @cached_property
    def layer(self) -> Layer:
        """Poisson ratio and glue line of the layer."""
        nu = effects.of(self.on, "compressible_layer", "poisson_ratio") or 0.5
        slipping = "interface_slip" in self.on
        return Layer(nu, effects.of(self.on, "interface_slip", "glue_stiffness") if slipping else math.inf)

    @cached_property
    def contact_radius(self) -> Floats:
        """Contact radius a (rows,) [mm]; with stiffening, the fixed point of a and E(a/R)."""
        a = self._radius_at(self._relaxed)
        if "strain_stiffening" in self.on:
            for _ in range(_STIFFENING_STEPS):
                a = (a + self._radius_at(self._relaxed * self._stiffening(a))) / 2
        return a

    @cached_property
    def effective_modulus(self) -> Floats:
        """Effective Young's modulus of each contact (rows,) [MPa]."""
        return self._relaxed * self._stiffening(self.contact_radius)

    @cached_property
    def spectrum(self) -> Floats:
        """Transform of the stress on the base over 3F/(2πh²), (rows, WAVENUMBERS)."""
        alpha, scaled = self.contact_radius / self.thickness, self.radius / self.thickness
        nu = self.layer.poisson_ratio
        load = self.force / (self.radius**2 * self.effective_modulus) * (0.75 / (1 - nu**2)) ** 2
        linear = self._pressure(alpha, scaled) * self.layer.transmission(WAVENUMBERS)
        law = finite_strain.SPHERE if "layered_contact" in self.on else finite_strain.DEAD_PRESSURE
        return linear + finite_strain.added_spectrum(alpha, load, law)

    @cached_property
    def stiffness(self) -> Floats:
        """Contact stiffness dF/dδ (rows,) [N/mm] with the edge held, against an oscillation too fast to relax."""
        alpha = self.contact_radius / self.thickness
        return self._curves.stiffness(alpha, self.modulus * self._stiffening(self.contact_radius)) * self.thickness

    def sigma(self, rt: float, offset: Floats) -> Floats:
        """Transmission factor σ of sensors.

        Parameters
        ----------
        rt : float
            Sensor radius [mm].
        offset : ndarray, (rows,) or (rows, sensors)
            Distance of the sensors from the axis of the load [mm].
        """
        return base_stress(self.spectrum, rt / self.thickness, offset / self.thickness)

    @property
    def _curves(self) -> SphereContact:
        return sphere_contact(self.layer)

    @property
    def _relaxed(self) -> Floats:
        """1/J(t) of the standard linear solid with relaxation E (1 − g (1 − e^(−t/τ)))."""
        if "contact_creep" not in self.on:
            return np.full(self.force.shape, self.modulus)
        g, tau = (effects.of(self.on, "contact_creep", name) for name in ("fraction", "time_s"))
        return self.modulus / (1 + g / (1 - g) * (1 - np.exp(-(1 - g) * self.dwell / tau)))

    def _stiffening(self, a: Floats) -> Floats:
        if "strain_stiffening" not in self.on:
            return np.ones_like(a)
        return stiffening(self.on["strain_stiffening"], _CONTACT_STRAIN * a / self.radius)

    def _radius_at(self, modulus: Floats) -> Floats:
        nu, h = self.layer.poisson_ratio, self.thickness
        work = self._work
        if "layered_contact" in self.on:
            scaled = self.force / (modulus * h**2)
            return self._curves.radius_of(scaled, self.radius / h, np.ones_like(scaled), work / (modulus * h)) * h
        pull = 3 * np.pi * work * self.radius
        effective = self.force + pull + np.sqrt(2 * pull * self.force + pull**2)
        return np.cbrt(0.75 * effective * self.radius * (1 - nu**2) / modulus)

    @property
    def _work(self) -> float:
        return effects.of(self.on, "adhesion", "work_j_per_m2") * 1e-3  # J/m² = 1e-3 N/mm

    def _pressure(self, alpha: Floats, scaled: Floats) -> Floats:
        """p̂ of the pressure over its force."""
        k, h = WAVENUMBERS, self.thickness
        if "layered_contact" in self.on:
            work = self._work / (self.effective_modulus * h)
            return self._curves.shape(alpha, scaled, np.ones_like(alpha), work, k)
        hertz = hertz_shape(np.multiply.outer(alpha, k))
        if not self._work:
            return hertz
        plane = self.effective_modulus / (1 - self.layer.poisson_ratio**2)
        total = 4 * plane * (alpha * h) ** 3 / (3 * self.radius) / self.force
        return total[:, None] * hertz + (1 - total)[:, None] * np.sinc(np.multiply.outer(alpha, k) / np.pi)


def stiffening(values: Values, strain: Floats) -> Floats:
    """Young's modulus over that at rest, under a strain (rows,); RigError at the locking strain of the limited law."""
    grown = float(values["coefficient"]) * strain
    if values["law"] == "linear":
        return 1 + grown
    if np.any(strain > locking(values)):
        raise RigError("effects.strain_stiffening.coefficient", values["coefficient"], "locks at this load: lower it")
    return 1 / (1 - grown)


def locking(values: Values) -> float:
    """The strain at which the limited law locks; infinite of the linear one."""
    return _LOCKS / float(values["coefficient"]) if values["law"] == "limited" and values["coefficient"] else np.inf
