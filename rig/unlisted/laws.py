"""The hidden laws: the quantity on which they act, their axis, form and name."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from rig.unlisted.design import LOGARITHMIC, NUMBERS, Column, Design
from rig.unlisted.forms import MULTIPLICATIVE, Shape, combine, draw_parameters, possible, shape
from rig.unlisted.response import FREE_KNOTS, FREQUENCY_FORMS

Array = npt.NDArray[np.float64]
Generator = np.random.Generator

STATIC = ("gain", "modulus", "thickness", "contact_radius", "force", "position")
WEIGHTS = {
    "gain": 0.20, "modulus": 0.18, "thickness": 0.13, "contact_radius": 0.12, "force": 0.10, "position": 0.12,
    "frequency_response": 0.15,
}  # fmt: skip
_ANY = ("recorded_at", "time_of_day", "order", "temperature_c", "humidity_percent", "operator")
AXES: dict[str, tuple[str, ...]] = {
    "gain": (*_ANY, "preload_n", "dynamic_force_n", "dwell_s", "load_cycles", "x_mm", "y_mm", "previous_preload_n",
             "supply_v", "amplifier", "indenter_radius_mm"),
    "modulus": (*_ANY, "preload_n", "dynamic_force_n", "dwell_s", "x_mm", "y_mm", "previous_preload_n", "sensor",
                "indenter_radius_mm", "load_cycles"),
    "thickness": ("x_mm", "y_mm", "sensor", "load_cycles", "humidity_percent", "temperature_c", "recorded_at", "order"),
    "contact_radius": ("preload_n",) * 4 + ("indenter_radius_mm", "indenter_radius_mm", "dwell_s", "dynamic_force_n",
                       "previous_preload_n", "humidity_percent"),
    "force": (*_ANY, "preload_n", "indenter_radius_mm", "previous_preload_n", "dwell_s", "load_cycles", "mount"),
    "position": ("recorded_at", "time_of_day", "order", "temperature_c", "operator", "preload_n", "mount",
                 "table_tilt_mrad", "previous_preload_n"),
    "frequency_response": ("frequency_hz",) * 12 + ("temperature_c", "recorded_at", "order", "dwell_s", "preload_n",
                                                    "dynamic_force_n", "previous_preload_n", "operator"),
}  # fmt: skip
LIMIT = {"gain": 0.6, "modulus": 0.9, "thickness": 0.25, "contact_radius": 0.45, "force": 0.9, "loss_angle": 0.3}
"""Largest |u| of a law: logarithms, or radians for the loss angle."""
SPECTRAL_LIMIT = {"linear": 0.4, "power": 0.3, "exponential": 0.8, "saturating": 1.0, "threshold": 0.6, "step": 0.5,
                  "periodic": 0.4, "peak": 0.9, "free": 0.5}  # fmt: skip
"""Largest strength of a law along frequency."""


@dataclass(frozen=True)
class Law:
    """One hidden law.

    For an axis other than `frequency_hz`: u = link(coefficients @ basis). A law on `frequency_response` along such an
    axis is a loss angle u in radians, H = exp(-i u). Along `frequency_hz` the coefficients are p of `frequency_law`.
    """

    acts_on: str
    axis: str
    form: str
    parameters: tuple[float, ...]
    coefficients: tuple[float, ...]
    along: str = ""
    altered: bool = False

    @property
    def name(self) -> str:
        """The form as a report would call it."""
        return "notch" if self.form == "peak" and self.coefficients[0] < 0 else self.form

    @property
    def spectral(self) -> bool:
        """Whether it follows the frequency."""
        return self.axis == "frequency_hz"

    def on(self, design: Design) -> Shape:
        """Its form on the recordings of a design."""
        return shape(self.form, design.columns[self.axis], self.parameters)

    def u(self, design: Design) -> Array:
        """The law's value at each recording."""
        return combine(self.on(design), np.array(self.coefficients), multiplies(self.acts_on))

    def scaled(self, factor: float) -> Law:
        """The same law, so many times as strong."""
        return replace(self, coefficients=tuple(factor * c for c in self.coefficients))


def multiplies(acts_on: str) -> bool:
    """False for positions and loss angles, to which a law is added; True where it multiplies."""
    return acts_on not in ("position", "frequency_response")


