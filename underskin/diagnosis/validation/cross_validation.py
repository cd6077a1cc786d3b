"""Predictions of what was left out, and noise that the fit leaves.

How well the recordings are predicted before and after, on groups that were left out whole: extrapolation.

Groups: the highest preload, one sphere (the largest), one sensor (the last), the highest band, the latest day; of a law
that nobody listed, thirds along its axis. Without
the group everything is fitted again: nothing missing, and the choice among the best sets is made again from evidence.
rmse = 100 √(Σ|y − m|²/Σ|m|²) over all groups together, of curves with the measured force in place of m below; the noise
floor is its expectation from the noise alone, for a new recording: gain, positioning and line scatter, and the
sensors' gains where the sensor was not seen.

What groups held out say of the answers, and of laws that nobody listed, which predict within their range only. Whether
what an explanation leaves is noise.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple, dataclass, replace
from typing import Any

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.hypothesis import cell_response
from underskin.diagnosis.noise import NoiseLevels
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.unlisted_search import law_of, nearest_law
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.models.frf import FrfModel
from underskin.mechanisms.unlisted.laws import LagLaw, RecordingLaw, in_plain_words
from underskin.recordings.campaign import curves_of, frf_of
from underskin.units import Floats, Indices, Mask

_STRETCHES = 9  # of a curve
_FURTHEST = 0.6  # of a curve's highest force
_LOADED, _RETURN = 0.02, 0.02  # of the highest force and of the travel: a way back under load
_LEAST_AFTER = 6  # samples beyond the highest force that make a hold or a way back
_LEAST_KEPT = 3  # recordings that must remain
_BEST = 10  # sets among which the choice is repeated
_BEHIND = 15.0  # nats


@dataclass(frozen=True)
class PredictionScore:
    """Sums over held-out rows under one way of predicting them: how far off, how large, and what noise would give."""

    square: float = 0.0  # Σ|y − m|²
    size: float = 0.0  # Σ|m|²
    noise: float = 0.0  # Σ E|y − m|² from noise alone
    log_score: float = 0.0  # Σ log predictive density of the recordings' levels, relative
    recordings: int = 0
    pickup: float = 0.0  # that part of `noise` which is mains pick-up
    unsure: float = 0.0  # of curves: Σ of the variance that the parameters leave, which the rest of a curve told

    def __add__(self, other: "PredictionScore") -> "PredictionScore":
        return PredictionScore(*(one + more for one, more in zip(astuple(self), astuple(other), strict=True)))

    @property
    def rmse_percent(self) -> float:
        """100 √(Σ|y − m|²/Σ|m|²)."""
        return 100 * float(np.sqrt(self.square / self.size)) if self.size > 0 else float("nan")

    @property
    def floor_percent(self) -> float:
        """What noise alone would give."""
        return 100 * float(np.sqrt(self.noise / self.size)) if self.size > 0 else float("nan")


@dataclass(frozen=True)
class HeldOut:
    """One group: its name, what was chosen without it, and how it was predicted."""

    group: str
    chosen: tuple[str, ...]
    before: PredictionScore
    after: PredictionScore


def groups(lines: Lines) -> dict[str, Mask]:
    """The rows of each group that can be left out, with enough recordings remaining."""
    if lines.curves:
        return _parts_of_curves(lines)
    entries = frf_of(lines.campaign)
    columns: dict[str, list[Any]] = {
        "preload_n": [entry.preload_n for entry in entries],
        "indenter_radius_mm": [entry.indenter_radius_mm for entry in entries],
        "sensor": [entry.sensor for entry in entries],
        "recorded_at": [None if entry.recorded_at is None else str(entry.recorded_at)[:10] for entry in entries],
    }
    rows_by_group = {
        f"{name} {largest}": np.array([value == largest for value in column])[lines.recording]
        for name, column in columns.items()
        if None not in column and (largest := max(column)) != min(column)
    }
    edge = float(np.quantile(np.unique(lines.frequency), 0.75))
    if len(np.unique(lines.frequency)) >= 8:
        rows_by_group[f"frequency_hz above {edge:.4g}"] = lines.frequency > edge
    return {
        name: rows
        for name, rows in rows_by_group.items()
        if len(np.unique(lines.recording[~rows])) >= _LEAST_KEPT and rows.any()
    }


def _parts_of_curves(lines: Lines) -> dict[str, Mask]:
    """A curve's contact point is its own, so parts of each are left out: the middle of the way back where there is one,
    else the later half of what is held, else the highest force."""
    force = np.abs(lines.value.real)  # tension is negative
    back, held = np.zeros(len(force), dtype=bool), np.zeros(len(force), dtype=bool)
    for own, entry in zip(lines.spans, curves_of(lines.campaign), strict=True):
        low, high = own.start, own.stop
        travel = entry.displacement_mm - entry.displacement_mm[0]
        if lines.kind == "compression" and -travel.min() > travel.max():  # pulled
            travel = -travel
        turn = int(np.argmax(travel))
        loaded = np.flatnonzero(force[low + turn : high] > _LOADED * force[low:high].max())
        last = turn + (int(loaded[-1]) if len(loaded) else 0)
        peak = int(np.argmax(force[low : low + turn + 1])) if turn else 0
        if last - turn >= _LEAST_AFTER and travel[turn] - travel[last] > _RETURN * float(np.ptp(travel[: turn + 1])):
            third = (last - turn) // 3
            back[low + turn + third : low + turn + 2 * third] = True
        elif high - low - 1 - peak >= _LEAST_AFTER:
            held[high - (high - low - 1 - peak) // 2 : high] = True
    parts = {"the middle of the way back": back, "the later half of what is held": held}
    if back.any() or held.any():
        return {name: rows for name, rows in parts.items() if rows.any()}
    highest = np.maximum.reduceat(force, lines.first)[lines.recording]
    return {f"force above {100 * _FURTHEST:.0f} % of the highest": force > _FURTHEST * highest}


def thirds(lines: Lines, column: Floats) -> dict[str, Mask]:
    """The rows of every third recording along an axis (recordings,), three times: what lies between is predicted; of
    few recordings every third line."""
    names = ("from the first", "from the second", "from the third")
    if lines.recordings < _LEAST_KEPT + len(names):
        line = np.arange(len(lines.value)) - lines.first[lines.recording]
        thirds = {f"every third line {name}": line % len(names) == place for place, name in enumerate(names)}
        return {name: rows for name, rows in thirds.items() if rows.any() and not rows.all()}
    rank = np.argsort(np.argsort(column, kind="stable"), kind="stable")
    return {
        f"every third recording {name}": (rank % len(names) == place)[lines.recording]
        for place, name in enumerate(names)
    }


def stretches(lines: Lines) -> dict[str, Mask]:
    """The rows of every third of nine stretches of each curve, three times: what lies between is predicted."""
    counts = np.bincount(lines.recording)
    row = np.arange(len(lines.value)) - lines.first[lines.recording]
    third = (_STRETCHES * row // counts[lines.recording]) % 3
    names = ("from the first", "from the second", "from the third")
    return {f"every third stretch {name}": third == place for place, name in enumerate(names)}


def hold_out(
    problem: FittingProblem,
    ranked: Sequence[Explanation],
    nothing: Explanation,
    log_prior: Callable[[Explanation], float],
    rows_by_group: Mapping[str, Mask],
) -> list[HeldOut]:
    """Predict each group from the rest; `ranked` are the sets found on everything, the best first."""
    weights = [entry.log_evidence + log_prior(entry) for entry in ranked]
    rivals = [entry for entry, w in zip(ranked, weights, strict=True) if w > weights[0] - _BEHIND][:_BEST]
    each = (_without(problem, name, rows, rivals, nothing, log_prior) for name, rows in rows_by_group.items())
    return [entry for entry in each if entry is not None]


def _without(
    problem: FittingProblem,
    name: str,
    rows: Mask,
    rivals: Sequence[Explanation],
    nothing: Explanation,
    log_prior: Callable[[Explanation], float],
) -> HeldOut | None:
    """Predict one group from the rest; None where the rest does not support the null hypothesis."""
    smaller = FittingProblem(problem.lines.part(~rows), problem.table, problem.beside)
    entries = {entry.names: entry for entry in (nothing, *rivals)}
    fits = {entry.names: entry for entry in smaller.refit(list(entries.values())) if entry is not None}
    if nothing.names not in fits:
        return None
    chosen = max(fits.values(), key=lambda entry: entry.log_evidence + log_prior(entry))
    left = problem.lines.part(rows)
    before, after = (_predict(smaller, fits[names], problem, rows, left) for names in (nothing.names, chosen.names))
    return HeldOut(name, chosen.names, before, after)


def _predict(
    smaller: FittingProblem, explanation: Explanation, problem: FittingProblem, rows: Mask, left: Lines
) -> PredictionScore:
    """Some of the rows, `left` alone, from a fit to others; sensors that were seen keep the gain found for them."""
    model = problem.hypothesis(explanation.names, has_position_scatter=False, whole=True).model
    point, levels = explanation.point, explanation.best.levels
    if not isinstance(model, FrfModel):
        whole = model.predict(point.fit)
        slopes = whole.slopes[explanation.best.hypothesis.mean_indices][:, rows]
        unsure = float(np.einsum("ir,ij,jr->", slopes, explanation.best.covariance, slopes))
        return replace(_predict_curves(problem.lines, levels, whole.value.real, rows, smaller), unsure=unsure)
    whole = model.predict(point.fit, slopes=False, place=False)
    seen = np.isin(left.sensor, smaller.lines.sensor)
    gains = np.zeros(max(int(left.sensor.max()), int(smaller.lines.sensor.max())) + 1)
    fitted_gains = explanation.best.sensor_gains
    gains[: len(fitted_gains)] = fitted_gains
    # A contact on an extremum of σ feels positioning scatter in second order, as in the likelihood
    p2, curvature, recording = levels.position**2, problem.curvature, problem.lines.recording[rows]
    value = whole.value[rows] * np.exp(gains[left.sensor])[left.recording]
    value = value * np.exp(0.5 * p2 * curvature.laplacian)[recording]
    scatter = levels.gain**2 + np.where(seen, 0.0, levels.spread**2)
    noise = scatter[left.recording] * np.abs(value) ** 2 + 2 * (levels.level * left.deviation) ** 2
    has_position_scatter = p2 * (model.relative_place_slopes(point.fit) ** 2).sum(axis=0)
    noise = noise + has_position_scatter[recording] * np.abs(whole.value[rows]) ** 2
    noise = noise + 0.5 * p2**2 * curvature.square[recording] * np.abs(value) ** 2
    pickup_noise = 2 * whole.pickup_variance[rows]
    noise = noise + pickup_noise
    square = np.abs(left.value - value) ** 2
    return replace(_scored(left.first, square, noise, np.abs(value) ** 2), pickup=float(pickup_noise.sum()))


def _predict_curves(
    lines: Lines, levels: NoiseLevels, force: Floats, rows: Mask, smaller: FittingProblem
) -> PredictionScore:
    """Some of the rows, with the gain, the zero and the drift of the cell that the rows fitted to show."""
    fitted = ~rows if len(smaller.lines.value) < len(lines.value) else rows
    cell = cell_response(lines, levels, force, fitted)
    assert lines.smooth is not None
    value = cell.reading(lines, force)
    noise = cell.variance + (levels.level * lines.deviation) ** 2 + (levels.smooth * lines.smooth.scale) ** 2
    recording = lines.recording[rows]
    first = np.flatnonzero(np.diff(recording, prepend=-1))
    # A law may predict no force where there is one, and the zero of force is each explanation's own.
    measured = lines.value.real[rows]
    return _scored(first, (measured - value[rows]) ** 2, noise[rows], measured**2)


def _scored(first: Indices, square: Floats, noise: Floats, size: Floats) -> PredictionScore:
    """From what was missed, what noise would give, and what was predicted (rows,), all squared."""
    each, expected, sizes = (np.add.reduceat(column, first) for column in (square, noise, size))
    sizes = np.maximum(sizes, 1e-300)
    score = -0.5 * (each / expected + np.log(2 * np.pi * expected / sizes))
    return PredictionScore(float(square.sum()), float(size.sum()), float(noise.sum()), float(score.sum()), len(first))


def total(held_out: Sequence[HeldOut]) -> tuple[PredictionScore, PredictionScore]:
    """Before and after, over all groups."""
    none = PredictionScore()
    return sum((entry.before for entry in held_out), none), sum((entry.after for entry in held_out), none)


def in_sample(problem: FittingProblem, explanation: Explanation) -> PredictionScore:
    """The recordings that the explanation was fitted to."""
    every = np.ones(len(problem.lines.value), dtype=bool)
    return _predict(problem, explanation, problem, every, problem.lines)


_LAWS_HELD_OUT = 4  # of laws, and of sets of mechanisms, among which the choice is repeated


def held_out(
    problem: FittingProblem, result: Search, ranked: Sequence[Explanation], nothing: Explanation
) -> list[HeldOut]:
    """What groups held out say; of a law that nobody listed, which predicts within its range only, thirds along it."""
    law = result.law
    if result.answers[0].explanation is not None or law is None:
        return hold_out(problem, ranked, nothing, result.log_prior, groups(problem.lines))
    laws = sorted((entry for entry in result.laws if result.is_supported(entry)), key=result.log_weight, reverse=True)
    both = sorted([*laws[:_LAWS_HELD_OUT], *ranked[:_LAWS_HELD_OUT]], key=result.log_weight, reverse=True)
    return hold_out(problem, both, nothing, result.log_prior, _along(problem, law))


def _along(problem: FittingProblem, law: Explanation) -> dict[str, Mask]:
    """The rows of thirds along the axis of a law that nobody listed."""
    if problem.lines.curves:
        return stretches(problem.lines)
    leading = law_of(problem, law)
    ids = [entry.id for entry in problem.lines.campaign.recordings]
    column = leading.axis.of(ids) if isinstance(leading, RecordingLaw | LagLaw) else np.arange(len(ids), dtype=float)
    return thirds(problem.lines, column)


def of_nearest_law(problem: FittingProblem, result: Search, nothing: Explanation) -> list[Finding]:
    """What the nearest law that nobody listed is worth, where none is stated."""
    nearest = nearest_law(problem, result)
    if nearest is None:
        return []
    found = nearest.explanation
    law = None if found is None else law_of(problem, found)
    if found is None or law is None:
        return [Finding(Reason.NO_SIMPLE_LAW, "", "", {"tried": nearest.tried})]

    def the_law(entry: Explanation) -> float:
        return 0.0 if entry.names == found.names else -np.inf

    groups = hold_out(problem, [found], nothing, the_law, _along(problem, found))
    before, after = total(groups)
    if not (np.isfinite(before.rmse_percent) and np.isfinite(after.rmse_percent)):
        return []
    arguments = {
        "tried": nearest.tried,
        "law": law.description.words,
        "part": "samples" if problem.lines.curves else "recordings",
        "after_percent": after.rmse_percent,
        "before_percent": before.rmse_percent,
    }
    return [Finding(Reason.NO_SIMPLE_LAW, "", "", arguments)]


_ABOVE_NOISE, _LEAST_REMAINDER = 2.0, 3e-3  # times the noise, and of the largest force
NOISY = 2.0  # times what the lines' own roughness says
REACHES_NOISE = 1.5  # times the noise floor: an error that noise explains


def above_noise(problem: FittingProblem, explanation: Explanation, groups: Sequence[HeldOut]) -> list[Finding]:
    """Of curves: a residual above the noise, and held-out parts that are predicted no better than by the base model."""
    if problem.lines.smooth is None:
        return []
    findings = []
    smooth, noise = _smooth_part(problem, explanation)
    if _is_above_noise(smooth, noise):
        findings.append(Finding(Reason.REMAINDER, "", "force_n", {"percent": 100 * smooth, "times": smooth / noise}))
    before, after = total(groups)
    if explanation.names and after.recordings and after.rmse_percent >= before.rmse_percent:
        arguments = {
            "groups": [entry.group for entry in groups],
            "mechanisms": [in_plain_words(problem.lines.mechanisms[name]) for name in explanation.names],
            "before_percent": before.rmse_percent,
            "after_percent": after.rmse_percent,
        }
        findings.append(Finding(Reason.HELD_OUT_NO_BETTER, "", "force_n", arguments))
    return findings


def largest_floor_percent(problem: FittingProblem, null: Explanation, groups: Sequence[HeldOut]) -> float:
    """What noise alone would make of the error, in the recordings and in each group held out, the largest [%]."""
    return max(entry.floor_percent for entry in (in_sample(problem, null), *(entry.before for entry in groups)))


def _smooth_part(problem: FittingProblem, explanation: Explanation) -> tuple[float, float]:
    """Of curves: the size of what is left smoothly, and a sample's noise, both relative to the largest force.

    Noise is at least what neighbouring samples show.
    """
    lines, levels = problem.lines, explanation.best.levels
    assert lines.smooth is not None
    return levels.smooth, max(levels.level, 1.0) * float(np.median(lines.deviation / lines.smooth.scale))


def _is_above_noise(smooth: float, noise: float) -> bool:
    return smooth > max(_ABOVE_NOISE * noise, _LEAST_REMAINDER)
