"""What the figures of a diagnosis show: measured and predicted responses, thinned to a number that an eye can read.

A point is one recording, or one recording at some neighbouring lines where the misfit or its explanation runs along the
lines. Its values are means weighted with 1/variance.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from underskin.diagnosis.data.axes import WORDS, recording_axes
from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.residuals import whole_prediction
from underskin.diagnosis.localisation.region import axis_values
from underskin.diagnosis.reporting.curve_data import plain_reading
from underskin.diagnosis.reporting.report import DiagnosisResult
from underskin.units import Array, Complexes, Floats, Indices, readable_unit

AXES = {name: f"{words} [{unit}]" if unit else words for name, (words, unit) in WORDS.items()}
_TRAVEL = "displacement_mm"

_MOST_POINTS = 600
_LEAST_BINS = 8  # of the lines, so that a shape over them can be seen in campaigns of any size
_MOST_LEVELS = 24  # of an axis
_MOST_OF_TRAVEL = 12  # of the displacement, whose labels are long
_DIGITS, _DECIMALS = range(3, 10), range(7)  # of a label: as many as tell it from its neighbours
_ALMOST_ALL = 0.9  # of the gaps between neighbouring lines that are no wider than a step
_SLACK = 1e-9  # of a step, for lines on its edge
_SMALLEST = 0.05  # of the largest response: smaller ones are no scale for a residual


@dataclass(frozen=True)
class Points:
    """Responses in pC/N, forces of curves in N; `deviation` without gain scatter, which is relative."""

    recording: Indices  # (points,)
    measured: Complexes  # (points,)
    predicted: Complexes  # (points,)
    deviation: Floats  # (points,) of real and of imaginary part
    gain: float  # sd of a recording's gain; that of its sensor is in what is predicted

    @property
    def residual_percent(self) -> Complexes:
        """Measured less predicted over |predicted|, or over 5 % of the largest where that is less."""
        size = np.abs(self.predicted)
        residual: Complexes = 100 * (self.measured - self.predicted) / np.maximum(size, _SMALLEST * size.max())
        return residual

    def times(self, factor: float) -> "Points":
        """In a unit of which so many make the one that they are in."""
        return replace(
            self,
            measured=factor * self.measured,
            predicted=factor * self.predicted,
            deviation=factor * self.deviation,
        )

    @property
    def noise_percent(self) -> Floats:
        """Its standard deviation over the same."""
        size = np.abs(self.predicted)
        noise: Floats = 100 * np.hypot(self.deviation, self.gain * size) / np.maximum(size, _SMALLEST * size.max())
        return noise


@dataclass(frozen=True)
class Levels:
    """An axis in steps: of each point the step, of each step its name and the values that it holds; `title` says what
    the names are."""

    step: Indices  # (points,)
    names: list[str]
    low: Array  # (steps,)
    high: Array  # (steps,)
    title: str = ""


class Thinned:
    """Which rows each point is the mean of."""

    def __init__(self, diagnosis: DiagnosisResult, problem: FittingProblem, shown: Explanation) -> None:
        """One point a recording unless region or explanation run along the lines."""
        self.lines = lines = problem.lines
        self.problem = problem
        along = any(axis in diagnosis.region for axis in lines.row_axes)
        by_line = lines.curves or along or any(lines.mechanisms[name].needs_lines for name in shown.names)
        most = max(_MOST_POINTS // lines.recordings, _LEAST_BINS) if by_line else 1
        place = _steps_of_samples(lines.frequency, most) if lines.curves else _steps_of_lines(lines, most)
        bins = int(place.max()) + 1
        self.by_line = by_line
        self._used, self._point = np.unique(lines.recording * bins + place, return_inverse=True)
        self.recording = self._used // bins
        self._bin = self._used % bins
        self._weight = lines.deviation**-2.0
        self._total = np.bincount(self._point, self._weight)

    def points(self, explanation: Explanation) -> Points:
        """Measured, and predicted by an explanation with the sensors' fitted gains."""
        lines, best = self.lines, explanation.best
        levels = best.levels
        gains = np.exp(best.sensor_gains)[lines.sensor][lines.recording]
        predicted = whole_prediction(self.problem, explanation) * gains
        plain = plain_reading(self.problem, explanation, predicted.real)
        if plain is not None:
            predicted = plain[1].astype(complex)
        variance = (levels.level**2 / self._total) + self._mean(self._placed(explanation))
        unit = 1.0 if lines.curves else 1e12
        return Points(
            recording=self.recording,
            measured=unit * self._complex_mean(lines.value),
            predicted=unit * self._complex_mean(predicted),
            deviation=unit * np.sqrt(variance),
            gain=float(levels.gain),
        )

    def levels(self, axis: str) -> Levels | None:
        """The axis in steps; None where all points lie at one."""
        column = axis_values(self.lines, axis, True)
        assert column is not None
        if axis == "frequency_hz":
            return self._of_lines(column)
        if column.dtype.kind != "U":
            column = self._mean(column)
            return _stepped(column, axis) if np.ptp(column) > 0 else None
        first = np.unique(self._point, return_index=True)[1]
        names, step = np.unique(column[first], return_inverse=True)
        return Levels(step.reshape(-1), names.tolist(), names, names, AXES[axis]) if len(names) > 1 else None

    def _of_lines(self, frequency: Floats) -> Levels | None:
        """The steps that all recordings have in common, neighbouring ones together where they are too many."""
        distinct, step = np.unique(self._bin, return_inverse=True)
        steps = min(len(distinct), _MOST_LEVELS)
        if steps < 2:
            return None
        step = step.reshape(-1) * steps // len(distinct)
        of_row = step[self._point]
        low, high = np.full(steps, np.inf), np.zeros(steps)
        np.minimum.at(low, of_row, frequency)
        np.maximum.at(high, of_row, frequency)
        return Levels(step, _distinct(np.sqrt(low * high), _DIGITS, fractional=False), low, high, AXES["frequency_hz"])

    def axes(self) -> list[str]:
        """The axes that the points can be laid out along, those of the rows first."""
        return [*self.lines.row_axes[: int(self.by_line)], *recording_axes(self.lines.campaign)]

    def _placed(self, explanation: Explanation) -> Floats:
        """The variance from positioning and mains pick-up, of each row."""
        prediction, levels = explanation.best.prediction, explanation.best.levels
        variance = np.zeros(len(prediction.value))
        if self.lines.smooth is not None:
            variance += (levels.smooth * self.lines.smooth.scale) ** 2
        placed = (explanation.best.relative_place_slopes**2).sum(axis=0)[explanation.best.hypothesis.lines.recording]
        variance += levels.position**2 * placed * np.abs(prediction.value) ** 2
        variance += explanation.best.pickup_variance
        return variance if len(variance) == len(self.lines.value) else variance[self.lines.recording]

    def _mean(self, column: Floats) -> Floats:
        return np.bincount(self._point, self._weight * column) / self._total

    def _complex_mean(self, column: Complexes) -> Complexes:
        return self._mean(column.real) + 1j * self._mean(column.imag)


