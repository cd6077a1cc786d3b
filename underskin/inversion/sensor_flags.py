"""Sensors that are unlike the others of their array, by the recordings' d33.

Dead, inverted, weak or strong beyond outliers' bounds: such a sensor does not belong to the array's population, and is
left out of its d33. Weak or strong by 5 % and three deviations, of the standard error and the spread over sensors
together: it is marked, and counts. Of two groups of sensors apart by a factor, as of two ranges of an amplifier, none
is weak or strong.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding, statement
from underskin.inversion.mixed_model import ROBUST, Estimate
from underskin.inversion.sensor_groups import LEAST_SPREAD, two_groups
from underskin.units import Floats, Indices, Mask

_DEAD = 0.05  # of the array's d33
_LEAST_PILOT = 1e-3  # of the array's d33: a dead sensor may give exact zeros
_OUTLYING = 5.0  # robust deviations
_WEAK, _STRONG = 0.6, 1 / 0.6  # of the array's d33, and outlying
_UNFIT = {Reason.DEAD, Reason.INVERTED}
_DIFFERS, _LEAST_DIFFERENCE = 3.0, 0.05  # standard deviations, and of the array's d33
_OF_MEDIAN = np.pi / 2  # variance of a median of many over that of their mean
ENOUGH = 3  # recordings of a sensor, or sensors of a condition, for a median robust to one of them


@dataclass(frozen=True)
class Flag:
    """A sensor that is marked, the reason, and the values of its sentence."""

    sensor: str
    flagged_for: Reason
    arguments: Mapping[str, float]

    @property
    def code(self) -> str:
        """dead, inverted, weak, strong, behind_filter, noisy or bent."""
        return str(self.flagged_for.code)

    @property
    def reason(self) -> str:
        """Why, in words with the numbers."""
        return statement(self.flagged_for, self.arguments)

    @property
    def sentence(self) -> str:
        """Sensor and reason in words."""
        return f"sensor {self.sensor}: {self.reason}"


def typical_size(d33: Floats) -> float:
    """The median magnitude of recordings with any charge: dead sensors may give exact zeros."""
    size = np.abs(d33)
    return float(np.median(size[size >= 1e-9 * size.max()]))


def is_alive(value: Floats, deviation: Floats) -> Mask:
    """Which sensors (sensors,) respond beyond noise, and with more than a twentieth of the others' d33."""
    size = np.abs(value)
    return np.asarray(size > np.maximum(_DEAD * _typical(size, deviation), 3 * deviation))


def _typical(size: Floats, deviation: Floats) -> float:
    """The median of values beyond noise; of all where none is, NaN without any."""
    beyond = size > 3 * deviation
    sizes = size[beyond] if beyond.any() else size[np.isfinite(size)]
    return float(np.median(sizes)) if len(sizes) else float("nan")


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
    value, line = _sensor_means(count, sensor, d33, noise)
    size = np.abs(value)
    array = _typical(size, line)
    alive = is_alive(value, line)
    sign = 1.0 if np.sum(np.sign(value[alive])) >= 0 else -1.0
    spread = max(ROBUST * float(np.median(np.abs(size[alive] - array))) if alive.any() else 0.0, LEAST_SPREAD * array)
    flags: dict[int, Flag] = {}
    for index in np.flatnonzero(np.isfinite(value)).tolist():
        outlying = alive.sum() > 3 and abs(size[index] - array) > _OUTLYING * spread
        if not alive[index]:
            reason = Reason.DEAD
        elif value[index] * sign < 0:
            reason = Reason.INVERTED
        elif outlying and size[index] < _WEAK * array:
            reason = Reason.WEAK
        elif outlying and size[index] > _STRONG * array:
            reason = Reason.STRONG
        else:
            continue
        percent = float(100 * value[index] * sign / array)
        flags[index] = Flag(ids[index], reason, {"percent": percent, "others": bool(alive.any())})
    pilot = np.full(count, array)
    pilot[list(flags)] = np.maximum(size[list(flags)], _LEAST_PILOT * array)
    return flags, pilot


def _sensor_means(count: int, sensor: Indices, d33: Floats, noise: Floats) -> tuple[Floats, Floats]:
    """The mean d33 of each sensor's recordings and its standard uncertainty by line noise, NaN without any (sensors,)
    [C/N]."""
    weight = 1 / (noise**2 + (LEAST_SPREAD * typical_size(d33)) ** 2)
    total = np.bincount(sensor, weight, count)
    with np.errstate(invalid="ignore"):
        value = np.bincount(sensor, weight * d33, count) / total
        return value, np.sqrt(np.bincount(sensor, (weight * noise) ** 2, count)) / total


def without_groups(
    ids: Sequence[str], sensor: Indices, d33: Floats, noise: Floats, flags: dict[int, Flag], pilot: Floats
) -> tuple[dict[int, Flag], Floats, Floats, list[Finding]]:
    """The flags and pilots of `population_flags`, the factor of each sensor over its array (sensors,), and the finding
    where the sensors are of two groups: then none is weak or strong, and which group is the array's is not known."""
    value, line = _sensor_means(len(ids), sensor, d33, noise)
    factor = np.ones(len(ids))
    for unfit in (_UNFIT, _UNFIT - {Reason.DEAD}):  # in another unit by 1000, an array calls the right sensors dead
        excluded = {index for index, flag in flags.items() if flag.flagged_for in unfit}
        present = np.setdiff1d(np.flatnonzero(np.abs(value) > 3 * line), list(excluded)).astype(np.intp)
        groups = two_groups(np.abs(value[present]), line[present])
        if groups is not None:
            break
    else:
        return flags, pilot, factor, []
    lower, higher = present[groups.lower], present[groups.higher]
    factor[higher], pilot = groups.factor, pilot.copy()
    pilot[present] = np.abs(value[present])
    named = {"lower": [ids[index] for index in lower], "higher": [ids[index] for index in higher]}
    finding = Finding(Reason.TWO_GROUPS, "", "charge_pc", {**named, "factor": groups.factor})
    return {index: flag for index, flag in flags.items() if index not in present}, pilot, factor, [finding]


def error_from_median(uncertainties: Floats) -> Floats:
    """Standard error of each value less the median of all, from their standard uncertainties (n,)."""
    variance = uncertainties**2
    return np.sqrt(variance + _OF_MEDIAN * np.mean(variance) / len(variance))


def difference_flags(ids: tuple[str, ...], sensors: Estimate, unfit: Mapping[int, Flag]) -> list[Flag]:
    """Sensors unlike the others of their array: by 5 % and 3 √(SE² + s²) from its median, with the standard error SE of
    that difference and the spread s over sensors by their median absolute deviation, robust to those marked. Of the
    array are all that are not `unfit`, which are flagged already. Fewer than three have no median robust to one."""
    of_array = np.array([number for number in range(len(ids)) if number not in unfit], dtype=int)
    of_array = of_array[np.isfinite(sensors.value[of_array])]
    if len(of_array) < ENOUGH:
        return []
    value, deviation = sensors.value[of_array], sensors.uncertainty[of_array]
    middle = float(np.median(value))
    gap = np.abs(value - middle)
    usual = np.hypot(error_from_median(deviation), ROBUST * float(np.median(gap)))
    differs = (gap > _DIFFERS * usual) & (gap > _LEAST_DIFFERENCE * abs(middle))
    return [
        Flag(ids[number], Reason.WEAK if share < 1 else Reason.STRONG, {"percent": 100 * share})
        for number, share in zip(of_array[differs].tolist(), (value[differs] / middle).tolist(), strict=True)
    ]
