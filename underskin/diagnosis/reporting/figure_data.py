"""Numbers behind the figures of a diagnosis, thinned to what a reader can resolve.

- Curves: samples, two predictions, contact points and jumps. Forces are relative to the zero in the air. A prediction
  is what the cell would show: zero offset, drift and gain are fitted per curve. Where it leaves more of the force than
  plain least squares do, the least-squares fit is drawn, whose residual the report quotes: a fit weighted with a noise
  that includes the model's defects may lie far from every sample.
- FRFs: lines, two predictions and the noise of each recording. A prediction holds the fitted gain of the sensor, but
  neither gain nor position error of the single recording; these count as noise.
- Maps and scatter plots: a point is one recording, or one recording over some neighbouring lines where the misfit or
  its explanation depends on the line. Values are means weighted with 1/variance.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from underskin.diagnosis.data.dataset import WORDS, Lines, finite_samples, recording_axes
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.hypothesis import CellResponse, cell_response
from underskin.diagnosis.inference.least_squares import least_squares_reading
from underskin.diagnosis.inference.residuals import Reading
from underskin.diagnosis.localisation import MOST_LINES, axis_values
from underskin.diagnosis.noise import path_fractions
from underskin.diagnosis.reporting.facts import DiagnosisResult
from underskin.diagnosis.reporting.kinds import KINDS
from underskin.recordings.campaign import Campaign, FrfRecording, frf_recordings
from underskin.recordings.curve_course import curve_landmarks
from underskin.units import Array, Complexes, Floats, Indices, readable_unit

_MOST_POINTS = 600  # samples drawn of a curve, or points of a map
_MORE = 1.1  # times the residual of plain least squares
_SAMPLES_NEAR_CORNER = 12  # on either side of a jump or of the deepest sample, all drawn


@dataclass(frozen=True)
class Mark:
    """A point of a curve."""

    displacement_mm: float
    force_n: float


@dataclass(frozen=True)
class ShownCurve:
    """One recording: the drawn samples (shown,) of its `count`, and the means that were fitted (rows,).

    `predicted_n` and `contacts`: force and contact point by the explanations `before` and `after`; `deviation_n`: of
    the force about the latter, from noise and from errors that neighbouring samples share. `snap_in` is the first
    sample in contact after the jump, `pull_off` the last one before its jump; None where there is no jump.
    """

    name: str
    count: int
    sample_mm: Floats  # (shown,)
    sample_n: Floats  # (shown,)
    displacement_mm: Floats  # (rows,)
    force_n: Floats  # (rows,)
    predicted_n: Mapping[str, Floats]  # each (rows,)
    contacts: Mapping[str, Mark]
    deviation_n: Floats  # (rows,)
    snap_in: Mark | None
    pull_off: Mark | None

    @property
    def misfit_percent(self) -> float:
        """100 √(Σ|y − m|²/Σ|y|²) under the explanation after."""
        size = float(np.linalg.norm(self.force_n))
        return 100 * float(np.linalg.norm(self.force_n - self.predicted_n["after"])) / size if size else 0.0


def shown_curves(
    problem: FittingProblem, recorded: Campaign, before: Explanation, after: Explanation
) -> list[ShownCurve]:
    """All fitted curves, the worst explained first; `recorded` holds them with every sample."""
    lines = problem.lines
    raw = {recording.id: recording for recording in recorded.curves}
    _, before_curves = _predictions(problem, before)
    cell, after_curves = _predictions(problem, after)
    deviation = _deviation(problem, after, cell)
    curves = []
    for index, (recording, span) in enumerate(zip(lines.campaign.curves, lines.spans, strict=True)):
        sample_mm, measured, *times = finite_samples(raw[recording.id])
        landmarks = curve_landmarks(sample_mm, measured, *times)
        jumps: list[int | None] = [None, None]
        if recording.kind == "indentation":
            measured = measured - landmarks.zero
            jumps = [landmarks.snap_in, landmarks.detaches]
        snap_in, pull_off = (None if at is None else Mark(float(sample_mm[at]), float(measured[at])) for at in jumps)
        along = path_fractions(sample_mm, measured, landmarks, problem.kind)
        shown = _thinned(along, [landmarks.turn, *(at for at in jumps if at is not None)])
        predicted = {"before": before_curves[index], "after": after_curves[index]}
        curves.append(
            ShownCurve(
                name=recording.id,
                count=len(measured),
                sample_mm=sample_mm[shown],
                sample_n=measured[shown],
                displacement_mm=recording.displacement_mm,
                force_n=lines.value.real[span],
                predicted_n={role: force for role, (force, _) in predicted.items()},
                contacts={role: contact for role, (_, contact) in predicted.items()},
                deviation_n=deviation[span],
                snap_in=snap_in,
                pull_off=pull_off,
            )
        )
    return sorted(curves, key=lambda curve: -curve.misfit_percent)


def plain_reading(problem: FittingProblem, explanation: Explanation, reading: Floats) -> tuple[Floats, Floats] | None:
    """The least-squares fit (parameters,) of indentations and the cells' reading under it (rows,) [N].

    None for other kinds, and where the explanation's most probable `reading` (rows,) [N] leaves no larger residual.
    """
    if problem.kind != "indentation":
        return None
    fit, _ = explanation.least_squares
    plain = least_squares_reading(problem.lines, explanation.model.predict(fit).value.real)
    measured = problem.lines.value.real
    misfit, least_misfit = (float(np.linalg.norm(measured - prediction)) for prediction in (reading, plain))
    return (fit, plain) if misfit > _MORE * least_misfit else None


def _predictions(problem: FittingProblem, explanation: Explanation) -> tuple[CellResponse, list[tuple[Floats, Mark]]]:
    """The cells' response under an explanation; of each curve the force (rows,) [N] and the contact point."""
    lines, fit = problem.lines, explanation.point.fit
    force = explanation.model.predict(fit).value.real
    cell = cell_response(lines, explanation.best.levels, force)
    reading = cell.reading(lines, force)
    fit, reading = plain_reading(problem, explanation, reading) or (fit, reading)
    predicted = []
    for recording, span in zip(lines.campaign.curves, lines.spans, strict=True):
        contact = float(fit[explanation.index(f"contact_point {recording.id}")])
        # The cell's reading in the air just before contact, including any drift
        in_air = np.flatnonzero(recording.displacement_mm[: int(recording.displacement_mm.argmax()) + 1] <= contact)
        shown = reading[span][in_air[-1]] if len(in_air) else cell.offset[span][0]
        predicted.append((reading[span], Mark(contact, float(shown))))
    return cell, predicted


