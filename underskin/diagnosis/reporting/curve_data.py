"""What the figure of a curve shows: its samples, what two explanations predict of it, and the marks on its course.

Forces are less the zero that the samples in the air tell. Predicted ones are what the cell would show of the law's: the
fit grants it the rest of a zero, a drift and a gain, of each curve its own. What leaves more so than by plain least
squares, by which the report says what it leaves, is drawn by those: weighed by noise that has to hold all that it
lacks, it may lie far from every sample.
"""

from dataclasses import dataclass

import numpy as np

from underskin.diagnosis.data.curve_samples import finite_samples
from underskin.diagnosis.data.thinning import way_along
from underskin.diagnosis.inference.curve_nuisances import CellResponse, cell_response
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.least_squares import least_squares_reading
from underskin.diagnosis.reporting.numbers import place_of
from underskin.recordings.campaign import Campaign, CurveRecording
from underskin.recordings.curve_course import course
from underskin.units import Floats, Indices

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
    seen = course(place, measured, *times)
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
