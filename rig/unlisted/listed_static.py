"""Catalogue mechanisms that change ln |FRF| of a recording as a whole; n recordings, N, mm, MPa.

======================  ====================================================  ==========================
mechanism               law                                                   p
======================  ====================================================  ==========================
modulus_error           E -> f E                                              ln f
thickness_error         h -> f h                                              ln f
compressible_layer      M(k; nu), a^3 = 3 F R (1 - nu^2)/(4 E)                nu
interface_slip          shear at the base kappa (G/h) u_r                     1/(1 + kappa)
adhesion                JKR radius and pressure, half space                   sqrt(w), w in J/m^2
layered_contact         radius and pressure of a sphere on the layer          none
strain_stiffening       E (1 + s 0.2 a/R), or E + s F/(pi a^2)                s
preload_dependent_d33   1 + b T0, or 1 + b (1 - exp(-T0/T_s))                 b, then ln T_s
ageing                  1 - r log10(1 + N/n0), or 1 - D (1 - exp(-N/n0))      r or D, ln n0
contact_creep           E (1 - sum g_i (1 - exp(-t/tau_i))), i to 1 or 2      g_i and ln tau_i
moving_contact_edge     (1 - m) sigma + m d(F sigma)/dF                       m
amplitude_nonlinearity  (1 - m) sigma + m (first harmonic of F sigma)/Fd      m
misalignment            commanded position + (dx, dy)                         dx, dy
sensor_spread           one gain for each sensor                              (linear)
crosstalk               sigma + c (sum of sigma at sensors within 1.2 pitch)  c
======================  ====================================================  ==========================

d(F sigma)/dF with Hertz's radius is the sigma of a flat punch of that radius.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rig.unlisted.bench import base_state, film_stress, log_amplitude
from rig.unlisted.contact_pressure import adhesive_contact, layered_contact
from rig.unlisted.design import Design
from rig.unlisted.elastic_layer import layer_transfer
from rig.unlisted.fits import whitener
from rig.unlisted.layer import (
    SMALLEST_SIGMA,
    base_stress,
    hertz_transform,
    log_transmission,
    punch_transform,
    sigma,
    transfer,
)
from rig.unlisted.listed import Form, Point, least_chi2
from rig.unlisted.observed import Observed

Array = npt.NDArray[np.float64]

HARMONIC_NODES = 6
NEAR = 1.2
"""Sensors within so many pitches pass on a share of their charge."""


class Skin:
    """The base model of a design, and what each mechanism makes of it."""

    def __init__(self, design: Design) -> None:
        self.design = design
        self.force, self.sphere = design.value("preload_n"), design.value("indenter_radius_mm")
        self.radius, self.h, self.r_t = design.radius, design.thickness_mm, design.sensor_radius_mm
        self.modulus, self.rho = design.modulus_mpa, design.sensor_radius_mm / design.thickness_mm
        self.offset = np.hypot(*design.offset_xy.T)
        self.wavenumber = transfer()[0]

    def at_radius(self, a: Array) -> Array:
        """ln |FRF| with Hertz's pressure on another radius."""
        return log_transmission(a, self.h, self.r_t, self.offset)

    def stress(self, pressure: Array, m: Array | None = None) -> Array:
        """sigma of a pressure's transform (n, 200), on another layer if M is given."""
        stress = base_stress(pressure, self.rho, self.offset / self.h, m)
        return np.asarray(np.maximum(stress, SMALLEST_SIGMA))

    def hertz(self, a: Array) -> Array:
        """Transform of Hertz's pressure on the radius a, (n, 200)."""
        return hertz_transform(self.wavenumber * (a / self.h)[:, None])

    def forms(self) -> dict[str, list[Form]]:
        """ln |FRF| (n,), up to a constant, under every mechanism that can act in the design."""
        return {
            "modulus_error": [Form(self._modulus, ((0.0,), (-0.7,), (0.7,)), (-2.0,), (2.0,))],
            "thickness_error": [Form(self._thickness, ((0.0,), (-0.6,), (-0.3,), (0.3,), (0.6,)), (-0.7,), (0.7,))],
            "compressible_layer": [Form(self._compressible, ((0.49,), (0.4,), (0.2,)), (0.0,), (0.5,))],
            "interface_slip": [Form(self._slip, ((0.01,), (0.3,), (0.8,)), (0.0,), (0.999,))],
            "adhesion": [Form(self._adhesion, self._adhesion_starts(), (0.0,), (7.0,))],
            "layered_contact": [Form(self._layered)],
            "strain_stiffening": [
                Form(self._strain_stiffening, ((0.1,), (2.0,), (20.0,)), (0.0,), (200.0,)),
                Form(self._pressure_stiffening, ((0.1,), (1.0,), (10.0,)), (0.0,), (100.0,)),
            ],
            "preload_dependent_d33": self._preload_dependent_d33(),
            "ageing": self._ageing(),
            "contact_creep": self._creep(),
            "moving_contact_edge": [self._mix(self._edge())],
            "amplitude_nonlinearity": [self._mix(self._harmonic())],
            "misalignment": [self._misalignment()],
            "crosstalk": self._crosstalk(),
        }

    def _modulus(self, p: Array) -> Array:
        return self.at_radius(self.radius * np.exp(-p[0] / 3.0))

    def _thickness(self, p: Array) -> Array:
        return log_transmission(self.radius, np.full(self.radius.size, self.h * np.exp(p[0])), self.r_t, self.offset)

    def _compressible(self, p: Array) -> Array:
        a = self.radius * np.cbrt((1.0 - p[0] ** 2) / 0.75)
        return np.log(self.stress(self.hertz(a), layer_transfer(float(p[0]))))

    def _slip(self, p: Array) -> Array:
        return np.log(self.stress(self.hertz(self.radius), layer_transfer(0.5, float(p[0] / (1.0 - p[0])))))

    def _adhesion(self, p: Array) -> Array:
        _, pressure = adhesive_contact(self.force, self.sphere, self.modulus, float(p[0] ** 2), self.h)
        return np.log(self.stress(pressure))

    def _adhesion_starts(self) -> tuple[Point, ...]:
        scale = 1e3 * float(np.median(self.force / (3.0 * np.pi * self.sphere)))
        return tuple((float(np.sqrt(x * scale)),) for x in (1e-4, 0.01, 0.3))

    def _layered(self, _: Array) -> Array:
        return np.log(self.stress(layered_contact(self.radius / self.h)[1]))

    def _strain_stiffening(self, p: Array) -> Array:
        """a^3 (1 + c a) = a_H^3 with c = 0.2 s/R, by Newton's method from above."""
        a, c = self.radius, 0.2 * p[0] / self.sphere
        for _ in range(25):
            a = a - (a**3 * (1.0 + c * a) - self.radius**3) / (3.0 * a**2 + 4.0 * c * a**3)
        return self.at_radius(a)

    def _pressure_stiffening(self, p: Array) -> Array:
        """a^3 + c a = a_H^3 with c = s F/(pi E)."""
        a, c = self.radius, p[0] * self.force / (np.pi * self.modulus)
        for _ in range(25):
            a = a - (a**3 + c * a - self.radius**3) / (3.0 * a**2 + c)
        return self.at_radius(a)

    def _preload_dependent_d33(self) -> list[Form]:
        stress = film_stress(self.design, base_state(self.design))
        stress = stress / stress.max()
        base = self.at_radius(self.radius)

        def linear(p: Array) -> Array:
            return base + _log(1.0 + p[0] * stress)

        def saturating(p: Array) -> Array:
            return base + _log(1.0 + p[0] * (1.0 - np.exp(-stress / np.exp(p[1]))))

        starts = tuple((b, np.log(t)) for b in (-0.2, 0.2) for t in (0.1, 0.5))
        return [
            Form(linear, ((0.0,), (-0.3,), (0.5,)), (-0.95,), (20.0,)),
            Form(saturating, starts, (-0.95, np.log(0.01)), (20.0, np.log(10.0))),
        ]

    def _ageing(self) -> list[Form]:
        if "load_cycles" not in self.design.shown:
            return []
        cycles, base = self.design.value("load_cycles"), self.at_radius(self.radius)
        low, high = float(cycles[cycles > 0.0].min()), float(cycles.max())

        def logarithmic(p: Array) -> Array:
            return base + _log(1.0 - p[0] * np.log10(1.0 + cycles / np.exp(p[1])))

        def exponential(p: Array) -> Array:
            return base + _log(1.0 - p[0] * (1.0 - np.exp(-cycles / np.exp(p[1]))))

        starts = tuple((0.1, np.log(n)) for n in np.geomspace(low, high, 4))
        bounds = (0.0, np.log(low / 100.0)), (0.95, np.log(100.0 * high))
        return [Form(logarithmic, starts, *bounds), Form(exponential, starts, *bounds)]

    def _creep(self) -> list[Form]:
        if "dwell_s" not in self.design.shown:
            return []
        dwell = self.design.value("dwell_s")

        def relaxed(p: Array) -> Array:
            remaining = 1.0 - p[::2] @ (1.0 - np.exp(-dwell / np.exp(p[1::2])[:, None]))
            return self.at_radius(self.radius / np.cbrt(np.maximum(remaining, 0.1)))

        single = tuple((0.2, np.log(tau)) for tau in (2.0, 20.0, 200.0))
        low, high = (0.0, np.log(0.1)), (0.8, np.log(1e4))
        return [
            Form(relaxed, single, low, high),
            Form(relaxed, ((0.1, np.log(3.0), 0.1, np.log(100.0)),), (*low, *low), (*high, *high)),
        ]

    def _mix(self, moving: Array) -> Form:
        still = self.stress(self.hertz(self.radius))
        return Form(lambda p: _log((1.0 - p[0]) * still + p[0] * moving), ((0.1,), (0.9,)), (0.0,), (1.0,))

    def _edge(self) -> Array:
        return self.stress(punch_transform(self.wavenumber * (self.radius / self.h)[:, None]))

    def _harmonic(self) -> Array:
        """(1/pi) int sigma(F + Fd sin t)(F + Fd sin t) sin t dt / Fd by Gauss and Chebyshev's rule."""
        x = np.cos(np.pi * (np.arange(HARMONIC_NODES) + 0.5) / HARMONIC_NODES)
        swing = self.design.value("dynamic_force_n") / self.force
        total = np.zeros(self.force.size)
        for node in x:
            part = 1.0 + node * swing
            total = total + node * part * self.stress(self.hertz(self.radius * np.cbrt(part)))
        return np.asarray(2.0 / HARMONIC_NODES * total / swing)

    def _misalignment(self) -> Form:
        offset = self.design.offset_xy

        def moved(p: Array) -> Array:
            return log_transmission(self.radius, self.h, self.r_t, np.hypot(*(offset + p).T))

        angles = np.arange(6) * np.pi / 3.0
        rings = tuple((s * self.h * np.cos(t), s * self.h * np.sin(t)) for s in (0.1, 0.3, 0.7) for t in angles)
        return Form(moved, ((0.0, 0.0), *rings), (-1.5 * self.h,) * 2, (1.5 * self.h,) * 2)

    def _crosstalk(self) -> list[Form]:
        xy = self.design.sensor_xy
        apart = np.hypot(*(xy[:, None] - xy[None]).transpose(2, 0, 1))
        np.fill_diagonal(apart, np.inf)
        if not np.isfinite(apart).any():
            return []
        position = self.design.offset_xy + xy[self.design.sensor]
        near = (apart <= NEAR * apart.min())[self.design.sensor]
        total = np.zeros(self.force.size)
        for j, centre in enumerate(xy):
            away = np.hypot(*(position - centre).T)
            total = total + near[:, j] * sigma(self.radius / self.h, self.rho, away / self.h)
        base = self.at_radius(self.radius)
        ratio = total / self.stress(self.hertz(self.radius))
        return [Form(lambda p: base + _log(1.0 + p[0] * ratio), ((0.0,), (0.3,)), (0.0,), (1.0,))]


