"""Sensors that stand out of their array, each with the reason: dead, inverted, weak, strong, noisy or bent."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import chdtrc, stdtr

from underskin.findings import english
from underskin.findings.codes import Reason
from underskin.units import Floats, Indices, Mask

if TYPE_CHECKING:
    from underskin.inversion.invert import RecordingD33

_DEAD = 0.05  # of the array's d33
_LEAST_PILOT = 1e-3  # of the array's d33: a dead sensor may give exact zeros
_OUTLYING = 5.0  # robust deviations
_WEAK, _STRONG = 0.6, 1 / 0.6  # of the array's d33, and outlying
_LEAST_SPREAD = 0.03  # of the array's d33, below which sensors are not distinguished
_NOISY = 3.0  # times the array's
_LEAST_BEND = 0.05  # of d33
_FALSE_ALARMS = 1e-3  # per array


@dataclass(frozen=True)
class Flag:
    """A sensor that stands out of its array, why, and the values that the sentence states."""

    sensor: str
    flagged_for: Reason
    arguments: Mapping[str, float]

    @property
    def code(self) -> str:
        """dead, inverted, weak, strong, noisy or bent."""
        return str(self.flagged_for.code)

    @property
    def reason(self) -> str:
        """Why, in words with the numbers."""
        return english.statement(self.flagged_for, self.arguments)

    @property
    def sentence(self) -> str:
        """Sensor and reason in words."""
        return f"sensor {self.sensor}: {self.reason}"


def typical_size(d33: Floats) -> float:
    """The median magnitude of recordings that show any charge: dead sensors may give exact zeros."""
    size = np.abs(d33)
    return float(np.median(size[size >= 1e-9 * size.max()]))


def is_alive(value: Floats, deviation: Floats) -> Mask:
    """Which sensors (sensors,) answer beyond noise, and with more than a twentieth of the others' d33."""
    size = np.abs(value)
    return np.asarray(size > np.maximum(_DEAD * _typical(size, deviation), 3 * deviation))


def _typical(size: Floats, deviation: Floats) -> float:
    """The median of those beyond noise; of all where none is, NaN where nothing is known."""
    beyond = size > 3 * deviation
    known = size[beyond] if beyond.any() else size[np.isfinite(size)]
    return float(np.median(known)) if len(known) else float("nan")


def population_flags(ids: Sequence[str], sensor: Indices, d33: Floats, noise: Floats) -> tuple[dict[int, Flag], Floats]:
    """Sensors that do not belong to the array's population, and each sensor's pilot d33.

    Parameters
    ----------
    ids : (sensors,) texts
        The ids of the sensors.
    sensor : (recordings,) array of int
        The number of each recording's sensor.
    d33, noise : (recordings,) arrays
        d33 of each recording and its standard uncertainty by line noise [C/N].

    Returns
    -------
    flags : dict
        By the number of a sensor that is dead, inverted, weak or strong.
    pilot : (sensors,) array
        [C/N]: the array's median for the sensors that belong to it, the sensor's own magnitude for the others.
    """
    count = len(ids)
    typical = typical_size(d33)
    weight = 1 / (noise**2 + (_LEAST_SPREAD * typical) ** 2)
    total = np.bincount(sensor, weight, count)
    with np.errstate(invalid="ignore"):
        value = np.bincount(sensor, weight * d33, count) / total
        line = np.sqrt(np.bincount(sensor, (weight * noise) ** 2, count)) / total
    size = np.abs(value)
    array = _typical(size, line)
    alive = is_alive(value, line)
    sign = 1.0 if np.sum(np.sign(value[alive])) >= 0 else -1.0
    spread = max(1.4826 * float(np.median(np.abs(size[alive] - array))) if alive.any() else 0.0, _LEAST_SPREAD * array)
    flags: dict[int, Flag] = {}
    for number in np.flatnonzero(np.isfinite(value)).tolist():
        outlying = alive.sum() > 3 and abs(size[number] - array) > _OUTLYING * spread
        if not alive[number]:
            reason = Reason.DEAD
        elif value[number] * sign < 0:
            reason = Reason.INVERTED
        elif outlying and size[number] < _WEAK * array:
            reason = Reason.WEAK
        elif outlying and size[number] > _STRONG * array:
            reason = Reason.STRONG
        else:
            continue
        flags[number] = Flag(ids[number], reason, {"percent": float(100 * value[number] * sign / array)})
    pilot = np.full(count, array)
    pilot[list(flags)] = np.maximum(size[list(flags)], _LEAST_PILOT * array)
    return flags, pilot


