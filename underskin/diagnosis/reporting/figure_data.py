"""The numbers behind the figures of a report.

What the figure of a curve shows: its samples, what two explanations predict of it, and the marks on its course.

Forces are less the zero that the samples in the air tell. Predicted ones are what the cell would show of the law's: the
fit grants it the rest of a zero, a drift and a gain, of each curve its own. What leaves more so than by plain least
squares, by which the report says what it leaves, is drawn by those: weighed by noise that has to hold all that it
lacks, it may lie far from every sample.

What the figure of FRFs shows of each recording: its lines, what two explanations predict of them, and the noise.

A prediction holds the gain that the fit found of the sensor, but neither gain nor place of the single recording: how
far these two shift all of its lines is part of the noise, as is the noise of each line.

What the figures of a diagnosis show: measured and predicted responses, thinned to a number that an eye can read.

A point is one recording, or one recording at some neighbouring lines where the misfit or its explanation runs along the
lines. Its values are means weighted with 1/variance.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from underskin.diagnosis.data.dataset import WORDS, Lines, finite_samples, recording_axes, way_along
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.hypothesis import CellResponse, cell_response
from underskin.diagnosis.inference.least_squares import least_squares_reading
from underskin.diagnosis.inference.residuals import whole_prediction
from underskin.diagnosis.localisation import axis_values
from underskin.diagnosis.reporting.numbers import place_of
from underskin.diagnosis.reporting.report import DiagnosisResult
from underskin.recordings.campaign import Campaign, CurveRecording, FrfRecording, frf_recordings
from underskin.recordings.curve_course import curve_landmarks
from underskin.units import Array, Complexes, Floats, Indices, readable_unit

MOST_SAMPLES = 600  # of a curve
_MORE = 1.1  # times what plain least squares leave
_BESIDE_CORNER = 12  # samples on either side of a jump or of the deepest one, all of which are shown


@dataclass(frozen=True)
class Mark:
    """A place on a curve."""

    displacement_mm: float
    force_n: float


@dataclass(frozen=True)
class CurvePrediction:
    """Of one curve by one explanation: the force of its rows (rows,), the standard deviation about it that noise and
    the errors that neighbouring samples share leave (rows,), and where contact begins."""

    force_n: Floats
    deviation_n: Floats
    contact: Mark


@dataclass(frozen=True)
class ShownCurve:
    """One recording: those of its `count` samples that are shown (shown,), and the means that were fitted (rows,).

    `snap_in` is the first sample in contact after that jump, `pull_off` the last one before that; None where no jump
    was found.
    """

    name: str
    count: int
    sample_mm: Floats  # (shown,)
    sample_n: Floats  # (shown,)
    displacement_mm: Floats  # (rows,)
    force_n: Floats  # (rows,)
    before: CurvePrediction
    after: CurvePrediction
    snap_in: Mark | None
    pull_off: Mark | None

    @property
    def left_percent(self) -> float:
        """100 √(Σ|y − m|²/Σ|y|²) of the explanation after."""
        size = float(np.linalg.norm(self.force_n))
        return 100 * float(np.linalg.norm(self.force_n - self.after.force_n)) / size if size else 0.0


def shown_curves(
    problem: FittingProblem, recorded: Campaign, before: Explanation, after: Explanation
) -> list[ShownCurve]:
    """Every curve that was fitted, the worst explained one first; `recorded` holds them with all their samples."""
    raw = {
        entry.id: entry
        for entry in recorded.recordings
        if isinstance(entry, CurveRecording) and entry.kind == problem.kind
    }
    lines = problem.lines
    predicted = zip(_predictions(problem, before), _predictions(problem, after), strict=True)
    curves = []
    for entry, own, both in zip(lines.campaign.recordings, lines.spans, predicted, strict=True):
        assert isinstance(entry, CurveRecording)
        curves.append(_shown(raw[entry.id], entry.displacement_mm, lines.value.real[own], *both))
    return sorted(curves, key=lambda curve: -curve.left_percent)


def plain_reading(problem: FittingProblem, explanation: Explanation, reading: Floats) -> tuple[Floats, Floats] | None:
    """Of indentations of which an explanation's most probable `reading` (rows,) [N] leaves more than plain least
    squares do: the fit (parameters,) by these, and what the cells would show by it (rows,) [N]; else None."""
    if problem.kind != "indentation":
        return None
    fit, _ = explanation.least_squares
    plain = least_squares_reading(problem.lines, explanation.model.predict(fit).value.real)
    measured = problem.lines.value.real
    left, least = (float(np.linalg.norm(measured - one)) for one in (reading, plain))
    return (fit, plain) if left > _MORE * least else None


def _predictions(problem: FittingProblem, explanation: Explanation) -> list[CurvePrediction]:
    """Of each curve."""
    lines, fit = problem.lines, explanation.point.fit
    force = explanation.model.predict(fit).value.real
    cell = cell_response(lines, explanation.best.levels, force)
    reading = cell.reading(lines, force)
    plain = plain_reading(problem, explanation, reading)
    if plain is not None:
        fit, reading = plain
    deviation = _deviation(problem, explanation, cell)
    predicted = []
    for entry, own in zip(lines.campaign.recordings, lines.spans, strict=True):
        assert isinstance(entry, CurveRecording)
        contact = float(fit[place_of(explanation, f"contact_point {entry.id}")])
        # What the cell shows in the air just before, a drift included, whatever describes it
        in_air = np.flatnonzero(entry.displacement_mm[: int(entry.displacement_mm.argmax()) + 1] <= contact)
        shown = reading[own][in_air[-1]] if len(in_air) else cell.offset[own][0]
        predicted.append(CurvePrediction(reading[own], deviation[own], Mark(contact, float(shown))))
    return predicted


def _deviation(problem: FittingProblem, explanation: Explanation, cell: CellResponse) -> Floats:
    """Of each row about what the cells show (rows,) [N]: less than the noise, for zero, drift and gain were fitted."""
    lines, levels = problem.lines, explanation.best.levels
    assert lines.smooth is not None
    shared = [
        np.diag(lines.smooth.part(np.arange(own.start, own.stop)).covariance(levels.smooth)) for own in lines.spans
    ]
    variance = (levels.level * lines.deviation) ** 2 + np.concatenate(shared) - cell.variance
    return np.sqrt(np.maximum(variance, 0.0))


def _shown(
    raw: CurveRecording, displacement: Floats, force: Floats, before: CurvePrediction, after: CurvePrediction
) -> ShownCurve:
    place, measured, *times = finite_samples(raw)
    seen = curve_landmarks(place, measured, *times)
    jumps: list[int | None] = [None, None]
    if raw.kind == "indentation":
        measured = measured - seen.zero
        jumps = [seen.snap_in, None if seen.pull_off is None else seen.pull_off - 1]
    snap_in, pull_off = (None if at is None else Mark(float(place[at]), float(measured[at])) for at in jumps)
    shown = _thinned(way_along(place, measured, seen.noise), [seen.turn, *(at for at in jumps if at is not None)])
    return ShownCurve(
        name=raw.id,
        count=len(measured),
        sample_mm=place[shown],
        sample_n=measured[shown],
        displacement_mm=displacement,
        force_n=force,
        before=before,
        after=after,
        snap_in=snap_in,
        pull_off=pull_off,
    )


def _thinned(way: Floats, corners: list[int]) -> Indices:
    """Which samples are shown of those that lie so far along a curve, 0 to 1: as evenly as they lie, and all beside
    corners."""
    count = len(way)
    if count <= MOST_SAMPLES:
        return np.arange(count)
    even = np.minimum(np.searchsorted(way, np.linspace(0.0, 1.0, MOST_SAMPLES)), count - 1)
    beside = [np.arange(max(at - _BESIDE_CORNER, 0), min(at + _BESIDE_CORNER + 1, count)) for at in corners]
    return np.unique(np.concatenate([even, *beside]))


MOST_RECORDINGS = 120
_FEWEST_LINES, _MOST_LINES = 40, 160  # of a recording
_MOST_FRF_POINTS = 6000  # of all together
_PC_PER_C = 1e12


@dataclass(frozen=True)
class ShownFrf:
    """One recording: those of its `count` lines that are shown (shown,); responses in pC/N.

    `deviation` (2, shown): the noise's standard deviation about the explanation after, of real and imaginary part.
    `left_before`, `left_after`: 100 √(Σ|y − m|²/Σ|m|²) over all its lines.
    """

    name: str
    sensor: str
    indenter_radius_mm: float
    preload_n: float
    count: int
    frequency_hz: Floats
    measured: Complexes
    before: Complexes
    after: Complexes
    deviation: Floats
    left_before: float
    left_after: float


def shown_frfs(problem: FittingProblem, before: Explanation, after: Explanation) -> list[ShownFrf]:
    """The recordings that were fitted, the one that is explained worst after first; of very many those explained worst,
    of each sensor as many as of another."""
    lines = problem.lines
    measured, was, now = (
        _PC_PER_C * rows for rows in (lines.value, *(_predicted(problem, e) for e in (before, after)))
    )
    deviation = _PC_PER_C * _frf_deviation(problem, after)
    left = [[_left_percent(measured[own], rows[own]) for own in lines.spans] for rows in (was, now)]
    chosen = _worst([entry.sensor for entry in frf_recordings(lines.campaign)], left[1])
    most = int(np.clip(_MOST_FRF_POINTS // len(chosen), _FEWEST_LINES, _MOST_LINES))
    shown = []
    for number in chosen:
        entry, own = lines.campaign.recordings[number], lines.spans[number]
        assert isinstance(entry, FrfRecording)
        some = own.start + _thinned_lines(lines.frequency[own], most)
        shown.append(
            ShownFrf(
                name=entry.id,
                sensor=entry.sensor,
                indenter_radius_mm=entry.indenter_radius_mm,
                preload_n=entry.preload_n,
                count=own.stop - own.start,
                frequency_hz=lines.frequency[some],
                measured=measured[some],
                before=was[some],
                after=now[some],
                deviation=deviation[:, some],
                left_before=left[0][number],
                left_after=left[1][number],
            )
        )
    return shown


def _predicted(problem: FittingProblem, explanation: Explanation) -> Complexes:
    """Of each row [C/N], with the sensors' gains and what scatter of the place does to the mean."""
    lines, best = problem.lines, explanation.best
    gain = best.sensor_gains[lines.sensor] + 0.5 * best.levels.position**2 * problem.curvature.laplacian
    predicted: Complexes = whole_prediction(problem, explanation) * np.exp(gain)[lines.recording]
    return predicted