def _steps_of_samples(place: Floats, most: int) -> Indices:
    """Steps of like counts of distinct places, of each sample (rows,)."""
    distinct, number = np.unique(np.round(place, 6), return_inverse=True)
    steps: Indices = number.reshape(-1) * min(len(distinct), most) // len(distinct)
    return steps


def _steps_of_lines(lines: Lines, most: int) -> Indices:
    """Steps even in the logarithm of frequency, the same for all recordings, of each line (rows,): so wide that nearly
    every recording has a line in each."""
    positive = lines.frequency[lines.frequency > 0]
    log = np.log(np.maximum(lines.frequency, np.min(positive, initial=np.inf)))
    low, high = (log.min(), log.max()) if len(positive) else (0.0, 0.0)
    same = lines.recording[1:] == lines.recording[:-1]
    widest = float(np.quantile(np.diff(log)[same], _ALMOST_ALL)) if same.any() else np.inf
    count = int(min(most, round((high - low) / widest) + 1)) if 0 < widest < np.inf else 1
    place = np.minimum((log - low) / ((high - low) or 1.0) * count + _SLACK, count - 1).astype(np.intp)
    return np.unique(place, return_inverse=True)[1].reshape(-1)


def _stepped(column: Floats, axis: str) -> Levels:
    """Its distinct values, or as many steps of like counts; a displacement is named in the unit in which it reads
    well."""
    distinct, number = np.unique(np.round(column, 6), return_inverse=True)
    steps = min(len(distinct), _MOST_OF_TRAVEL if axis == _TRAVEL else _MOST_LEVELS)
    of_value = np.arange(len(distinct)) * steps // len(distinct)
    starts = np.searchsorted(of_value, np.arange(steps))
    low, high = distinct[starts], distinct[np.append(starts[1:], len(distinct)) - 1]
    step, middle = of_value[number.reshape(-1)], (low + high) / 2
    if axis != _TRAVEL:
        return Levels(step, _distinct(middle, _DIGITS, fractional=False), low, high, AXES[axis])
    unit, scale = readable_unit(axis, float(np.abs(distinct).max()))
    names = _distinct(scale * middle, _DECIMALS, fractional=True)
    return Levels(step, names, low, high, f"displacement as recorded [{unit}]")


def _distinct(values: Floats, digits: Iterable[int], *, fractional: bool) -> list[str]:
    """As labels that differ, of so few digits, or decimals, as suffice; never as a power of ten, nor -0."""
    labels: list[str] = []
    for count in digits:
        rounded = [float(np.format_float_positional(value, count, fractional=fractional)) + 0.0 for value in values]
        labels = [np.format_float_positional(value, trim="-") for value in rounded]
        if len(set(labels)) == len(labels):
            break
    return labels
