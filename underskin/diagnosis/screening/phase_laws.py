"""How near the listed mechanisms come to a course of ln FRF over frequency, in the convention e^(+iωt).

ln H of a high pass is −ln(1 + f_c/(if)): it leads where it attenuates. A low pass, −ln(1 + if/f_c), lags where it does,
and so does a relaxation, −n ln(if) + ln(1 + s/(1 + if/f_s)). A delay −iωt0 lags. The resonance of a tip on its contact,
−ln(1 − r² + 2iζr), lags where it rises. A conjugated FRF contradicts each of them. Strengths have the catalogue's
priors, so that no relaxation far below the band, of a size that nothing has, stands for a conjugated high pass; a delay
is one of the charge, t0 ≥ 0.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from underskin.units import Complexes, Floats

_CHANNEL, _IDEALISED = 1.5e-3, 0.08  # of ln H: what channels differ by, and the share by which a real course departs
_TOLERANCE, _FARTHEST = 1e-3, 30.0  # of a fit, and of its logarithms
_COST = 5.0  # of χ², for each of them


@dataclass(frozen=True)
class _Law:
    """ln H(f; fit, spread), where fit starts, and the centre and the deviation of the prior of each parameter.

    `spread` are the contacts' natural frequencies over the usual one.
    """

    value: Callable[[Floats, Floats, Floats], Complexes]
    starts: Callable[[Floats], tuple[tuple[float, ...], ...]]  # of the bands' frequencies
    centre: tuple[float, ...]
    deviation: tuple[float, ...]


def _exp(logarithm: float) -> float:
    return float(np.exp(np.clip(logarithm, -_FARTHEST, _FARTHEST)))


def _high_pass(frequency: Floats, fit: Floats, _: Floats) -> Complexes:
    return -np.log(1 + _exp(fit[0]) / (1j * frequency))


def _low_pass(frequency: Floats, fit: Floats, _: Floats) -> Complexes:
    return -np.log(1 + 1j * frequency / _exp(fit[0]))


def _relaxation(frequency: Floats, fit: Floats, _: Floats) -> Complexes:
    step = np.abs(fit[1]) / (1 + 1j * frequency / _exp(fit[2]))
    return -np.abs(fit[0]) * np.log(1j * frequency) + np.log(1 + step)


def _delay(frequency: Floats, fit: Floats, _: Floats) -> Complexes:
    return -2e-6j * np.pi * frequency * np.abs(fit[0])


def _lead(frequency: Floats, fit: Floats, _: Floats) -> Complexes:
    return -_delay(frequency, fit, _)


def _resonance(frequency: Floats, fit: Floats, spread: Floats) -> Complexes:
    ratio = frequency[:, None] / (_exp(fit[0]) * spread)
    return -np.log(1 - ratio**2 + 2j * _exp(fit[1]) * ratio).mean(axis=1)


def _loose_part(frequency: Floats, fit: Floats, _: Floats) -> Complexes:
    turn = 1j * frequency / _exp(fit[0])
    return np.log(1 + (fit[2] * turn**2 + fit[3] * turn) / (turn**2 + 2 * _exp(fit[1]) * turn + 1))


_DELAY = _Law(_delay, lambda f: ((1e4 / f[-1],),), (0.0,), (300.0,))
_LEAD = replace(_DELAY, value=_lead)
# As the mechanisms' own files have them: corner 0.5 Hz, upper corner 300 Hz, n 0.08, s 0.4 at 20 Hz, 300 µs, ζ 0.05.
# Where a tip resonates depends on contact and mass, 1 kHz within a factor of 10.
_LAWS: Mapping[str, _Law] = {
    "amplifier_high_pass": _Law(
        _high_pass, lambda f: ((np.log(f[0] / 20),), (np.log(f[0]),)), (-0.7,), (1.5,)
    ),
    "amplifier_low_pass": _Law(
        _low_pass, lambda f: ((np.log(f[-1]),), (np.log(3 * f[-1]),)), (5.7,), (1.5,)
    ),
    "sensor_relaxation": _Law(
        _relaxation,
        lambda f: ((0.01, 1e-3, np.log(20.0)), (1e-4, 0.05, np.log(20.0)), (1e-4, 0.05, np.log(f[-1]))),
        (0.0, 0.0, 3.0),
        (0.08, 0.4, 1.5),
    ),
    "timing_delay": _DELAY,
    "contact_resonance": _Law(
        _resonance,
        lambda f: tuple((np.log(times * f[-1]), -3.0) for times in (0.5, 1.3, 4.0)),
        (np.log(1000.0), -3.0),
        (2.3, 1.0),
    ),
}  # fmt: skip
# A part that vibrates inside the band, as of a cable or a loose screw, or a notch: 1 + (A r² + B r)/(r² + 2ζr + 1),
# r = if/f1. No mechanism lists it, so that it may be of either sign.
_UNLISTED = _Law(
    _loose_part,
    lambda f: tuple((np.log(f[0]) + share * np.log(f[-1] / f[0]), -1.0, size, 0.0)
                    for share, size in product((0.4, 0.6, 0.8, 0.95), (-0.1, 0.1))),
    (5.0, -1.0, 0.0, 0.0),
    (1.5, 1.0, 0.3, 0.3),
)  # fmt: skip


@dataclass(frozen=True)
class Course:
    """A course of ln FRF (bands,), real part and phase each with its deviation; the natural frequencies (any number,)
    of the contacts behind it over the usual one."""

    frequency: Floats
    value: Complexes
    deviation: Complexes  # of the real part and of the phase
    spread: Floats

    @property
    def conjugated(self) -> "Course":
        """The same in the other convention."""
        return Course(self.frequency, self.value.conj(), self.deviation, self.spread)


class Lead(NamedTuple):
    """χ² of the nearest course with a lag of the force channel, as `misfit`, and that lag [µs]."""

    misfit: float
    lag_us: float


def misfit(course: Course) -> float:
    """χ² of the nearest course that at most two mechanisms give, with what their priors and their number cost."""
    alone = {name: _nearest(course, (law,))[0] for name, law in _LAWS.items()}
    first = min(alone, key=lambda name: alone[name])
    pairs = [_nearest(course, (_LAWS[first], law))[0] for name, law in _LAWS.items() if name != first]
    return min(_nearest(course, ())[0], alone[first], *pairs)


def leading(course: Course) -> Lead:
    """The nearest course of a lag of the force channel, alone or beside one mechanism."""
    beside = [(), *((law,) for law in _LAWS.values() if law is not _DELAY)]
    chi2, fit = min((_nearest(course, (_LEAD, *laws)) for laws in beside), key=lambda one: one[0])
    return Lead(chi2, abs(float(fit[0])))


def unlisted_misfit(course: Course) -> float:
    """χ² of the nearest course that a vibrating part or a notch gives, with the same costs."""
    return _nearest(course, (_UNLISTED,))[0]


def _nearest(course: Course, laws: tuple[_Law, ...]) -> tuple[float, Floats]:
    """χ² with its costs, and the parameters of the laws."""
    ends = np.cumsum([0, *(len(law.centre) for law in laws)])
    centre = np.concatenate([[], *(law.centre for law in laws)])
    deviation = np.concatenate([[], *(law.deviation for law in laws)])
    size = _IDEALISED * np.abs(course.value)
    weight = [1 / np.hypot(np.hypot(part, _CHANNEL), size) for part in (course.deviation.real, course.deviation.imag)]
    level = weight[0] ** 2 / (weight[0] ** 2).sum()

    def residual(fit: Floats) -> Floats:
        left = course.value - sum(
            law.value(course.frequency, fit[first:last], course.spread)
            for law, first, last in zip(laws, ends, ends[1:], strict=False)
        )
        parts = [(left.real - level @ left.real) * weight[0], left.imag * weight[1], (fit - centre) / deviation]
        return np.concatenate(parts)

    if not laws:
        return float((residual(np.zeros(0)) ** 2).sum()), np.zeros(0)
    starts = [np.concatenate(start) for start in product(*(law.starts(course.frequency) for law in laws))]
    fitted = (least_squares(residual, start, method="lm", ftol=_TOLERANCE, xtol=_TOLERANCE) for start in starts)
    best = min(fitted, key=lambda one: float(one.cost))
    return float(2 * best.cost) + _COST * len(laws), best.x
