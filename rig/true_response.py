"""Charge over force of every recording before noise, at the true positions and with the true gains.

level = d33 · gain · (3/2) ρ² · σ_eff [pC/N]. A line at frequency f is multiplied by the responses of tip resonance,
sensor, cable and amplifier (`linear_filters`) and by the delay. σ_eff is σ with the contact edge held, plus the effect
of moving edges.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rig import effects, linear_filters
from rig.crosstalk import SensorWeights
from rig.effects import Values
from rig.errors import RigError
from rig.experiment import Experiment
from rig.gains import sensitivity, under_stress
from rig.layer import Floats
from rig.layer_contacts import LayerContacts
from rig.linear_filters import Complexes
from rig.plan import Plan

_SMALL_CHANGE = 1e-3  # of the force, for derivatives
_CYCLE = 16  # points of a cycle


@dataclass(frozen=True)
class TrueResponse:
    """The response of an experiment of kind frf, from its plan and the drawn scatter of positions and sensors.

    `missed_mm` (rows, 2) is the error of position, `sensor_gains` (sensors,) the true d33 over the skin's.
    """

    experiment: Experiment
    plan: Plan
    missed_mm: Floats
    sensor_gains: Floats

    @property
    def on(self) -> dict[str, Values]:
        """The effects that are switched on, with their parameters."""
        return self.experiment.effects

    @property
    def thickness(self) -> float:
        """The true thickness [mm]."""
        factor = effects.of(self.on, "thickness_error", "factor") or 1.0
        return self.experiment.skin.thickness_mm * factor

    @property
    def _centres(self) -> Floats:
        return np.array([sensor[1:] for sensor in self.experiment.skin.sensors])

    @cached_property
    def position(self) -> Floats:
        """The true position of the sphere in the sensors' frame (rows, 2) [mm]."""
        position = self._centres[self.plan.sensor] + self.plan.offset_mm + self.missed_mm
        position = position + [effects.of(self.on, "misalignment", name) for name in ("x_mm", "y_mm")]
        if "stage_wobble" in self.on:
            amplitude, period = (effects.of(self.on, "stage_wobble", x) for x in ("amplitude_mm", "period_recordings"))
            angle = 2 * np.pi * np.arange(len(position)) / period
            position = position + amplitude * np.column_stack([np.cos(angle), np.sin(angle)])
        return position

    @cached_property
    def _distinct(self) -> tuple[LayerContacts, NDArray[np.intp]]:
        """The distinct contacts, and the index of each recording's contact among them."""
        dwell = self.plan.dwell_s
        if dwell is None:
            if "contact_creep" in self.on:
                raise RigError("design.dwells_s", None, "required by the effect contact_creep")
            dwell = np.zeros(len(self.plan.preload_n))
        columns = np.column_stack([self.plan.indenter_mm, self.plan.preload_n, dwell, self.plan.dynamic_n])
        unique, index = np.unique(columns, axis=0, return_inverse=True)
        modulus = self.experiment.skin.youngs_modulus_mpa * (effects.of(self.on, "modulus_error", "factor") or 1.0)
        radius, force, dwell, _ = unique.T
        return LayerContacts(self.thickness, modulus, self.on, radius, force, dwell), index.reshape(-1)

    def elsewhere(self, missed_mm: Floats) -> "TrueResponse":
        """The same with other errors of position (rows, 2); the contacts do not depend on position and are reused."""
        other = replace(self, missed_mm=missed_mm)
        vars(other)["_distinct"] = self._distinct
        return other

    @property
    def contacts(self) -> LayerContacts:
        """The distinct contacts."""
        return self._distinct[0]

    @property
    def contact(self) -> NDArray[np.intp]:
        """The index of each recording's contact in `contacts` (rows,)."""
        return self._distinct[1]

    @cached_property
    def stiffness(self) -> Floats:
        """Contact stiffness of each recording [N/mm]."""
        return self.contacts.stiffness[self.contact]

    @cached_property
    def sensor_weights(self) -> SensorWeights:
        """The sensors that contribute to each recording."""
        fraction = effects.of(self.on, "crosstalk", "fraction")
        return SensorWeights.of(self._centres, self.plan.sensor, self.position, self.sensor_gains, fraction)

    def sigma(self, factor: float | Floats = 1.0) -> Floats:
        """σ of each recording's sensor (rows,) at its preload times `factor`, the contact edge at rest.

        With crosstalk those of its neighbours are added, each weighted by its d33 under its own static stress.
        """
        contacts = self.contacts if np.all(factor == 1.0) else self.contacts.at(self.contacts.force * factor)
        return (self.sensor_weights.weight * self.relative_d33 * self._sigma_of_each(contacts)).sum(axis=1)

    @cached_property
    def relative_d33(self) -> Floats:
        """d33 of each contributing sensor under its own static stress, over that at rest (rows, sensors)."""
        if "preload_dependent_d33" not in self.on:
            return np.ones_like(self.sensor_weights.weight)
        stress = 1.5 * self.plan.preload_n[:, None] * self._sigma_of_each(self.contacts) / (np.pi * self.thickness**2)
        return under_stress(self.on["preload_dependent_d33"], stress)

    def _sigma_of_each(self, contacts: LayerContacts) -> Floats:
        radius = self.experiment.skin.sensor_radius_mm
        return self.sensor_weights.sigma(contacts.spectrum, self.contact, radius, self.thickness)

    @cached_property
    def effective_sigma(self) -> Floats:
        """σ_eff of each recording."""
        at_rest = self.sigma()
        result = at_rest
        if "moving_contact_edge" in self.on:
            up, down = 1 + _SMALL_CHANGE, 1 - _SMALL_CHANGE
            moving = (up * self.sigma(up) - down * self.sigma(down)) / (up - down)
            result = result + effects.of(self.on, "moving_contact_edge", "mobile_fraction") * (moving - at_rest)
        if "amplitude_nonlinearity" in self.on:
            result = result + effects.of(self.on, "amplitude_nonlinearity", "mobility") * (
                self.first_harmonic - at_rest
            )
        return result

    @cached_property
    def first_harmonic(self) -> Floats:
        """First harmonic of Fσ over one cycle of force, over Fd; the sphere lifts off where the force is pulled."""
        relative = np.empty_like(self.contacts.force)
        relative[self.contact] = self.plan.dynamic_n / self.plan.preload_n
        total = np.zeros(len(self.contact))
        for sine in np.sin(2 * np.pi * (np.arange(_CYCLE) + 0.5) / _CYCLE):
            factor = np.maximum(1 + relative * sine, 1e-6)
            total += 2 / _CYCLE * sine * factor[self.contact] * self.sigma(factor)
        return total / relative[self.contact]

    @cached_property
    def level(self) -> Floats:
        """Charge over force at a frequency where no filter acts (rows,) [pC/N]."""
        skin = self.experiment.skin
        rho = skin.sensor_radius_mm / self.thickness
        return skin.d33_pc_per_n * self.gain * 1.5 * rho**2 * self.effective_sigma

    @cached_property
    def gain(self) -> Floats:
        """The factor on d33 of each recording (rows,)."""
        skin = self.experiment.skin
        return sensitivity(self.on, self.plan, self.sensor_gains, skin, self.position)

    def filters(self, row: int) -> list[linear_filters.Filter]:
        """Resonance and electronics of one recording, without the delay."""
        resonates = "contact_resonance" in self.on  # otherwise the stiffness, which is slow to compute, is not needed
        mechanical = linear_filters.resonance(self.on, float(self.stiffness[row])) if resonates else []
        return mechanical + linear_filters.electrical(self.on, float(self.plan.preload_n[row]))

    def lines(self, frequency_hz: Floats) -> Complexes:
        """The FRF before noise and mains.

        Parameters
        ----------
        frequency_hz : ndarray, (lines,)

        Returns
        -------
        ndarray of complex, (rows, lines)
            [pC/N]
        """
        late = np.exp(-2j * np.pi * frequency_hz * 1e-6 * effects.of(self.on, "timing_delay", "delay_us"))
        shapes = np.empty((len(self.contacts.force), len(frequency_hz)), dtype=complex)
        chain, shape = None, np.ones(len(frequency_hz), dtype=complex)
        for row in np.unique(self.contact, return_index=True)[1]:
            filters = self.filters(int(row))
            if filters != chain:
                chain, shape = filters, linear_filters.response(filters, frequency_hz)
            shapes[self.contact[row]] = shape
        return self.level[:, None] * shapes[self.contact] * late
