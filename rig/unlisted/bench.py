"""The virtual bench: the state of skin and contact in each recording, companions, and the measured spectra.

FRF = d33 (3/2) (rT/h)^2 sigma(a/h, rT/h, e/h) H(f), with the contact edge held still; the convention is e^(+i w t).
A law on `force` changes the preload that reaches the skin, thus the contact radius; the small dynamic force is measured
at the skin. In this linear layer a force times s, a modulus over s and a radius times s^(1/3) are one and the same.

Companions (catalogue mechanisms), with their laws::

    contact_resonance     H = 1/(1 - v^2 + 2 i zeta v), v = w/w0, w0^2 = k/m, k = 2 E' a stiffness_ratio(a/h)
    amplifier_high_pass   H = i f/(f_c + i f)
    timing_delay          H = exp(-i w t0)
    ageing                d33 (1 - r log10(1 + N/n0)), n0 = 1000
    preload_dependent_d33 d33 (1 + beta T0), T0 = 3 F sigma/(2 pi h^2)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rig.unlisted.design import Design
from rig.unlisted.laws import Law
from rig.unlisted.layer import log_transmission, stiffness_ratio
from rig.unlisted.response import MinimumPhase, frequency_law

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]
Generator = np.random.Generator

CYCLES = 1000.0
SPECTRAL = ("contact_resonance", "amplifier_high_pass", "timing_delay")
_GAUSS_HERMITE = (np.array([-np.sqrt(3.0), 0.0, np.sqrt(3.0)]), np.array([1.0, 4.0, 1.0]) / 6.0)


@dataclass(frozen=True)
class Companion:
    """A catalogue mechanism; `parameters` are m [g], zeta | f_c [Hz] | t0 [us] | r | beta [1/MPa]."""

    name: str
    parameters: tuple[float, ...]


@dataclass(frozen=True)
class State:
    """The true state in each recording."""

    radius_mm: Array
    thickness_mm: Array
    offset_mm: Array
    log_gain: Array
    loss_angle: Array
    force_n: Array


def base_state(design: Design) -> State:
    """The state of the base model: everything as declared."""
    zero = np.zeros(design.count)
    offset = np.hypot(*design.offset_xy.T)
    h = np.full(design.count, design.thickness_mm)
    return State(design.radius, h, offset, zero, zero, design.value("preload_n"))


def state(design: Design, law: Law | None, shift: Array | None = None) -> State:
    """The state under a law; `shift` is a further displacement of each contact, (n, 2), mm."""
    base = base_state(design)
    position = design.offset_xy + (0.0 if shift is None else shift)
    radius, h, gain, angle, force = base.radius_mm, base.thickness_mm, base.log_gain, base.loss_angle, base.force_n
    if law is not None and not law.spectral:
        u = law.u(design)
        match law.acts_on:
            case "gain":
                gain = u
            case "modulus":
                radius = radius * np.exp(-u / 3.0)
            case "force":
                radius, force = radius * np.exp(u / 3.0), force * np.exp(u)
            case "contact_radius":
                radius = radius * np.exp(u)
            case "thickness":
                h = h * np.exp(u)
            case "position":
                position = position + np.outer(u, [1.0, 0.0] if law.along == "x" else [0.0, 1.0])
            case _:
                angle = u
    return State(np.asarray(radius), np.asarray(h), np.hypot(*position.T), gain, angle, np.asarray(force))


def log_amplitude(design: Design, s: State) -> Array:
    """ln |FRF|/d33 without companions."""
    return np.asarray(log_transmission(s.radius_mm, s.thickness_mm, design.sensor_radius_mm, s.offset_mm) + s.log_gain)


def film_stress(design: Design, s: State) -> Array:
    """T0 in MPa: ln(FRF/d33) holds (3/2)(rT/h)^2 sigma, and T0 = F [that]/(pi rT^2)."""
    return np.asarray(s.force_n * np.exp(log_amplitude(design, s) - s.log_gain) / (np.pi * design.sensor_radius_mm**2))


def companion_column(design: Design, companion: Companion, s: State) -> tuple[Array, Array]:
    """A static companion's logarithm of gain and its derivative with respect to its parameter."""
    p = companion.parameters[0]
    if companion.name == "ageing":
        z = -np.log10(1.0 + design.value("load_cycles") / CYCLES)
    elif companion.name == "preload_dependent_d33":
        z = film_stress(design, s)
    else:
        z = np.zeros(design.count)
    factor = np.maximum(1.0 + p * z, 0.05)
    return np.asarray(np.log(factor)), np.asarray(z / factor)


def companion_response(design: Design, name: str, p: Array, s: State) -> Complex:
    """H of a spectral companion, (recordings or 1, lines)."""
    f = design.frequency_hz[None, :]
    if name == "amplifier_high_pass":
        return np.asarray(1j * f / (p[0] + 1j * f))
    if name == "timing_delay":
        return np.asarray(np.exp(-2j * np.pi * f * p[0] * 1e-6))
    if name == "contact_resonance":
        plane = design.modulus_mpa / 0.75 * 1e6
        k = 2.0 * plane * s.radius_mm * 1e-3 * stiffness_ratio(s.radius_mm / s.thickness_mm)
        v = 2.0 * np.pi * f / np.sqrt(k / (p[0] * 1e-3))[:, None]
        return np.asarray(1.0 / (1.0 - v**2 + 2j * p[1] * v))
    return np.ones((1, f.size), dtype=np.complex128)


