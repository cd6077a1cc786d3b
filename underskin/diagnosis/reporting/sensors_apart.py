"""Which sensors stand apart in d33 where sensors differ: a clause that names them, since a spread names none."""

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.residuals import residuals
from underskin.diagnosis.reporting.numbers import SDS_OF_95
from underskin.units import Floats, Indices

_SPREAD = "sensor_spread"
_LEAST_SENSORS = 4
_LEAST = 0.1  # of d33: sensors of one skin differ by some percent
_APART = 3.0  # standard deviations: of the sensors, by the median absolute deviation, and of its own
_ROBUST = 1.4826  # standard deviations of a normal distribution in its median absolute deviation
_MOST = 3  # that are named


def sensors_apart(problem: FittingProblem, shown: Explanation) -> str:
    """The sensors whose d33 lies far from the others', by how much; empty where none does, or sensors are alike."""
    if _SPREAD not in shown.names or problem.kind != "frf":
        return ""
    numbers, off, deviation = _besides(problem, shown)
    if len(off) < _LEAST_SENSORS:
        return ""
    spread = _ROBUST * float(np.median(np.abs(off)))
    far = np.abs(off) > np.maximum(_LEAST, _APART * np.maximum(spread, deviation))
    rows = np.flatnonzero(far)[np.argsort(-np.abs(off[far]), kind="stable")].tolist()
    names = [problem.lines.campaign.skin.sensors[number].id for number in numbers.tolist()]
    return ", ".join(_clause(names[row], off[row], deviation[row]) for row in rows[:_MOST])


def _besides(problem: FittingProblem, shown: Explanation) -> tuple[Indices, Floats, Floats]:
    """The numbers of the sensors, d33 of each over the sensors' median, less 1, and its standard deviation."""
    levels = shown.best.levels
    found = residuals(problem, shown, levels.gain, levels.position)
    numbers, sensor = np.unique(problem.lines.sensor, return_inverse=True)
    weight = found.gain_deviation**-2
    total = np.bincount(sensor, weight)
    value = 1 + np.bincount(sensor, weight * found.gain) / total
    median = float(np.median(value))
    return numbers, value / median - 1, np.asarray(total**-0.5 / median, dtype=float)


def _clause(sensor: str, off: float, deviation: float) -> str:
    low, high = sorted(100 * abs(off + end * SDS_OF_95 * deviation) for end in (-1, 1))
    side = "below" if off < 0 else "above"
    return f"d33 of sensor {sensor} is {100 * abs(off):.0f} % {side} the others' ({low:.0f} to {high:.0f})"
