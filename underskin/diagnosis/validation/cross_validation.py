"""Cross-validation on whole groups of recordings, and whether the residual of an explanation is noise.

Groups held out: the highest preload, one sphere (the largest), one sensor (the last), the highest band, the latest day;
parts of each curve; for an unlisted law, which predicts within its range only, thirds along its axis. Without the group
everything is fitted again: the null hypothesis and the best sets, among which the evidence chooses again.

rmse = 100 √(Σ|y − m|²/Σ|m|²) over all groups together; of curves the measured force replaces m in the denominator. The
noise floor is its expectation from noise alone for a new recording: gain, positioning and line scatter, and the
sensors' gains where the sensor was not in the training data.
"""

import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple, dataclass
from typing import Any

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.evidence import NEGLIGIBLE_NATS
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.residuals import Reading
from underskin.diagnosis.selection.answers import Search, remainder
from underskin.diagnosis.selection.unlisted_search import law_of, nearest_law
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.unlisted.laws import LagLaw, RecordingLaw, in_plain_words
from underskin.recordings.campaign import curves_of, frf_of
from underskin.recordings.curve_course import is_one_sided
from underskin.units import Mask

_STRETCHES = 9  # of a curve
_HIGH_FORCE = 0.6  # of a curve's highest force
_UNLOADING = 0.02  # of the highest force and of the travel: least load and return while unloading in contact
_LEAST_SAMPLES = 6  # beyond the highest force, for a hold or an unloading branch
_LEAST_RECORDINGS = 3  # that must remain
_MOST_RIVALS = 10  # sets among which the choice is repeated
_MOST_EXPLANATIONS = 4  # laws, and sets of mechanisms, among which the choice is repeated


@dataclass(frozen=True)
class PredictionScore:
    """Sums over held-out rows of squared errors, squared size and their expectation from noise, for one prediction."""

    square: float = 0.0  # Σ|y − m|²
    size: float = 0.0  # Σ|m|²
    noise: float = 0.0  # Σ E|y − m|² from noise alone
    log_score: float = 0.0  # Σ log predictive density of the recordings' levels, relative
    recordings: int = 0

    def __add__(self, other: "PredictionScore") -> "PredictionScore":
        return PredictionScore(*map(operator.add, astuple(self), astuple(other)))

    @property
    def rmse_percent(self) -> float:
        """100 √(Σ|y − m|²/Σ|m|²)."""
        return 100 * float(np.sqrt(self.square / self.size)) if self.size > 0 else float("nan")

    @property
    def floor_percent(self) -> float:
        """The rmse from noise alone [%]."""
        return 100 * float(np.sqrt(self.noise / self.size)) if self.size > 0 else float("nan")


@dataclass(frozen=True)
class HeldOut:
    """One group: its name, the set `chosen` without it, its prediction by the null hypothesis and by that set."""

    group: str
    chosen: tuple[str, ...]
    before: PredictionScore
    after: PredictionScore


def rows_of_groups(lines: Lines) -> dict[str, Mask]:
    """The rows of each group that can be left out, with enough recordings remaining."""
    if lines.curves:
        return _curve_parts(lines)
    recordings, names = frf_of(lines.campaign), ("preload_n", "indenter_radius_mm", "sensor", "recorded_at")
    columns: dict[str, list[Any]] = {name: [getattr(recording, name) for recording in recordings] for name in names}
    columns["recorded_at"] = [None if time is None else str(time)[:10] for time in columns["recorded_at"]]
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
        if len(np.unique(lines.recording[~rows])) >= _LEAST_RECORDINGS and rows.any()
    }