def _log(x: Array) -> Array:
    return np.asarray(np.log(np.maximum(x, SMALLEST_SIGMA)))


def static_chi2(observed: Observed, companion: str = "", untouched: Observed | None = None) -> dict[str, float]:
    """chi2 of ln |FRF| under each mechanism; d33 and a static companion's parameter are projected out.

    The companion's own mechanism is fitted in its place, to `untouched`: the same without the companion taken out.
    """
    design = observed.design
    every, base = np.arange(design.count), log_amplitude(design, base_state(design))

    def least(name: str, form: Form) -> float:
        seen = untouched if untouched is not None and name == companion else observed
        white = whitener(seen, every)
        target = white @ seen.residual

        def residual(p: Array) -> Array:
            return np.asarray(target - white @ (form.predict(p) - base))

        return least_chi2(residual, [np.array(s) for s in form.starts], np.array(form.low), np.array(form.high))

    chi2 = {name: min(least(name, f) for f in forms) for name, forms in Skin(design).forms().items() if forms}
    white = whitener(observed, every)
    columns = white @ (design.sensor[:, None] == np.arange(1, len(design.sensor_xy)))
    if columns.shape[1]:
        gains = np.linalg.lstsq(columns, white @ observed.residual, rcond=None)[0]
        chi2["sensor_spread"] = float(((white @ observed.residual - columns @ gains) ** 2).sum())
    return chi2
