"""Charge over force of every recording before noise: where the sphere truly is, what the sensor feels and answers.

level = d33 · gain · (3/2) ρ² · σ_eff [pC/N]; on a line at f it goes through the resonance of the tip, sensor, cable
and amplifier (`linear_filters`) and the delay. σ_eff is σ with a held edge, plus what moving edges add.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rig import effects, linear_filters
from rig.effects import Values
from rig.errors import RigError
from rig.experiment import Experiment
from rig.gains import sensitivity, under_stress
from rig.layer import Floats, base_stress
from rig.linear_filters import Complexes
from rig.plan import Plan
from rig.pressed import Pressed

_NEIGHBOUR = 1.2  # pitches
_SMALL_CHANGE = 1e-3  # of the force, for derivatives
_CYCLE = 16  # points of a cycle


@dataclass(frozen=True)
class Bench:
    """An experiment of kind frf, its plan, and what the rig's own scatter makes of it.

    `missed_mm` (rows, 2) is the error of position, `sensor_gains` (sensors,) the true d33 over the skin's.
    """

    experiment: Experiment
    plan: Plan
    missed_mm: Floats
    sensor_gains: Floats

    @property
    def on(self) -> dict[str, Values]:
        """The effects that are switched on."""
        return self.experiment.effects

    @property
    def thickness(self) -> float:
        """The true thickness [mm]."""
        factor = effects.of(self.on, "thickness_error", "factor") or 1.0
        return self.experiment.skin.thickness_mm * factor

    @cached_property
    def place(self) -> Floats:
        """Where the sphere truly stands, in the sensors' frame (rows, 2)."""
        centres = np.array([sensor[1:] for sensor in self.experiment.skin.sensors])
        place = centres[self.plan.sensor] + self.plan.offset_mm + self.missed_mm
        place = place + [effects.of(self.on, "misalignment", name) for name in ("x_mm", "y_mm")]
        if "stage_wobble" in self.on:
            amplitude, period = (effects.of(self.on, "stage_wobble", x) for x in ("amplitude_mm", "period_recordings"))
            angle = 2 * np.pi * np.arange(len(place)) / period
            place = place + amplitude * np.column_stack([np.cos(angle), np.sin(angle)])
        return place

    @cached_property
    def _distinct(self) -> tuple[Pressed, NDArray[np.intp]]:
        """The distinct contacts, and of each recording its contact."""
        dwell = self.plan.dwell_s
        if dwell is None:
            if "contact_creep" in self.on:
                raise RigError("design.dwells_s", None, "required by the effect contact_creep")
            dwell = np.zeros(len(self.plan.preload_n))
        columns = np.column_stack([self.plan.indenter_mm, self.plan.preload_n, dwell, self.plan.dynamic_n])
        unique, index = np.unique(columns, axis=0, return_inverse=True)
        modulus = self.experiment.skin.youngs_modulus_mpa * (effects.of(self.on, "modulus_error", "factor") or 1.0)
        radius, force, dwell, _ = unique.T
        return Pressed(self.thickness, modulus, self.on, radius, force, dwell), index.reshape(-1)

    def elsewhere(self, missed_mm: Floats) -> "Bench":
        """The same with other errors of position (rows, 2); contacts, which do not depend on place, are kept."""
        other = replace(self, missed_mm=missed_mm)
        vars(other)["_distinct"] = self._distinct
        return other

    @property
    def pressed(self) -> Pressed:
        """The distinct contacts."""
        return self._distinct[0]

    @property
    def contact(self) -> NDArray[np.intp]:
        """Of each recording, its contact in `pressed`."""
        return self._distinct[1]

    @cached_property
    def stiffness(self) -> Floats:
        """Contact stiffness of each recording [N/mm]."""
        return self.pressed.stiffness[self.contact]

    @cached_property
    def felt(self) -> "Felt":
        """Which sensors each recording hears, and how far they are."""
        return Felt.of(self)

    def sigma(self, factor: float | Floats = 1.0) -> Floats:
        """σ of each recording's sensor, its preload times `factor` (rows,), edge at its place.

        With crosstalk its neighbours' add, each as strongly as its d33 answers under its own static stress.
        """
        pressed = self.pressed if np.all(factor == 1.0) else self.pressed.at(self.pressed.force * factor)
        return (self.felt.weight * self.answer * self._each_sigma(pressed)).sum(axis=1)

    @cached_property
    def answer(self) -> Floats:
        """d33 of each sensor heard under its own static stress, over that at rest (rows, heard)."""
        if "preload_dependent_d33" not in self.on:
            return np.ones_like(self.felt.weight)
        stress = 1.5 * self.plan.preload_n[:, None] * self._each_sigma(self.pressed) / (np.pi * self.thickness**2)
        return under_stress(self.on["preload_dependent_d33"], stress)

    def _each_sigma(self, pressed: Pressed) -> Floats:
        return self.felt.sigma(pressed.spectrum, self.contact, self.experiment.skin.sensor_radius_mm, self.thickness)

    @cached_property
    def effective_sigma(self) -> Floats:
        """σ_eff of each recording."""
        held = self.sigma()
        result = held
        if "moving_contact_edge" in self.on:
            up, down = 1 + _SMALL_CHANGE, 1 - _SMALL_CHANGE
            moving = (up * self.sigma(up) - down * self.sigma(down)) / (up - down)
            result = result + effects.of(self.on, "moving_contact_edge", "mobile_fraction") * (moving - held)
        if "amplitude_nonlinearity" in self.on:
            result = result + effects.of(self.on, "amplitude_nonlinearity", "mobility") * (self.first_harmonic - held)
        return result

    @cached_property
    def first_harmonic(self) -> Floats:
        """First harmonic of Fσ over one cycle of force, over Fd; the sphere lifts off where the force is pulled."""
        relative = np.empty_like(self.pressed.force)
        relative[self.contact] = self.plan.dynamic_n / self.plan.preload_n
        total = np.zeros(len(self.contact))
        for sine in np.sin(2 * np.pi * (np.arange(_CYCLE) + 0.5) / _CYCLE):
            factor = np.maximum(1 + relative * sine, 1e-6)
            total += 2 / _CYCLE * sine * factor[self.contact] * self.sigma(factor)
        return total / relative[self.contact]

    @cached_property
    def level(self) -> Floats:
        """Charge over force at a frequency where nothing else acts (rows,) [pC/N]."""
        skin = self.experiment.skin
        rho = skin.sensor_radius_mm / self.thickness
        return skin.d33_pc_per_n * self.gain * 1.5 * rho**2 * self.effective_sigma

    @cached_property
    def gain(self) -> Floats:
        """What multiplies d33 of each recording."""
        return sensitivity(self)

    def filters(self, row: int) -> list[linear_filters.Filter]:
        """Resonance and electronics of one recording, without the delay."""
        resonates = "contact_resonance" in self.on  # else nobody needs the stiffness, which is dear
        mechanical = linear_filters.resonance(self.on, float(self.stiffness[row])) if resonates else []
        return mechanical + linear_filters.electrical(self.on, float(self.plan.preload_n[row]))

    def lines(self, frequency_hz: Floats) -> Complexes:
        """The FRF before noise and mains (rows, lines) [pC/N]."""
        late = np.exp(-2j * np.pi * frequency_hz * 1e-6 * effects.of(self.on, "timing_delay", "delay_us"))
        shapes = np.empty((len(self.pressed.force), len(frequency_hz)), dtype=complex)
        chain, shape = None, np.ones(len(frequency_hz), dtype=complex)
        for row in np.unique(self.contact, return_index=True)[1]:
            filters = self.filters(int(row))
            if filters != chain:
                chain, shape = filters, linear_filters.response(filters, frequency_hz)
            shapes[self.contact[row]] = shape
        return self.level[:, None] * shapes[self.contact] * late