def scatter_flags(
    ids: tuple[str, ...], sensor: Indices, rows: "RecordingD33", good: Indices, pilot: Floats, expected: Floats
) -> list[Flag]:
    """Sensors whose lines or recordings scatter, or whose d33 bends with preload, beyond their array's.

    `good` are the rows looked at; `sensor` and `expected`, the relative scatter that the mixed model gives each
    recording, are theirs.
    """
    numbers, member = np.unique(sensor, return_inverse=True)
    level = rows.d33[good] / pilot[sensor]
    lines = rows.line_scatter[good] * np.abs(level)
    line_of = np.array([np.median(lines[member == index]) for index in range(len(numbers))])
    usual = float(np.median(line_of))
    rest = _beyond_common(level, member, rows.condition[good])
    alarm = _FALSE_ALARMS / len(numbers)
    flags = []
    for index, name in enumerate(ids[number] for number in numbers):
        own = member == index
        bend, chance, scatter, freedom = _bend(rest[own], rows.preload[good][own], expected[own])
        if chance < alarm and abs(bend) > _LEAST_BEND:
            flags.append(Flag(name, Reason.BENT, {"percent": 100 * bend}))
        if len(numbers) > 2 and line_of[index] > _NOISY * usual:
            flags.append(Flag(name, Reason.NOISY_LINES, {"times": float(line_of[index] / usual)}))
        elif scatter > _NOISY and chdtrc(freedom, freedom * scatter**2) < alarm:
            flags.append(Flag(name, Reason.NOISY_RECORDINGS, {"times": scatter}))
    return flags


def _beyond_common(level: Floats, member: Indices, condition: Indices) -> Floats:
    """Each recording over its sensor's median, less what its condition does to all sensors (three or more)."""
    median = np.array([np.median(level[member == index]) for index in range(member.max() + 1)])
    own = level / median[member]
    rest = own - 1
    for number in np.unique(condition):
        alike = condition == number
        if len(np.unique(member[alike])) > 2:
            rest[alike] = own[alike] - np.median(own[alike])
    return rest


def _bend(rest: Floats, preload: Floats, expected: Floats) -> tuple[float, float, float, int]:
    """Curvature over the range of preloads, the chance of one as large, the scatter about the curve over the one
    expected, and its degrees of freedom."""
    if len(rest) < 6 or len(np.unique(preload)) < 3:
        freedom = max(1, len(rest) - 1)
        return 0.0, 1.0, float(np.sqrt(np.sum((rest / expected) ** 2) / freedom)), freedom
    x = (2 * preload - preload.min() - preload.max()) / (preload.max() - preload.min())
    basis = np.column_stack([np.ones_like(x), x, (3 * x**2 - 1) / 2]) / expected[:, None]
    coefficients = np.linalg.lstsq(basis, rest / expected, rcond=None)[0]
    freedom = len(rest) - 3
    scatter = float(np.sqrt(np.sum((rest / expected - basis @ coefficients) ** 2) / freedom))
    deviation = max(scatter, 1.0) * float(np.sqrt(np.linalg.pinv(basis.T @ basis)[2, 2]))
    chance = 2 * stdtr(freedom, -abs(coefficients[2]) / deviation)
    return 1.5 * float(coefficients[2]), float(chance), scatter, freedom
