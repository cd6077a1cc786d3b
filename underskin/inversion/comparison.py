"""Two campaigns compared: the change of d33 of their sensors and array, and of Young's modulus of their curves."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from underskin.findings.formatting import capital
from underskin.inversion.array_history import array_change_in_words, array_levels, changes, differ_from_zero
from underskin.units import Floats

_MOST_NAMED = 6  # sensors
_WHICH = ("first", "second")


def with_differences(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows of sensors with `{first,second}_pc_per_n` and `…_uncertainty_pc_per_n`, with the second less the first in
    pC/N, its standard uncertainty, the percent, and whether it is beyond chance over the whole array (5 %); None of a
    sensor of only one campaign, and the percent of a first d33 of 0."""
    known = [row for row in rows if None not in (row["first_pc_per_n"], row["second_pc_per_n"])]
    d33, deviation = _both(known)
    gap, of_gap = d33[:, 1] - d33[:, 0], np.hypot(*deviation.T)
    differ = differ_from_zero(gap, of_gap)
    for row, value, uncertainty, beyond in zip(known, gap.tolist(), of_gap.tolist(), differ.tolist(), strict=True):
        row["difference_pc_per_n"], row["difference_uncertainty_pc_per_n"] = value, uncertainty
        first = row["first_pc_per_n"]
        row["difference_percent"] = 100 * value / first if first else None
        row["beyond_chance"] = beyond
    return list(rows)


def in_words(rows: Sequence[Mapping[str, Any]]) -> str:
    """What differs, of rows of `with_differences`: the change of the array's d33, and the sensors that differ beyond
    chance; empty where no sensor is in both campaigns."""
    shared = [row for row in rows if row["difference_pc_per_n"] is not None]
    if not shared:
        return ""
    d33, deviation = map(np.abs, _both(shared))
    with np.errstate(divide="ignore", invalid="ignore"):
        levels = array_levels(np.log(d33), deviation / d33)
    change = changes(np.array([0.0, 1.0]), levels.level[None], levels.deviation[None], gain_scatters=True)
    size, low, high = (float(np.expm1(part[0])) for part in (change.value, change.low, change.high))
    differ = sorted((row for row in shared if row["beyond_chance"]), key=lambda row: -_relative(row))
    named = ", ".join(f"{row['sensor'][:24]} {_size(row)}" for row in differ[:_MOST_NAMED])
    sensors = f"{len(differ) or 'none'} of {len(shared)} sensors differ{'s' if len(differ) == 1 else ''} beyond chance"
    sensors += (
        f": {named}{f' and {len(differ) - _MOST_NAMED} more' if len(differ) > _MOST_NAMED else ''}" if differ else ""
    )
    if not math.isfinite(size):
        return f"{capital(sensors)}."
    of_array = np.exp(levels.level).tolist()
    return f"{array_change_in_words(size, low, high, of_array, 'from the first to the second', None)}; {sensors}."


def _relative(row: Mapping[str, Any]) -> float:
    """How much a sensor differs, for sorting: in percent, and a first d33 of 0 most of all."""
    return math.inf if row["difference_percent"] is None else abs(row["difference_percent"])


def _size(row: Mapping[str, Any]) -> str:
    """A sensor's difference in percent; of a first d33 of 0 in pC/N."""
    percent = row["difference_percent"]
    return f"{row['difference_pc_per_n']:+.3g} pC/N" if percent is None else f"{percent:+.0f} %"


def _both(rows: Sequence[Mapping[str, Any]]) -> tuple[Floats, Floats]:
    """d33 and its standard uncertainty [pC/N] (sensors, 2)."""
    value, deviation = (
        np.array([[row[f"{which}_{part}"] for which in _WHICH] for row in rows], dtype=float).reshape(-1, 2)
        for part in ("pc_per_n", "uncertainty_pc_per_n")
    )
    return value, deviation


@dataclass(frozen=True)
class Mean:
    """A mean of moduli [MPa], or the difference of two, with its 95 % interval from the scatter of the curves; a
    single curve has none."""

    curves: int
    value_mpa: float
    low_mpa: float | None
    high_mpa: float | None


def mean_moduli(first: Floats, second: Floats) -> list[Mean]:
    """The mean of each campaign's moduli [MPa], and the difference second − first (Welch's interval: the variances may
    differ); empty if one campaign has no modulus."""
    from scipy import stats  # slow to import

    if not (first.size and second.size):
        return []
    gap = float(second.mean() - first.mean())
    both_means = [_mean(first), _mean(second)]
    if min(first.size, second.size) < 2 or not (np.ptp(first) or np.ptp(second)):
        return [*both_means, Mean(min(first.size, second.size), gap, None, None)]
    interval = stats.ttest_ind(second, first, equal_var=False).confidence_interval()
    return [*both_means, Mean(min(first.size, second.size), gap, float(interval.low), float(interval.high))]


def _mean(moduli: Floats) -> Mean:
    from scipy import stats

    value = float(moduli.mean())
    if moduli.size < 2:
        return Mean(1, value, None, None)
    half = float(stats.t.ppf(0.975, moduli.size - 1) * moduli.std(ddof=1) / np.sqrt(moduli.size))
    return Mean(moduli.size, value, value - half, value + half)
