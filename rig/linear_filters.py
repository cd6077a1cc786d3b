"""Linear filters between force cell and recorded charge, rational in s = iω, e^(+iωt).

One definition serves both routes: `response` for FRF lines, `apply` for time series (first-order hold).
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter

from rig import effects
from rig.effects import Values
from rig.layer import Floats

Complexes = NDArray[np.complex128]
Term = tuple[Sequence[float], Sequence[float]]  # numerator and denominator, rising powers of s
Filter = Sequence[Term]  # summed

_REFERENCE = 2 * math.pi * 30.0  # rad/s at which relaxation leaves d33 as it is
_LADDER = 2 * math.pi * np.geomspace(0.005, 5e4, 15)  # rad/s, two a decade


def response(chain: Sequence[Filter], frequency_hz: Floats) -> Complexes:
    """Frequency response of a chain of filters.

    Parameters
    ----------
    chain : sequence of Filter
    frequency_hz : ndarray, (lines,)

    Returns
    -------
    ndarray of complex, (lines,)
    """
    s = 2j * math.pi * frequency_hz
    result = np.ones(frequency_hz.shape, dtype=complex)
    for terms in chain:
        result *= sum(polynomial.polyval(s, top) / polynomial.polyval(s, bottom) for top, bottom in terms)
    return result


def apply(chain: Sequence[Filter], signal: Floats, step_s: float) -> Floats:
    """Response of a chain of filters, at rest before, to a signal; first-order hold.

    Linear interpolation between the samples weakens a smooth signal by (ωΔt)²/12; this is compensated before terms with
    inertia, so errors are of order (ωΔt)⁴.

    Parameters
    ----------
    chain : sequence of Filter
    signal : ndarray, (samples,)
    step_s : float
        Time between samples [s].

    Returns
    -------
    ndarray, (samples,)
    """
    for terms in chain:
        sharpened = signal.copy()
        sharpened[1:-1] -= np.diff(signal, n=2) / 12
        passed = np.zeros_like(signal)
        for top, bottom in terms:
            direct = top[-1] / bottom[-1] if len(top) == len(bottom) else 0.0
            inert = polynomial.polysub(top, np.multiply(direct, bottom))[: len(bottom) - 1]
            passed += direct * signal
            if inert.any():
                discrete = cont2discrete((inert[::-1], np.array(bottom[::-1])), step_s, method="foh")
                passed += lfilter(np.ravel(discrete[0]), discrete[1], sharpened)
        signal = passed
    return signal


def resonance(on: Mapping[str, Values], stiffness_n_per_mm: float) -> list[Filter]:
    """Filter from force cell to contact: the tip mass on the contact spring."""
    if "contact_resonance" not in on:
        return []
    # g and N/mm: 1 N/mm over 1 g is 1e6 rad²/s².
    square = 1e6 * stiffness_n_per_mm / max(effects.of(on, "contact_resonance", "tip_mass_g"), 1e-12)
    natural, damping = math.sqrt(square), effects.of(on, "contact_resonance", "damping")
    return [[([1.0], [1.0, 2 * damping / natural, 1 / square])]]


def electrical(on: Mapping[str, Values], preload_n: float) -> list[Filter]:
    """Filters from the contact's charge to the recorded one: sensor, cable, amplifier."""
    chain: list[Filter] = []
    if "sensor_relaxation" in on:
        chain.append(_relaxation(on["sensor_relaxation"]))
    if "amplifier_high_pass" in on:
        chain.append(_high_pass(effects.of(on, "amplifier_high_pass", "corner_hz")))
    if "amplifier_low_pass" in on:
        chain.append(_low_pass(on["amplifier_low_pass"]))
    if "preload_leak" in on:
        power = effects.of(on, "preload_leak", "power")
        chain.append(_high_pass(effects.of(on, "preload_leak", "corner_hz") * preload_n**power))
    if "rattle" in on:
        natural = 2 * math.pi * effects.of(on, "rattle", "hz")
        amplitude, damping = (effects.of(on, "rattle", name) for name in ("amplitude", "damping"))
        chain.append([([1 - amplitude], [1.0]), ([amplitude], [1.0, 2 * damping / natural, 1 / natural**2])])
    if "notch" in on:
        natural, width = (2 * math.pi * effects.of(on, "notch", name) for name in ("hz", "width_hz"))
        remaining = effects.of(on, "notch", "left")
        chain.append([([natural**2, remaining * width, 1.0], [natural**2, width, 1.0])])
    if "cable_motion" in on:
        natural, amplitude = (
            2 * math.pi * effects.of(on, "cable_motion", "hz"),
            effects.of(on, "cable_motion", "amplitude"),
        )
        chain.append([([1.0], [1.0]), ([0.0, 0.0, amplitude], [natural**2, 1.4 * natural, 1.0])])
    return chain


def _high_pass(corner_hz: float) -> Filter:
    return [([0.0, 1.0], [2 * math.pi * corner_hz, 1.0])]


def _low_pass(values: Values) -> Filter:
    time_s = 1 / (2 * math.pi * float(values["corner_hz"]))
    if values["law"] == "first_order":
        return [([1.0], [1.0, time_s])]
    return [([1.0], [1.0, math.sqrt(2) * time_s, time_s**2])]


def _relaxation(values: Values) -> Filter:
    """Debye terms, over their value at the reference frequency.

    The ladder: terms with weight ω_j^(−n) an even way apart in log ω, and what is faster than all of them, sum up to
    ω^(−n) between the ends, since ∫ τ^n/(1 + iωτ) d ln τ = π/sin(πn) (iω)^(−n).
    """
    if values["law"] == "step":
        step = float(values["step"])
        return [([1.0], [1.0]), ([step], [1.0, 1 / (2 * math.pi * float(values["corner_hz"]))])]
    exponent = float(values["exponent"])
    if exponent == 0:
        return [([1.0], [1.0])]
    spacing = math.log(_LADDER[1] / _LADDER[0])
    weights = spacing * (_LADDER / _REFERENCE) ** -exponent
    faster = (_LADDER[-1] * math.exp(spacing / 2) / _REFERENCE) ** -exponent / exponent
    terms: list[Term] = [([faster], [1.0])]
    terms += [([weight], [1.0, 1 / corner]) for weight, corner in zip(weights.tolist(), _LADDER.tolist(), strict=True)]
    level = abs(response([terms], np.array([_REFERENCE / (2 * math.pi)]))[0])
    return [([top[0] / level], bottom) for top, bottom in terms]