def _curve_parts(lines: Lines) -> dict[str, Mask]:
    """Parts of every curve, since a contact point is fitted to each.

    The middle of the unloading branch where there is one, else the later half of the hold, else the highest force.
    """
    force = np.abs(lines.value.real)  # tension is negative
    unloading, hold = np.zeros(len(force), dtype=bool), np.zeros(len(force), dtype=bool)
    for span, recording in zip(lines.spans, curves_of(lines.campaign), strict=True):
        first, end = span.start, span.stop
        if lines.kind == "compression" and not is_one_sided(lines.value.real[span]):
            continue  # from tension to compression or back: neither a way back nor a hold
        travel = recording.displacement_mm - recording.displacement_mm[0]
        if lines.kind == "compression" and -travel.min() > travel.max():  # pulled
            travel = -travel
        turn = int(np.argmax(travel))
        back = np.flatnonzero(travel[turn:] < travel[turn] - _UNLOADING * float(np.ptp(travel[: turn + 1])))
        leave = turn + (int(back[0]) if len(back) else 0)  # a stage that holds may still give a little
        loaded = np.flatnonzero(force[first + leave : end] > _UNLOADING * force[first:end].max())
        last_loaded = leave + (int(loaded[-1]) if len(loaded) else 0)
        peak = int(np.argmax(force[first : first + turn + 1])) if turn else 0
        if len(back) and last_loaded - leave >= _LEAST_SAMPLES:
            third = (last_loaded - leave) // 3
            unloading[first + leave + third : first + leave + 2 * third] = True
        elif end - first - 1 - peak >= _LEAST_SAMPLES:
            hold[end - (end - first - 1 - peak) // 2 : end] = True
    parts = {"the middle of the way back": unloading, "the later half of what is held": hold}
    if unloading.any() or hold.any():
        return {name: rows for name, rows in parts.items() if rows.any()}
    highest = np.maximum.reduceat(force, lines.first)[lines.recording]
    return {f"force above {100 * _HIGH_FORCE:.0f} % of the highest": force > _HIGH_FORCE * highest}


def _groups_along_law(problem: FittingProblem, law: Explanation) -> dict[str, Mask]:
    """The rows of every third recording along the axis of an unlisted law, three times: interpolation.

    Of curves every third of nine stretches, of few recordings every third line.
    """
    lines = problem.lines
    row = np.arange(len(lines.value)) - lines.first[lines.recording]
    if lines.curves:
        what, third = "stretch", _STRETCHES * row // np.bincount(lines.recording)[lines.recording] % 3
    elif lines.recordings < _LEAST_RECORDINGS + 3:
        what, third = "line", row % 3
    else:
        leading, ids = law_of(problem, law), [recording.id for recording in lines.campaign.recordings]
        column = leading.axis.of(ids) if isinstance(leading, RecordingLaw | LagLaw) else np.arange(len(ids))
        rank = np.argsort(np.argsort(column, kind="stable"), kind="stable")
        what, third = "recording", (rank % 3)[lines.recording]
    groups = {f"every third {what} from the {name}": third == n for n, name in enumerate(("first", "second", "third"))}
    return {name: rows for name, rows in groups.items() if rows.any() and not rows.all()}


def hold_out(
    problem: FittingProblem,
    ranked: Sequence[Explanation],
    null: Explanation,
    log_prior: Callable[[Explanation], float],
    rows_by_group: Mapping[str, Mask],
) -> list[HeldOut]:
    """Predict each group from the rest; `ranked` are the sets fitted to all rows, the best first. Groups without which
    the null hypothesis is not supported are left out."""

    def weight(explanation: Explanation) -> float:
        return explanation.log_evidence + log_prior(explanation)

    least = max(map(weight, ranked[:1]), default=0.0) - NEGLIGIBLE_NATS
    rivals = [explanation for explanation in ranked if weight(explanation) > least][:_MOST_RIVALS]
    candidates = list({explanation.names: explanation for explanation in (null, *rivals)}.values())
    predictions = []
    for name, rows in rows_by_group.items():
        training = FittingProblem(problem.lines.part(~rows), problem.table, problem.other_kinds)
        fits = {fit.names: fit for fit in training.refit(candidates) if fit is not None}
        if null.names in fits:
            chosen = max(fits.values(), key=weight)
            before, after = (_predict(problem, fit, rows, ~rows) for fit in (fits[null.names], chosen))
            predictions.append(HeldOut(name, chosen.names, before, after))
    return predictions


def _predict(
    problem: FittingProblem, explanation: Explanation, rows: Mask, fitted: Mask | None = None
) -> PredictionScore:
    """Of some of the rows, from a fit to those that are `fitted`, by default all; sensors among these keep their gain,
    and load cells their gain, zero and drift."""
    lines, reading = problem.lines, Reading.of(problem, explanation, fitted)
    measured, value, recording = lines.value[rows], reading.value[rows], lines.recording[rows]
    noise = lines.parts * reading.variance[rows] + reading.relative[rows] * np.abs(value) ** 2
    # Relative to a measured force: a law may predict none, and each explanation has its own zero of force.
    columns = np.abs(measured - value) ** 2, noise, np.abs(measured if lines.curves else value) ** 2
    first = np.flatnonzero(np.diff(recording, prepend=-1))
    squares, noises, sizes = (np.add.reduceat(column, first) for column in columns)
    sizes = np.maximum(sizes, 1e-300)
    log_scores = -0.5 * (squares / noises + np.log(2 * np.pi * noises / sizes))
    square, expected, size = (float(column.sum()) for column in columns)
    return PredictionScore(square, size, expected, float(log_scores.sum()), len(first))


def total(groups: Sequence[HeldOut]) -> tuple[PredictionScore, PredictionScore]:
    """Before and after, over all groups."""
    before, after = (group.before for group in groups), (group.after for group in groups)
    return sum(before, PredictionScore()), sum(after, PredictionScore())


def in_sample(problem: FittingProblem, explanation: Explanation) -> PredictionScore:
    """Of the recordings that the explanation was fitted to."""
    return _predict(problem, explanation, np.ones(len(problem.lines.value), dtype=bool))


def held_out(
    problem: FittingProblem, result: Search, ranked: Sequence[Explanation], null: Explanation
) -> list[HeldOut]:
    """Predictions of groups held out; for an unlisted law, valid within its range only, thirds along its axis."""
    law = result.law
    if result.answers[0].explanation is not None or law is None:
        return hold_out(problem, ranked, null, result.log_prior, rows_of_groups(problem.lines))
    laws = sorted((fit for fit in result.laws if result.is_supported(fit)), key=result.log_weight, reverse=True)
    ranked_together = sorted(
        [*laws[:_MOST_EXPLANATIONS], *ranked[:_MOST_EXPLANATIONS]], key=result.log_weight, reverse=True
    )
    return hold_out(problem, ranked_together, null, result.log_prior, _groups_along_law(problem, law))


def nearest_law_findings(problem: FittingProblem, result: Search, null: Explanation) -> list[Finding]:
    """The held-out error of the nearest unlisted law, where none is stated."""
    nearest = nearest_law(problem, result)
    if nearest is None:
        return []
    explanation = nearest.explanation
    law = None if explanation is None else law_of(problem, explanation)
    if explanation is None or law is None:
        return [Finding(Reason.NO_SIMPLE_LAW, "", "", {"tried": nearest.tried})]

    def log_prior(candidate: Explanation) -> float:
        return 0.0 if candidate.names == explanation.names else -np.inf

    groups = hold_out(problem, [explanation], null, log_prior, _groups_along_law(problem, explanation))
    before, after = total(groups)
    if not (np.isfinite(before.rmse_percent) and np.isfinite(after.rmse_percent)):
        return []
    arguments = {
        "tried": nearest.tried,
        "law": law.description.words,
        "part": problem.lines.held_out,
        "after_percent": after.rmse_percent,
        "before_percent": before.rmse_percent,
    }
    return [Finding(Reason.NO_SIMPLE_LAW, "", "", arguments)]


FAR_ABOVE = 2.0  # times what noise, or the scatter of a poor rig, explains: worth a sentence
REACHES_NOISE = 1.5  # times the noise floor: an error that noise explains


def above_noise(problem: FittingProblem, explanation: Explanation, groups: Sequence[HeldOut]) -> list[Finding]:
    """Of curves: a residual above the noise, and held-out parts that are predicted no better than by the base model."""
    if problem.lines.smooth is None:
        return []
    findings = []
    found = remainder(explanation)
    if found is not None:
        findings.append(Finding(Reason.REMAINDER, "", "force_n", {"percent": 100 * found[0], "times": found[1]}))
    before, after = total(groups)
    if explanation.names and after.recordings and after.rmse_percent >= before.rmse_percent:
        arguments = {
            "groups": [group.group for group in groups],
            "mechanisms": [
                in_plain_words(problem.lines.mechanisms[name]).replace("_", " ") for name in explanation.names
            ],
            "shows": any(set(explanation.names) & set(group.chosen) for group in groups),
            "before_percent": before.rmse_percent,
            "after_percent": after.rmse_percent,
        }
        findings.append(Finding(Reason.HELD_OUT_NO_BETTER, "", "force_n", arguments))
    return findings


def largest_floor_percent(problem: FittingProblem, null: Explanation, groups: Sequence[HeldOut]) -> float:
    """The largest noise floor of the recordings and of the groups held out [%]."""
    return max(score.floor_percent for score in (in_sample(problem, null), *(score.before for score in groups)))
