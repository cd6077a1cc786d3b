"""Frequency responses that a causal, minimum-phase path can have; convention e^(+i w t).

A magnitude law is completed by Bode's relation (Bode 1945, section 14)::

    phase(f0) = (1/pi) int dA/du ln coth(|u - u0|/2) du,    A = ln|H|, u = ln f,

taken exactly for a piecewise linear A(u), whose kernel integrates to a dilogarithm. Closed forms are used where there
are any.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline
from scipy.special import spence

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

REFERENCE_HZ = 30.0
STEP_WIDTH = 0.12
FREQUENCY_FORMS = ("linear", "power", "exponential", "saturating", "threshold", "step", "periodic", "peak", "free")
FREE_KNOTS = 5


def _kernel_integral(v: Array) -> Array:
    """int_0^v ln coth(t/2) dt = pi^2/4 - Li2(e^-v) + Li2(-e^-v), odd in v."""
    x = np.exp(-np.abs(v))
    return np.asarray(np.sign(v) * (np.pi**2 / 4.0 - spence(1.0 - x) + spence(1.0 + x)))


@dataclass(frozen=True)
class MinimumPhase:
    """Completes magnitudes on a wide logarithmic grid to complex responses at the measured frequencies."""

    frequency_hz: Array
    grid_hz: Array = field(default_factory=lambda: np.geomspace(1e-4, 1e8, 1201))
    operator: Array = field(init=False)

    def __post_init__(self) -> None:
        u, u0 = np.log(self.grid_hz), np.log(self.frequency_hz)
        primitive = _kernel_integral(u[None, :] - u0[:, None])
        object.__setattr__(self, "operator", np.diff(primitive, axis=1) / np.diff(u) / np.pi)

    def __call__(self, log_magnitude: Callable[[Array], Array]) -> Complex:
        """H at the measured frequencies from a function f [Hz] -> ln|H|."""
        phase = self.operator @ np.diff(log_magnitude(self.grid_hz))
        return np.asarray(np.exp(log_magnitude(self.frequency_hz) + 1j * phase))


def free_spline(knots_hz: Array, values: Array) -> Callable[[Array], Array]:
    """ln|H| as a cubic spline of ln f, constant beyond the outer knots."""
    spline = CubicSpline(np.log(knots_hz), values, bc_type="clamped")
    return lambda f: np.asarray(spline(np.clip(np.log(f), np.log(knots_hz[0]), np.log(knots_hz[-1]))))


def frequency_law(form: str, p: Array, phase: MinimumPhase) -> Complex:
    """The response of one form; p[0] is its strength, the others are scaled parameters.

    =========== =================================================== =================================
    form        H                                                   p
    =========== =================================================== =================================
    linear      abs(H) = 1 + A f/f_top, level above 2 f_top         A
    power       (i f/30 Hz)^n                                       n
    exponential exp(-A sqrt(i f/f_top)), a diffusive path           A
    saturating  1 + A i f/(f_c + i f)                               A, ln f_c
    threshold   (1 + i f/f_c)^n                                     n, ln f_c
    step        ln abs(H) = A/(1 + (f/f_c)^(-1/0.12))               A, ln f_c
    periodic    1 + A exp(-i 2 pi f T), an echo                     A, ln 1/T
    peak        (1-v^2+2i z(1+A) v)/(1-v^2+2i z v), v = f/f_0       A (< 0: notch), ln f_0, ln z
    free        ln abs(H) a clamped cubic spline of ln f            values at the knots (first is 0)
    =========== =================================================== =================================
    """
    f, top = phase.frequency_hz, float(phase.frequency_hz[-1])
    if form == "power":
        return np.asarray(np.exp(p[0] * (np.log(f / REFERENCE_HZ) + 0.5j * np.pi)))
    if form == "exponential":
        return np.asarray(np.exp(-p[0] * np.sqrt(1j * f / top)))
    if form == "linear":
        return phase(lambda g: np.log(np.maximum(1.0 + p[0] * np.minimum(g / top, 2.0), 0.05)))
    if form == "free":
        knots = np.geomspace(f[0], top, FREE_KNOTS)
        return phase(free_spline(knots, np.concatenate([[0.0], p])))
    v = np.asarray(f / np.exp(p[1]))
    if form == "saturating":
        return np.asarray(1.0 + p[0] * 1j * v / (1.0 + 1j * v))
    if form == "threshold":
        return np.asarray((1.0 + 1j * v) ** p[0])
    if form == "step":
        return phase(lambda g: p[0] / (1.0 + np.exp(-np.clip((np.log(g) - p[1]) / STEP_WIDTH, -60.0, 60.0))))
    if form == "periodic":
        return np.asarray(1.0 + p[0] * np.exp(-2j * np.pi * v))
    if form == "peak":
        z = np.exp(p[2])
        return np.asarray((1.0 - v**2 + 2j * z * (1.0 + p[0]) * v) / (1.0 - v**2 + 2j * z * v))
    raise ValueError(f"no frequency form {form!r}")


def starts(form: str, frequency_hz: Array) -> list[Array]:
    """Starting points of a fit of one form: both signs, locations over the measured band."""
    low, top = float(frequency_hz[0]), float(frequency_hz[-1])
    places = np.log(np.geomspace(1.5 * low, top, 9))
    if form in ("linear", "power"):
        return [np.array([s]) for s in (-0.1, 0.1)]
    if form == "exponential":
        return [np.array([0.1])]
    if form == "free":
        return [np.zeros(FREE_KNOTS - 1)]
    if form == "periodic":
        return [np.array([s, np.log(top / n)]) for s in (-0.1, 0.1) for n in np.geomspace(0.15, 6.0, 24)]
    if form == "peak":
        return [np.array([s, x, np.log(z)]) for s in (-0.3, 0.3) for x in places for z in (0.05, 0.3)]
    return [np.array([s, x]) for s in (-0.1, 0.1) for x in places]


def bounds(form: str, frequency_hz: Array) -> tuple[Array, Array]:
    """Limits that keep each form minimum-phase and its location near the measured band."""
    low, top = np.log(float(frequency_hz[0]) / 3.0), np.log(float(frequency_hz[-1]) * 3.0)
    if form == "free":
        return np.full(FREE_KNOTS - 1, -3.0), np.full(FREE_KNOTS - 1, 3.0)
    least = {"exponential": 0.0, "linear": -0.45, "saturating": -0.95, "periodic": -0.95, "peak": -0.98}.get(form, -3.0)
    most = {"peak": 30.0, "periodic": 0.95}.get(form, 3.0)
    if form in ("linear", "power", "exponential"):
        return np.array([least]), np.array([most])
    if form == "periodic":
        return np.array([least, np.log(float(frequency_hz[-1]) / 12.0)]), np.array([most, top + 2.0])
    if form == "peak":
        return np.array([least, low, np.log(0.01)]), np.array([most, top, np.log(1.0)])
    return np.array([least, low]), np.array([most, top])