def listed(acts_on: str, axis: str, form: str, rising: bool) -> bool:
    """True for laws that the published catalogue already has; these are not drawn."""
    falling_wear = acts_on == "gain" and axis == "load_cycles" and not rising
    return (
        (falling_wear and form in ("linear", "exponential", "saturating", "power", "threshold"))
        or (acts_on == "gain" and axis == "preload_n" and form in ("linear", "saturating", "power", "exponential"))
        or (acts_on == "gain" and axis == "sensor")
        or (acts_on == "modulus" and axis == "preload_n" and rising and form not in ("step", "peak"))
        or (acts_on == "modulus" and axis == "dwell_s" and not rising and form not in ("step", "peak"))
        or (acts_on == "frequency_response" and axis == "frequency_hz" and form == "power" and not rising)
        or (acts_on == "frequency_response" and form == "saturating" and not rising)
    )


def choose(rng: Generator) -> tuple[str, str]:
    """The quantity on which the law acts, and its axis."""
    acts_on = str(rng.choice(list(WEIGHTS), p=list(WEIGHTS.values())))
    return acts_on, str(rng.choice(AXES[acts_on]))


def needs(axis: str) -> frozenset[str]:
    """Columns that a design must have for the law to be visible in its file."""
    wanted = {axis} - {"order", "previous_preload_n", "preload_n", "frequency_hz"}
    if axis == "time_of_day":
        wanted |= {"recorded_at"}
    return frozenset(wanted)


def draw_law(rng: Generator, acts_on: str, axis: str, design: Design) -> Law:
    """A law of unit strength (largest |u| about 1 before `scaled`)."""
    rising = bool(rng.random() < 0.5)
    if axis == "frequency_hz":
        return _draw_spectral(rng, design)
    column = design.columns[axis]
    while True:
        form, rising = _form(rng, acts_on, axis, column), bool(rng.random() < 0.5)
        if not listed(acts_on, axis, form, rising):
            break
    p = draw_parameters(rng, form, axis, column)
    basis = shape(form, column, p).basis
    if form == "periodic":
        angle = rng.uniform(0.0, 2.0 * np.pi)
        c: Array = np.array([np.cos(angle), np.sin(angle)])
    elif form == "free":
        c = np.asarray(rng.uniform(-1.0, 1.0, size=basis.shape[0]))
    else:
        c = np.array([1.0 if rising else -1.0])
    if acts_on == "frequency_response":
        c = np.abs(c)
    c = np.asarray(c / np.ptp(c @ basis))
    altered = acts_on == "contact_radius" and form == "power" and axis in ("preload_n", "indenter_radius_mm")
    along = str(rng.choice(["x", "y"])) if acts_on == "position" else ""
    return Law(acts_on, axis, form, p, tuple(map(float, c)), along, altered)


def _form(rng: Generator, acts_on: str, axis: str, column: Column) -> str:
    forms = [f for f in possible(axis, column) if multiplies(acts_on) or f not in MULTIPLICATIVE]
    if axis in NUMBERS and axis != "table_tilt_mrad":
        forms = [f for f in forms if f != "periodic"]
    if acts_on == "frequency_response":
        return str(rng.choice([f for f in forms if f != "periodic"]))
    if acts_on == "contact_radius" and axis in ("preload_n", "indenter_radius_mm"):
        return "power"
    if "power" in forms and axis in LOGARITHMIC:
        forms = [f for f in forms if f not in ("linear", "exponential")] + ["power"]
    if "periodic" in forms and axis == "time_of_day":
        forms += ["periodic"] * 3
    return str(rng.choice(forms))


def _draw_spectral(rng: Generator, design: Design) -> Law:
    """A minimum-phase response, the same in every recording."""
    f = design.frequency_hz
    form = str(rng.choice(FREQUENCY_FORMS))
    log_frequency = float(np.log(np.exp(rng.uniform(np.log(4.0 * f[0]), np.log(0.5 * f[-1])))))
    sign = 1.0 if form in ("power", "saturating", "exponential") or rng.random() < 0.5 else -1.0
    p: tuple[float, ...] = (sign, log_frequency)
    if form in ("linear", "power", "exponential"):
        p = (sign,)
    elif form == "periodic":
        p = (sign, float(np.log(f[-1] / rng.uniform(1.0, 4.0))))
    elif form == "peak":
        p = (sign, log_frequency, float(np.log(rng.uniform(0.06, 0.3))))
    elif form == "free":
        p = tuple(float(v) for v in rng.uniform(-1.0, 1.0, size=FREE_KNOTS - 1))
    return Law("frequency_response", "frequency_hz", form, (), p)


def spectral_scaled(law: Law, factor: float) -> Law:
    """Strength of a frequency law: its first coefficient, or all of a free one."""
    if law.form == "free":
        return law.scaled(factor)
    return replace(law, coefficients=(factor * law.coefficients[0], *law.coefficients[1:]))