@dataclass(frozen=True)
class Felt:
    """For each recording the sensors heard (rows, heard), their weights in its charge, and distances to them [mm]."""

    distance: Floats
    weight: Floats

    @classmethod
    def of(cls, bench: Bench) -> "Felt":
        """Its own sensor and, with crosstalk, those within 1.2 pitch of it."""
        centres = np.array([sensor[1:] for sensor in bench.experiment.skin.sensors])
        own = bench.plan.sensor
        fraction = effects.of(bench.on, "crosstalk", "fraction")
        apart = np.hypot(*(centres[:, None] - centres).transpose(2, 0, 1))
        pitch = apart[apart > 0].min(initial=np.inf)
        weights = np.where((apart > 0) & (apart < _NEIGHBOUR * pitch), fraction, 0.0) * bench.sensor_gains
        weights = weights / bench.sensor_gains[:, None] + np.eye(len(centres))
        used = np.flatnonzero((weights[own] != 0).any(axis=0)) if fraction else None
        if used is None:
            return cls(np.hypot(*(bench.place - centres[own]).T)[:, None], np.ones((len(own), 1)))
        distance = np.hypot(*(bench.place[:, None] - centres[used]).transpose(2, 0, 1))
        return cls(distance, weights[np.ix_(own, used)])

    def sigma(self, spectrum: Floats, contact: NDArray[np.intp], rt: float, thickness: float) -> Floats:
        """σ of each sensor heard (rows, heard); 0 where it has no weight."""
        result = np.zeros(self.distance.shape)
        for column in range(self.distance.shape[1]):
            heard = np.flatnonzero(self.weight[:, column])
            offset = self.distance[heard, column] / thickness
            result[heard, column] = base_stress(spectrum[contact[heard]], rt / thickness, offset)
        return result