def _frf_deviation(problem: FittingProblem, explanation: Explanation) -> Floats:
    """Of real and imaginary part of each row about the prediction (2, rows) [C/N]: the lines' noise, mains pick-up, and
    gain and place of the recording."""
    lines, best = problem.lines, explanation.best
    levels, predicted = best.levels, _predicted(problem, explanation)
    pickup = best.pickup_variance
    of_line = (levels.level * lines.deviation) ** 2 + (
        pickup if len(pickup) == len(lines.value) else pickup[lines.recording]
    )
    has_position_scatter = levels.position**2 * (best.relative_place_slopes**2).sum(axis=0)
    relative = levels.gain**2 + has_position_scatter + 0.5 * levels.position**4 * problem.curvature.square
    parts = np.array([predicted.real, predicted.imag])
    return np.sqrt(of_line + relative[lines.recording] * parts**2)


def _left_percent(measured: Complexes, predicted: Complexes) -> float:
    size = float(np.linalg.norm(predicted))
    return 100 * float(np.linalg.norm(measured - predicted)) / size if size else 100.0


def _worst(sensors: Sequence[str], left: Sequence[float]) -> list[int]:
    """Which recordings are shown, in order."""
    order = sorted(range(len(left)), key=lambda number: -left[number])
    if len(order) <= MOST_RECORDINGS:
        return order
    seen: dict[str, int] = {}
    ranks = {}
    for number in order:
        ranks[number] = seen[sensors[number]] = seen.get(sensors[number], -1) + 1
    kept = set(sorted(order, key=lambda number: ranks[number])[:MOST_RECORDINGS])
    return [number for number in order if number in kept]


def _thinned_lines(frequency: Floats, most: int) -> Indices:
    """Which of a recording's lines are shown, about evenly over the logarithm of frequency; `frequency` rises."""
    count = len(frequency)
    if count <= most:
        return np.arange(count)
    place = np.log(np.maximum(frequency, np.min(frequency[frequency > 0], initial=np.inf)))
    wanted = np.linspace(place[0], place[-1], most)
    return np.unique(np.minimum(np.searchsorted(place, wanted), count - 1))


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
        has_position_scatter = (explanation.best.relative_place_slopes**2).sum(axis=0)[
            explanation.best.hypothesis.lines.recording
        ]
        variance += levels.position**2 * has_position_scatter * np.abs(prediction.value) ** 2
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