def _deviation(problem: FittingProblem, explanation: Explanation, cell: CellResponse) -> Floats:
    """Standard deviation of each row about the cells' reading (rows,) [N]: less than the noise, since zero, drift and
    gain are fitted."""
    lines, levels = problem.lines, explanation.best.levels
    assert lines.smooth is not None
    noise = (levels.level * lines.deviation) ** 2 + (levels.smooth * lines.smooth.scale) ** 2
    return np.sqrt(np.maximum(noise - cell.variance, 0.0))


def _thinned(way: Floats, corners: list[int]) -> Indices:
    """Indices of the samples drawn: even in the arc length `way` (0 to 1), and all near the corners."""
    count = len(way)
    if count <= _MOST_POINTS:
        return np.arange(count)
    near_corners = [
        np.arange(max(at - _SAMPLES_NEAR_CORNER, 0), min(at + _SAMPLES_NEAR_CORNER + 1, count)) for at in corners
    ]
    return np.unique(np.concatenate([_even(way, _MOST_POINTS), *near_corners]))


MOST_RECORDINGS = 120
_FEWEST_LINES = 40  # drawn of a recording
_MOST_FRF_POINTS = 6000  # drawn of all recordings


@dataclass(frozen=True)
class ShownFrf:
    """One recording: the drawn lines (shown,) of its `count`; responses in pC/N, `predicted` before and after.

    `deviation` (2, shown): standard deviation of the noise about the explanation after, of real and imaginary part.
    `misfits`, before and after: 100 √(Σ|y − m|²/Σ|m|²) over all its lines.
    """

    recording: FrfRecording
    count: int
    frequency_hz: Floats
    measured: Complexes
    predicted: Mapping[str, Complexes]
    deviation: Floats
    misfits: Mapping[str, float]


