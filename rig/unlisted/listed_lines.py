"""Catalogue mechanisms that show along the frequency; G = A_i H(f), the amplitude A_i of each recording free.

=================== ======================================================== =============================
mechanism           H                                                        p
=================== ======================================================== =============================
timing_delay        exp(-i w t0), of either sign                             w_top t0
amplifier_high_pass i f/(f_c + i f)                                          ln f_c
sensor_relaxation   (i f/30 Hz)^(-n), or 1 + s/(1 + i f/f_s)                 n, or s and ln f_s
contact_resonance   1/(1 - v^2 + 2 i zeta v), v = f/f_0 with the contact     ln m, ln zeta
mains_pickup        G + (q/Fd) of random phase within 3 Hz of n 50 or 60 Hz  q in units of its lines' noise
=================== ======================================================== =============================

For mains_pickup the sum of squares is -2 ln likelihood: lines at the mains have the variance (q/Fd)^2/2 on top in Re
and Im, and ln(1 + that over the noise) is added for each.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from rig.unlisted.bench import companion_response
from rig.unlisted.fits import Lines
from rig.unlisted.layer import stiffness_ratio
from rig.unlisted.listed import Form, Point, least_chi2
from rig.unlisted.response import REFERENCE_HZ

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

MAINS_WIDTH_HZ = 3.0
COMPANION_SLACK = 3.0
"""How far the logarithms of a companion's parameters may go from the truth."""


def _forms(lines: Lines) -> dict[str, list[Form]]:
    """H (recordings or 1, lines) of each mechanism but mains_pickup."""
    f = lines.design.frequency_hz
    low, top = float(f[0]), float(f[-1])

    def companion(name: str) -> Callable[[Array], Complex]:
        return lambda p: companion_response(lines.design, name, np.exp(p), lines.truth)

    def delay(p: Array) -> Complex:
        return np.asarray(np.exp(-1j * p[0] * f / top))[None]

    def power(p: Array) -> Complex:
        return np.asarray(np.exp(-p[0] * (np.log(f / REFERENCE_HZ) + 0.5j * np.pi)))[None]

    def step(p: Array) -> Complex:
        return np.asarray(1.0 + p[0] / (1.0 + 1j * f / np.exp(p[1])))[None]

    a = float(np.median(lines.truth.radius_mm))
    k = 2e3 * lines.design.modulus_mpa / 0.75 * a * float(stiffness_ratio(np.array(a / lines.design.thickness_mm)))

    def mass(ratio: float) -> float:
        """ln m [g] that puts the resonance at so many times the highest frequency, in the median contact."""
        return float(np.log(1e3 * k / (2.0 * np.pi * top * ratio) ** 2))

    corners: tuple[Point, ...] = tuple((float(np.log(c)),) for c in (0.1 * low, low, 0.2 * top))
    steps: tuple[Point, ...] = tuple((s, float(np.log(c))) for s in (0.1, 1.0) for c in np.geomspace(low, top, 5))
    masses: tuple[Point, ...] = tuple((mass(r), z) for r in (0.4, 1.2, 4.0, 15.0) for z in (-2.3, -0.4))
    return {
        "timing_delay": [Form(delay, ((0.0,), (-1.0,), (1.0,)), (-10.0,), (10.0,))],
        "amplifier_high_pass": [
            Form(companion("amplifier_high_pass"), corners, (np.log(1e-4 * low),), (np.log(10.0 * top),))
        ],
        "sensor_relaxation": [
            Form(power, ((0.0,), (0.2,)), (0.0,), (1.5,)),
            Form(step, steps, (0.0, np.log(0.03 * low)), (50.0, np.log(30.0 * top))),
        ],
        "contact_resonance": [
            Form(companion("contact_resonance"), masses, (mass(300.0), np.log(1e-3)), (mass(0.05), np.log(5.0)))
        ],
    }


def _mains(lines: Lines, mains_hz: float) -> float:
    """The least chi2 with a pick-up at one mains frequency and its harmonics; inf where no line is near."""
    f = lines.design.frequency_hz
    order = np.round(f / mains_hz)
    near = (order > 0) & (np.abs(f - order * mains_hz) <= MAINS_WIDTH_HZ)
    if not near.any():
        return np.inf
    dynamic = lines.design.value("dynamic_force_n")[lines.keep, None]
    unit = near * (float(np.median(dynamic)) / dynamic) * lines.root / np.median(lines.root)

    def residual(p: Array) -> Array:
        extra = (p[0] * unit) ** 2
        r = lines.misfit(lines.response("", p[1:]), 1.0 / np.sqrt(1.0 + extra))
        return np.concatenate([r, np.sqrt(2.0 * np.log1p(extra[:, near])).ravel()])

    starts = [np.array([q, *lines.extra]) for q in (1.0, 20.0)]
    return least_chi2(residual, starts, *_bounds(lines, (0.0,), (1e4,)))


def _bounds(lines: Lines, low: Point, high: Point) -> tuple[Array, Array]:
    return (
        np.concatenate([np.array(low), lines.extra - COMPANION_SLACK]),
        np.concatenate([np.array(high), lines.extra + COMPANION_SLACK]),
    )


def lines_chi2(lines: Lines) -> dict[str, float]:
    """chi2 of all lines under each mechanism but the companion's own; a spectral companion's parameters are free."""

    def least(form: Form) -> float:
        size = len(form.low)

        def residual(p: Array) -> Array:
            return lines.misfit(lines.response("", p[size:]) * form.predict(p[:size]))

        starts = [np.array([*s, *lines.extra]) for s in form.starts]
        return least_chi2(residual, starts, *_bounds(lines, form.low, form.high))

    there = lines.companion.name if lines.companion is not None else ""
    chi2 = {name: min(map(least, forms)) for name, forms in _forms(lines).items() if name != there}
    chi2["mains_pickup"] = min(_mains(lines, mains_hz) for mains_hz in (50.0, 60.0))
    return chi2