def draw_companion(rng: Generator, design: Design, law: Law) -> Companion:
    """A companion of moderate strength that does not follow the law's own axis."""
    choices = ["contact_resonance", "amplifier_high_pass", "timing_delay", "preload_dependent_d33"]
    if "load_cycles" in design.shown and law.axis not in ("load_cycles", "recorded_at", "order"):
        choices += ["ageing", "ageing"]
    if law.axis == "preload_n":
        choices.remove("preload_dependent_d33")
    name = str(rng.choice(choices))
    s = state(design, law)
    top = float(design.frequency_hz[-1])
    if name == "contact_resonance":
        a = float(np.median(s.radius_mm))
        ratio = float(stiffness_ratio(np.array(a / design.thickness_mm)))
        k = 2.0 * design.modulus_mpa / 0.75 * 1e6 * a * 1e-3 * ratio
        mass = k / (2.0 * np.pi * top * rng.uniform(1.0, 2.5)) ** 2 * 1e3
        return Companion(name, (float(f"{mass:.4g}"), float(np.round(rng.uniform(0.03, 0.15), 3))))
    if name == "amplifier_high_pass":
        return Companion(name, (float(np.round(np.exp(rng.uniform(np.log(0.15), np.log(2.0))), 3)),))
    if name == "timing_delay":
        return Companion(name, (float(np.round(rng.uniform(0.04, 0.3) / (2.0 * np.pi * top) * 1e6, 1)),))
    if name == "ageing":
        return Companion(name, (float(np.round(rng.uniform(0.04, 0.15), 3)),))
    return Companion(name, (float(f"{rng.uniform(0.1, 0.4) / float(film_stress(design, s).max()):.4g}"),))


def responses(design: Design, law: Law | None, companion: Companion | None, s: State) -> Complex:
    """All that depends on frequency, (recordings, lines)."""
    h = np.exp(-1j * s.loss_angle)[:, None] * np.ones(design.frequency_hz.size)
    if law is not None and law.spectral:
        h = h * frequency_law(law.form, np.array(law.coefficients), MinimumPhase(design.frequency_hz))
    if companion is not None and companion.name in SPECTRAL:
        h = h * companion_response(design, companion.name, np.array(companion.parameters), s)
    return np.asarray(h)


def static_log(design: Design, companion: Companion | None, s: State) -> Array:
    """ln |FRF|/d33 with a static companion."""
    extra = companion_column(design, companion, s)[0] if companion is not None else np.zeros(design.count)
    return np.asarray(log_amplitude(design, s) + extra)


@dataclass(frozen=True)
class Measurement:
    """The recorded data, and what only the bench knows."""

    frf: Complex
    exact: Complex
    coherence: Array
    log_d33: Array
    line_variance: Array
    position_mean: Array
    position_variance: Array


def scatter(design: Design, law: Law | None) -> tuple[Array, Array]:
    """Mean shift and variance of ln |FRF| that a positioning scatter causes: a 3 x 3 Gauss-Hermite rule."""
    if design.noise.position_mm == 0.0:
        return np.zeros(design.count), np.zeros(design.count)
    nodes, weights = _GAUSS_HERMITE
    values, weight = [], []
    for x, wx in zip(nodes, weights, strict=True):
        for y, wy in zip(nodes, weights, strict=True):
            moved = np.tile(design.noise.position_mm * np.array([x, y]), (design.count, 1))
            values.append(log_amplitude(design, state(design, law, moved)))
            weight.append(wx * wy)
    table, w = np.array(values), np.array(weight)
    mean = w @ table
    return np.asarray(mean - log_amplitude(design, state(design, law))), np.asarray(w @ (table - mean) ** 2)


def measure(rng: Generator, design: Design, law: Law | None, companion: Companion | None) -> Measurement:
    """Spectra with gain error, positioning scatter and line noise.

    Re and Im each have variance rel^2 |G|^2 + floor^2 (floor in pC/N); coherence = 1/(1 + 2 n rel^2), the solution of
    rel^2 = (1 - coherence)/(2 n coherence).
    """
    n, noise = design.count, design.noise
    log_d33 = np.log(rng.uniform(8.0, 32.0)) + rng.uniform(0.002, 0.01) * rng.standard_normal(len(design.sensor_xy))
    shift = noise.position_mm * rng.standard_normal((n, 2))
    gain = noise.gain * rng.standard_normal(n)
    s = state(design, law)
    h = responses(design, law, companion, s)
    moved = static_log(design, companion, state(design, law, shift)) if noise.position_mm else None
    level = static_log(design, companion, s)
    exact = np.exp(level + log_d33[design.sensor])[:, None] * h
    real = np.exp((level if moved is None else moved) + log_d33[design.sensor] + gain)[:, None] * h
    rel = noise.relative(design.frequency_hz)
    deviation = np.sqrt((rel * np.abs(real)) ** 2 + noise.floor**2)
    frf = real + deviation * (rng.standard_normal(real.shape) + 1j * rng.standard_normal(real.shape))
    coherence = np.tile(1.0 / (1.0 + 2.0 * noise.averages * rel**2), (n, 1))
    mean, variance = scatter(design, law)
    relative = rel**2 + (noise.floor / np.abs(exact)) ** 2
    return Measurement(np.asarray(frf), np.asarray(exact), coherence, np.asarray(log_d33), relative, mean, variance)