def shown_frfs(problem: FittingProblem, before: Explanation, after: Explanation) -> list[ShownFrf]:
    """The fitted recordings, the one with the largest misfit after first; at most `MOST_RECORDINGS`, those with the
    largest misfit, equally many of each sensor."""
    lines, recordings = problem.lines, frf_recordings(problem.lines.campaign)
    readings = {"before": Reading.of(problem, before), "after": Reading.of(problem, after)}
    misfits = {
        role: [_misfit_percent(lines.value[span], reading.value[span]) for span in lines.spans]
        for role, reading in readings.items()
    }
    deviation = np.sqrt(readings["after"].of_parts)
    chosen = _worst([recording.sensor for recording in recordings], misfits["after"])
    unit = KINDS["frf"].per_si
    most = int(np.clip(_MOST_FRF_POINTS // len(chosen), _FEWEST_LINES, MOST_LINES))
    shown = []
    for index in chosen:
        span = lines.spans[index]
        rows = span.start + _thinned_lines(lines.frequency[span], most)
        shown.append(
            ShownFrf(
                recording=recordings[index],
                count=span.stop - span.start,
                frequency_hz=lines.frequency[rows],
                measured=unit * lines.value[rows],
                predicted={role: unit * reading.value[rows] for role, reading in readings.items()},
                deviation=unit * deviation[:, rows],
                misfits={role: values[index] for role, values in misfits.items()},
            )
        )
    return shown


def _misfit_percent(measured: Complexes, predicted: Complexes) -> float:
    size = float(np.linalg.norm(predicted))
    return 100 * float(np.linalg.norm(measured - predicted)) / size if size else 100.0


def _worst(sensors: Sequence[str], misfits: Sequence[float]) -> list[int]:
    """Indices of the recordings shown, in order."""
    order = sorted(range(len(misfits)), key=lambda index: -misfits[index])
    if len(order) <= MOST_RECORDINGS:
        return order
    seen: dict[str, int] = {}
    ranks = {}
    for index in order:
        ranks[index] = seen[sensors[index]] = seen.get(sensors[index], -1) + 1
    chosen = set(sorted(order, key=lambda index: ranks[index])[:MOST_RECORDINGS])
    return [index for index in order if index in chosen]


def _thinned_lines(frequency: Floats, most: int) -> Indices:
    """Indices of the lines shown, about even in the logarithm of `frequency`, which rises."""
    count = len(frequency)
    if count <= most:
        return np.arange(count)
    log_frequency = np.log(np.maximum(frequency, np.min(frequency[frequency > 0], initial=np.inf)))
    return _even(log_frequency, most)


def _even(along: Floats, most: int) -> Indices:
    """Indices that are about even in a rising coordinate."""
    targets = np.linspace(along[0], along[-1], most)
    return np.unique(np.minimum(np.searchsorted(along, targets), len(along) - 1))


AXES = {name: f"{words} [{unit}]" if unit else words for name, (words, unit) in WORDS.items()}
_TRAVEL = "displacement_mm"

_LEAST_BINS = 8  # of the lines, so that a shape over them is visible in campaigns of any size
_MOST_LEVELS = 24  # of an axis
_MOST_OF_TRAVEL = 12  # of the displacement, whose labels are long
_DIGITS, _DECIMALS = range(3, 10), range(7)  # tried for labels, until all differ
_ALMOST_ALL = 0.9  # share of the gaps between neighbouring lines that are no wider than a step
_SLACK = 1e-9  # of a step, for lines on its edge
SMALLEST = 0.05  # of the largest response: the least scale of a residual


@dataclass(frozen=True)
class Points:
    """Responses [pC/N], or forces of curves [N]; `deviation` does not include gain scatter, which is relative."""

    recording: Indices  # (points,)
    measured: Complexes  # (points,)
    predicted: Complexes  # (points,)
    deviation: Floats  # (points,) of real and of imaginary part
    gain: float  # standard deviation of a recording's gain; the sensor's gain is in `predicted`

    @property
    def residual_percent(self) -> Complexes:
        """Measured minus predicted over |predicted|, or over 5 % of the largest where that is more."""
        residual: Complexes = 100 * (self.measured - self.predicted) / self._scale
        return residual

    @property
    def noise_percent(self) -> Floats:
        """Standard deviation of the noise over the same scale."""
        noise: Floats = 100 * np.hypot(self.deviation, self.gain * np.abs(self.predicted)) / self._scale
        return noise

    @property
    def _scale(self) -> Floats:
        size = np.abs(self.predicted)
        return np.maximum(size, SMALLEST * size.max())


@dataclass(frozen=True)
class Levels:
    """An axis in steps: the step of each point, and the name and range of values of each step; `title` is that of the
    axis."""

    step: Indices  # (points,)
    names: list[str]
    low: Array  # (steps,)
    high: Array  # (steps,)
    title: str = ""


class Thinned:
    """The assignment of rows to points, each the weighted mean of its rows."""

    def __init__(self, diagnosis: DiagnosisResult, problem: FittingProblem, shown: Explanation) -> None:
        """One point per recording unless region or explanation depend on the line."""
        self.lines = lines = problem.lines
        self.problem = problem
        along = any(axis in diagnosis.region for axis in lines.row_axes)
        by_line = lines.curves or along or any(lines.mechanisms[name].needs_lines for name in shown.names)
        most = max(_MOST_POINTS // lines.recordings, _LEAST_BINS) if by_line else 1
        step = _in_steps(np.round(lines.frequency, 6), most)[2] if lines.curves else _steps_of_lines(lines, most)
        bins = int(step.max()) + 1
        self.by_line = by_line
        self._used, self._point = np.unique(lines.recording * bins + step, return_inverse=True)
        self.recording = self._used // bins
        self._bin = self._used % bins
        self._weight = lines.deviation**-2.0
        self._total = np.bincount(self._point, self._weight)

    def points(self, explanation: Explanation) -> Points:
        """Measured values, and an explanation's prediction with the sensors' fitted gains."""
        lines, levels, reading = self.lines, explanation.best.levels, Reading.of(self.problem, explanation)
        predicted = reading.value
        plain = plain_reading(self.problem, explanation, predicted.real)
        if plain is not None:
            predicted = plain[1].astype(complex)
        shared = reading.variance - (levels.level * lines.deviation) ** 2
        shared += np.maximum(reading.relative - levels.gain**2, 0.0) * np.abs(reading.value) ** 2
        variance = levels.level**2 / self._total + self._mean(shared)
        unit = KINDS[lines.kind].per_si
        return Points(
            recording=self.recording,
            measured=unit * self._complex_mean(lines.value),
            predicted=unit * self._complex_mean(predicted),
            deviation=unit * np.sqrt(variance),
            gain=float(levels.gain),
        )

    def levels(self, axis: str) -> Levels | None:
        """The axis in steps; None where all points have the same value."""
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
        """The steps common to all recordings, neighbours merged where there are too many."""
        _, of_distinct, step = _in_steps(self._bin, _MOST_LEVELS)
        steps = int(of_distinct[-1]) + 1
        if steps < 2:
            return None
        of_row = step[self._point]
        low, high = np.full(steps, np.inf), np.zeros(steps)
        np.minimum.at(low, of_row, frequency)
        np.maximum.at(high, of_row, frequency)
        return Levels(step, _distinct(np.sqrt(low * high), _DIGITS, fractional=False), low, high, AXES["frequency_hz"])

    def axes(self) -> list[str]:
        """The axes of the points, those of the rows first."""
        return [*self.lines.row_axes[: int(self.by_line)], *recording_axes(self.lines.campaign)]

    def _mean(self, column: Floats) -> Floats:
        return np.bincount(self._point, self._weight * column) / self._total

    def _complex_mean(self, column: Complexes) -> Complexes:
        return self._mean(column.real) + 1j * self._mean(column.imag)


def _in_steps(values: Array, most: int) -> tuple[Array, Indices, Indices]:
    """The distinct values, and the step of each of them and of each value: steps of about equal numbers of distinct
    values."""
    distinct, index = np.unique(values, return_inverse=True)
    of_distinct = np.arange(len(distinct)) * min(len(distinct), most) // len(distinct)
    return distinct, of_distinct, of_distinct[index.reshape(-1)]


def _steps_of_lines(lines: Lines, most: int) -> Indices:
    """The step of each line (rows,): even in the logarithm of frequency, the same for all recordings, and so wide that
    nearly every recording has a line in each."""
    positive = lines.frequency[lines.frequency > 0]
    log = np.log(np.maximum(lines.frequency, np.min(positive, initial=np.inf)))
    low, high = (log.min(), log.max()) if len(positive) else (0.0, 0.0)
    same = lines.recording[1:] == lines.recording[:-1]
    widest = float(np.quantile(np.diff(log)[same], _ALMOST_ALL)) if same.any() else np.inf
    count = int(min(most, round((high - low) / widest) + 1)) if 0 < widest < np.inf else 1
    step = np.minimum((log - low) / ((high - low) or 1.0) * count + _SLACK, count - 1).astype(np.intp)
    return np.unique(step, return_inverse=True)[1].reshape(-1)


def _stepped(column: Floats, axis: str) -> Levels:
    """The distinct values of a column as steps, or steps of about equal counts; displacements in a readable unit."""
    most = _MOST_OF_TRAVEL if axis == _TRAVEL else _MOST_LEVELS
    distinct, of_distinct, step = _in_steps(np.round(column, 6), most)
    starts = np.flatnonzero(np.diff(of_distinct, prepend=-1))
    low, high = distinct[starts], distinct[np.append(starts[1:], len(distinct)) - 1]
    middle = (low + high) / 2
    if axis != _TRAVEL:
        return Levels(step, _distinct(middle, _DIGITS, fractional=False), low, high, AXES[axis])
    unit, scale = readable_unit(axis, float(np.abs(distinct).max()))
    names = _distinct(scale * middle, _DECIMALS, fractional=True)
    return Levels(step, names, low, high, f"displacement as recorded [{unit}]")


def _distinct(values: Floats, digits: Iterable[int], *, fractional: bool) -> list[str]:
    """Labels with the fewest digits, or decimals, for which they differ; never a power of ten, nor -0."""
    labels: list[str] = []
    for count in digits:
        rounded = [float(np.format_float_positional(value, count, fractional=fractional)) + 0.0 for value in values]
        labels = [np.format_float_positional(value, trim="-") for value in rounded]
        if len(set(labels)) == len(labels):
            break
    return labels
