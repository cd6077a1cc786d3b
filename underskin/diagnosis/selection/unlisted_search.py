"""The search for unlisted laws, as rivals of the mechanisms of the catalogue.

A score test estimates what each of several hundred laws would gain in evidence on top of an explanation. The residual
of the explanation is projected onto the change that a law would make, on a small grid of its shape parameters: linear
algebra under the noise, no fit. Laws over whole recordings are tested on their gains (`gain_residual`), laws along
frequency on the deviations of lines from their recording's best real multiple (`Residuals`), laws of indentation
curves on samples, together with the explanation's parameters.

The test is made on top of the null hypothesis, of the best sets of mechanisms, and of the best set without one of its
members, for which a law may stand. The few laws that may matter are fitted like any other set. The best laws on FRFs
are then fitted together with each mechanism.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

from underskin.autodiff import Differentiated
from underskin.diagnosis.inference.evidence import NEGLIGIBLE_NATS
from underskin.diagnosis.inference.explanation import PRUNE_NATS, Explanation, FittingProblem, Request
from underskin.diagnosis.inference.residuals import (
    MAY_MATTER_NATS,
    Linearised,
    Residuals,
    force_and_slopes,
)
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.gain_residual import GainResidual
from underskin.mechanisms.base import Normal, Parameter
from underskin.mechanisms.models.curve_state import Samples
from underskin.mechanisms.models.curves import CurveModel, times_of
from underskin.mechanisms.unlisted.expressions import CurveLaw, Extent, curve_laws, of_samples
from underskin.mechanisms.unlisted.forms import Axis, Shape
from underskin.mechanisms.unlisted.grammar import FrequencyLaw, Grammar, combination
from underskin.mechanisms.unlisted.laws import LagLaw, RecordingLaw, UnlistedLaw
from underskin.recordings.campaign import curves_of
from underskin.recordings.curve_course import creeps_under_force
from underskin.units import Array, Floats, Indices

Law = TypeVar("Law", bound=UnlistedLaw)


@dataclass(frozen=True, eq=False)
class Score:
    """The `gain` in log evidence of a law on top of an explanation.

    `amplitudes` (over the sds of their priors) and `shape_values` where it gains most; `further_starts` are other fit
    coordinates from which a fit may begin.
    """

    law: UnlistedLaw
    gain: float
    log_share: float
    amplitudes: Floats
    shape_values: Floats
    further_starts: tuple[Floats, ...] = ()

    @property
    def guess(self) -> Floats:
        """The law's fit coordinates where it gains most."""
        count = len(self.law.parameters_stated) - len(self.law.amplitudes)
        return np.concatenate([self.amplitudes * prior_deviations(self.law), self.shape_values[:count]])


@dataclass(frozen=True, eq=False)
class _Group(Generic[Law]):
    """Laws with equally many amplitudes that act on the same quantity.

    `log_shares` (laws,); `first` index of each law's grid points (laws + 1,); `grid` of shape parameters (points,
    parameters); `scale`, the sds of the amplitudes' priors (points, amplitudes).
    """

    laws: list[Law]
    log_shares: list[float]
    first: Indices
    grid: Floats
    scale: Floats

    @classmethod
    def of(cls, laws: Sequence[tuple[Law, float]], key: Callable[[Law], str]) -> list["_Group[Law]"]:
        """Laws with their log shares, grouped by `key` and number of amplitudes."""
        laws_by_key: dict[tuple[str, int], list[tuple[Law, float]]] = {}
        for law, log_share in laws:
            laws_by_key.setdefault((key(law), len(law.amplitudes)), []).append((law, log_share))
        groups = []
        for members in laws_by_key.values():
            group_laws = [law for law, _ in members]
            counts = [len(law.grid) for law in group_laws]
            first = np.cumsum([0, *counts])
            grid = np.zeros((first[-1], max(law.grid.shape[1] for law in group_laws)))
            for law, start, end in zip(group_laws, first[:-1], first[1:], strict=True):
                grid[start:end, : law.grid.shape[1]] = law.grid
            scale = np.repeat([prior_deviations(law) for law in group_laws], counts, axis=0)
            groups.append(cls(group_laws, [log_share for _, log_share in members], first, grid, scale))
        return groups

    def scores(self, gains: Floats, amplitudes: Floats) -> Iterator[Score]:
        """From the gains (points,) and the most probable amplitudes (points, amplitudes)."""
        start = self.first[:-1]
        counts = np.diff(self.first)
        means = np.logaddexp.reduceat(gains, start) - np.log(counts)
        highest = np.flatnonzero(gains == np.repeat(np.maximum.reduceat(gains, start), counts))
        best = highest[np.searchsorted(highest, start)]  # the first of each law
        return map(Score, self.laws, means.tolist(), self.log_shares, amplitudes[best], self.grid[best])


class Screening:
    """The laws of a campaign of FRFs, and the change that each would make by a small amplitude."""

    def __init__(self, problem: FittingProblem, grammar: Grammar) -> None:
        """Of all laws of the grammar."""
        self._problem = problem
        self._ids = tuple(recording.id for recording in problem.collapsed.campaign.recordings)
        self._frequency, self._line = np.unique(problem.lines.frequency, return_inverse=True)
        self._features: dict[tuple[Axis, Shape], Floats] = {}

        def laws_of(form: type[Law]) -> list[tuple[Law, float]]:
            laws = zip(grammar.laws, grammar.log_shares.tolist(), strict=True)
            return [(law, log_share) for law, log_share in laws if isinstance(law, form)]

        self._of_recordings = _Group.of(laws_of(RecordingLaw), lambda law: law.description.acts_on)
        self._over_frequency = _Group.of(laws_of(FrequencyLaw), lambda _: "")
        self._lags = _Group.of(laws_of(LagLaw), lambda law: law.dispersion)

    def scores(self, explanation: Explanation) -> list[Score]:
        """Of every law, averaged over the grid of its shape parameters."""
        along_lines = self._along_lines(explanation) if len(self._frequency) > 1 else ()
        return [*self._along_recordings(explanation), *along_lines]

    def _along_recordings(self, explanation: Explanation) -> Iterator[Score]:
        residual = GainResidual(self._problem, explanation)
        for group in self._of_recordings:
            features = np.concatenate([self._features_of(law) for law in group.laws])
            columns = self._sensitivity[group.laws[0].description.acts_on].T
            changes = np.concatenate([features * column[:, None] for column in columns], axis=2)
            changes *= group.scale[:, None]
            yield from group.scores(residual.gains(changes), residual.amplitudes(changes))

    def _along_lines(self, explanation: Explanation) -> Iterator[Score]:
        weights, moments, noise = self._moments(explanation)
        total, total_moment, recording_weights = weights.sum(axis=0), moments.sum(axis=0), weights.sum(axis=1)
        for group in self._over_frequency:
            tangents = np.concatenate([law.tangents(self._frequency) for law in group.laws]) * group.scale[:, None]
            changes = tangents.transpose(0, 2, 1)  # (points, features, frequencies)
            gram = np.einsum("pif,f,pjf->pij", changes.conj(), total, changes, optimize=True).real
            means = changes.real @ weights.T  # (points, features, recordings)
            gram = gram - np.einsum("pir,r,pjr->pij", means, 1 / recording_weights, means, optimize=True)
            yield from group.scores(*noise.gains(gram, (changes.conj() @ total_moment).real))
        for lags in self._lags:
            pattern = lags.laws[0].pattern(self._frequency)
            spread = weights @ np.abs(pattern) ** 2 - (weights @ pattern.real) ** 2 / recording_weights  # by recording
            lag = np.concatenate([self._lag(law) for law in lags.laws]) * lags.scale[:, None]
            transposed = lag.transpose(0, 2, 1)
            gram = (transposed * spread) @ lag if lag.shape[2] > 1 else (transposed**2 @ spread)[:, None]
            yield from lags.scores(*noise.gains(gram, transposed @ (moments @ pattern.conj()).real))

    @cached_property
    def _sensitivity(self) -> dict[str, Floats]:
        """∂ ln level by the features of laws (recordings, 1 or 2), by the quantity that the laws act on."""
        laws = {law.description.acts_on: law for group in self._of_recordings for law in group.laws[:1]}
        return {acts_on: law.sensitivity(self._ids) for acts_on, law in laws.items()}

    def _lag(self, law: LagLaw) -> Floats:
        """Features (points, recordings, features), whose effect on lines depends on the kind of lag."""
        features = self._features_of(law)
        return np.exp(law.grid[:, :, None] * features) if law.shape.logarithmic else features

    def _features_of(self, law: RecordingLaw | LagLaw) -> Floats:
        """Features of the law's form over its axis (points, recordings, features)."""
        key = law.axis, law.shape
        if key not in self._features:
            grid = law.shape.points
            values = grid_values(law.shape.shape_parameters, grid)
            features = [
                np.broadcast_to(
                    feature.value if isinstance(feature, Differentiated) else feature, (len(grid), len(self._ids))
                )
                for feature in law.shape.features(law.axis.of(self._ids), values)
            ]
            self._features[key] = np.stack(features, axis=2)
        return self._features[key]

    def _moments(self, explanation: Explanation) -> tuple[Floats, Array, "_LineNoise"]:
        """Weights and weighted residuals of lines (recordings, distinct frequencies), and their χ²."""
        lines = self._problem.lines
        residuals = Residuals.of(self._problem, explanation)
        relative, weight = residuals.line, residuals.line_weight
        size = lines.recordings, len(self._frequency)
        index = lines.recording * size[1] + self._line
        weights, real, imag = (
            np.asarray(np.bincount(index, values, size[0] * size[1]), dtype=float).reshape(size)
            for values in (weight, weight * relative.real, weight * relative.imag)
        )
        chi2 = float((weight * np.abs(relative) ** 2).sum())
        return weights, real + 1j * imag, _LineNoise(chi2, 2 * len(relative) - lines.recordings)


def grid_values(parameters: Sequence[Parameter], grid: Floats) -> dict[str, Differentiated]:
    """Shape parameters at the points of a grid (points, parameters), as values without derivatives."""
    values = {}
    for parameter, coordinates in zip(parameters, grid.T, strict=True):
        value = np.exp(coordinates) if parameter.scale == "log" else coordinates
        values[parameter.name] = Differentiated(value[:, None], np.zeros((0, len(grid), 1)))
    return values


def prior_deviations(law: UnlistedLaw) -> Floats:
    """Standard deviations of the priors of a law's amplitudes (amplitudes,)."""
    priors = [parameter.prior for parameter in law.parameters_stated[: len(law.amplitudes)]]
    return np.array([prior.sd for prior in priors if isinstance(prior, Normal)])


@dataclass(frozen=True)
class _LineNoise:
    """χ² of the lines and its degrees of freedom; the noise level is the most probable one, at least 1."""

    chi2: float
    freedom: int

    def gains(self, gram: Floats, moment: Floats) -> tuple[Floats, Floats]:
        """Log of p with amplitudes of prior sd 1 over p without (points,), and the most probable amplitudes."""
        eye = np.eye(gram.shape[-1])
        initial_level = max(1.0, self.chi2 / max(self.freedom, 1))
        log_density_without = -0.5 * self.chi2 / initial_level - 0.5 * self.freedom * np.log(initial_level)
        level = np.full(len(gram), 1.0)
        for _ in range(4):
            solved = np.linalg.solve(gram + level[:, None, None] * eye, moment[..., None])[..., 0]
            remainder = self.chi2 - np.maximum((solved * moment).sum(axis=1), 0.0)
            level = np.maximum(1.0, remainder / max(self.freedom, 1))
        determinant = np.linalg.slogdet(eye + gram / level[:, None, None])[1]
        log_density_with = -0.5 * remainder / level - 0.5 * self.freedom * np.log(level) - 0.5 * determinant
        return np.asarray(log_density_with - log_density_without), np.asarray(solved)


_HOLD = 2e-3  # of the range of displacement: deviation from the deepest sample while a sphere is held


class CurveScreening:
    """The laws of a campaign of indentations.

    None over depth or force where a force is held while the sphere sinks in: the depth is then what the sample answers,
    and a law by which the force no longer depends on it agrees with any depth.
    """

    def __init__(self, problem: FittingProblem, null: Explanation, best: Explanation) -> None:
        """With the contact points of the null hypothesis; the noise is that of the `best` explanation."""
        self._lines, self._best = problem.lines, best
        curves = curves_of(self._lines.campaign)
        model = null.best.hypothesis.model
        assert isinstance(model, CurveModel)
        contacts = null.point.fit[model.contact_points].tolist()
        depths = [float(curve.displacement_mm.max()) - contact for curve, contact in zip(curves, contacts, strict=True)]
        times = {curve.id: times_of(curve) for curve in curves}
        turns = {curve.id: _turning_sample(curve.displacement_mm) for curve in curves}
        back = any(turns[curve.id] < len(curve.displacement_mm) - 1 for curve in curves)
        extent = Extent(
            depth_mm=max(depths),
            force_n=float(np.abs(self._lines.value.real).max()),
            time_s=max(float(np.ptp(time)) for time in times.values()),
            start_times={name: float(time[0]) for name, time in times.items()},
            turn_times={name: float(time[turns[name]]) for name, time in times.items()} if back else {},
        )
        is_timed, force = all(curve.time_s is not None for curve in curves), self._lines.value.real
        held = is_timed and any(
            creeps_under_force(curve.displacement_mm, force[rows], times[curve.id], self._lines.deviation[rows])
            for curve, rows in zip(curves, self._lines.spans, strict=True)
        )
        of_depth = () if held else ("displacement_mm", "force_n")
        self.laws = curve_laws(extent, (*of_depth, "time_s") if is_timed else of_depth)

    def scores(self, explanation: Explanation) -> list[Score]:
        """Of every law, averaged over the grid of its shape parameters.

        Under the noise of the best explanation, since a worse one takes the change by a law for noise.
        """
        force, slopes, stiffness = force_and_slopes(explanation)
        samples = self._samples(explanation)
        changes = [self._changes(law, samples, force, stiffness) for law, _ in self.laws]
        residual = self._lines.value.real - force
        flat_changes = [change.reshape(-1, len(force)) for change in changes]
        columns = np.concatenate([*flat_changes, residual[None]])
        marginal = Linearised.of_forces(explanation, slopes, columns, self._best).beyond()
        scores, first = [], 0
        for (law, log_share), change in zip(self.laws, changes, strict=True):
            points, count = change.shape[:2]
            rows = first + np.arange(points * count).reshape(points, count)
            first += points * count
            gram = marginal[rows[:, :, None], rows[:, None, :]] + np.eye(count)
            moment = marginal[rows, -1]
            amplitudes = np.linalg.solve(gram, moment[..., None])[..., 0]
            gains = 0.5 * (amplitudes * moment).sum(axis=1) - 0.5 * np.linalg.slogdet(gram)[1]
            best = int(np.argmax(gains))
            mean = float(np.logaddexp.reduce(gains) - np.log(points))
            near_best = [index for index in range(points) if index != best and gains[index] > gains[best] - PRUNE_NATS]
            starts = tuple(np.append(amplitudes[index] * prior_deviations(law), law.grid[index]) for index in near_best)
            scores.append(Score(law, mean, log_share, amplitudes[best], law.grid[best], starts))
        return scores

    def _samples(self, explanation: Explanation) -> Samples:
        """Each sample as a curve of its own."""
        model = explanation.best.hypothesis.model
        assert isinstance(model, CurveModel)
        curves, recording = curves_of(self._lines.campaign), self._lines.recording
        contact = explanation.point.fit[model.contact_points][recording]
        travel = np.concatenate([curve.displacement_mm for curve in curves]) - contact
        time = np.concatenate([times_of(curve) for curve in curves])
        still = np.zeros((len(time), 1))  # single samples, of which no law of an axis reads the speed
        return Samples([curves[index].id for index in recording], 1e-3 * travel[None, :, None], time[:, None], still)

    @staticmethod
    def _changes(law: CurveLaw, samples: Samples, force: Floats, stiffness: Floats) -> Floats:
        """Change of the force by each feature at an amplitude of one prior sd (grid, features, samples)."""
        values = {name: of_samples(value) for name, value in grid_values(law.shape.shape_parameters, law.grid).items()}
        unit = {"force": np.ones_like(force), "position": stiffness}.get(law.description.acts_on, force)
        changes = []
        for feature, deviation in zip(
            law.features(samples, force[None, :, None], values), prior_deviations(law), strict=True
        ):
            value = feature.value if isinstance(feature, Differentiated) else feature
            broadcast = np.broadcast_to(value, (len(law.grid), *samples.travel.shape[1:]))[..., 0]
            changes.append(deviation * unit * broadcast)
        return np.stack(changes, axis=1)


def _turning_sample(displacement: Floats) -> int:
    """The last sample before a sphere is retracted: the deepest one, or the last one of a hold."""
    return int(np.flatnonzero(displacement >= displacement.max() - _HOLD * np.ptp(displacement))[-1])


_MOST_FITTED = 8  # laws
_MARGIN_SHARE = 0.35  # of the best law's gain: laws whose scores are within that of the best one are fitted too
_PAIRED_LAWS = 2  # laws that are fitted with every mechanism; on curves laws that are fitted without mechanisms
_SINGLE_LAWS = 5  # laws on FRFs that are fitted without mechanisms where no set of mechanisms is nearly as probable
_DECISIVE = 50.0  # gain over the best set [nats], from which on that set holds wrong mechanisms in place of the law
_LEAST_SINGLE = 5.0  # gain of a law that is fitted without mechanisms [nats]
_LEAST_OVER_SLOW_NOISE = 25.0  # gain on curves with slow noise in the air [nats]


def with_laws(problem: FittingProblem, search: Search) -> list[Explanation]:
    """Fitted explanations with a law that may matter; none where no law can be tested."""
    null = search.null
    ranked = [fitted for fitted, _ in sorted(search.weighed, key=lambda pair: -pair[1])]
    screening = _screening(problem, null, ranked[0])
    if screening is None:
        return []
    best = search.log_weight(ranked[0])
    candidates: list[tuple[float, Explanation, Score]] = []
    for base in _base_explanations(search, null, ranked):
        prior = search.log_prior_beneath(base)
        candidates += [
            (base.log_evidence + prior + score.gain + score.log_share, base, score)
            for score in _best_of_combinations(screening.scores(base))
        ]
    candidates.sort(key=lambda candidate: -candidate[0])
    least = candidates[0][0] - max(NEGLIGIBLE_NATS, _MARGIN_SHARE * (candidates[0][0] - best))
    chosen = [candidate for candidate in candidates[:_MOST_FITTED] if candidate[0] > max(least, best - MAY_MATTER_NATS)]
    single = [candidate for candidate in candidates if candidate[1] is null and candidate[2].gain > _LEAST_SINGLE]
    if problem.lines.curves:  # where many laws change the force as mechanisms do
        chosen += [candidate for candidate in single[:_PAIRED_LAWS] if candidate not in chosen]
    elif candidates[0][0] > best + _DECISIVE:
        chosen += [candidate for candidate in single[:_SINGLE_LAWS] if candidate not in chosen]
    fitted = _fit_laws(problem, [(base, score) for _, base, score in chosen])
    if not problem.lines.curves:
        fitted += _with_named_mechanisms(problem, search, fitted)
    fitted += _without_companions(problem, fitted)
    fitted.sort(key=search.log_weight, reverse=True)
    smooth = problem.lines.smooth
    return fitted if smooth is None or not smooth.slow.any() else _beyond_slow_noise(search, fitted)


def _beyond_slow_noise(search: Search, fitted: Sequence[Explanation]) -> list[Explanation]:
    """The laws on curves that bring more evidence than fitting the noise that neighbouring samples in the air share."""
    named = {frozenset(fit.names): fit.log_evidence + _LEAST_OVER_SLOW_NOISE for fit in search.explanations}
    mechanisms = frozenset[str]().union(*named)
    return [fit for fit in fitted if fit.log_evidence > named.get(mechanisms.intersection(fit.names), -np.inf)]


def _screening(problem: FittingProblem, null: Explanation, best: Explanation) -> Screening | CurveScreening | None:
    """For recordings of this kind; None where the grammar has no law for them."""
    if problem.kind == "indentation":
        return CurveScreening(problem, null, best)
    if problem.kind != "frf":
        return None
    named = problem.lines.mechanisms.named
    grammar = Grammar.of(problem.collapsed.campaign, problem.lines.frequency, problem.table, named)
    return Screening(problem, grammar) if grammar.laws else None


def _base_explanations(search: Search, null: Explanation, ranked: Sequence[Explanation]) -> list[Explanation]:
    """The explanations on top of which laws are tried: the null hypothesis, the most probable set of mechanisms, and
    this one less each of them."""
    best = next((explanation for explanation in ranked if explanation.names), null)
    by_names = {frozenset(explanation.names): explanation for explanation in search.explanations}
    smaller = [by_names.get(frozenset(best.names) - {name}) for name in best.names]
    chosen = [null, best, *(explanation for explanation in smaller if explanation is not None)]
    return list({explanation.names: explanation for explanation in chosen}.values())


def _best_of_combinations(scores: Sequence[Score]) -> list[Score]:
    """The best score of each combination of what a law acts on, its axis and its form."""
    best: dict[tuple[str, str, str], Score] = {}
    for score in scores:
        key = combination(score.law)
        if key not in best or score.gain + score.log_share > best[key].gain + best[key].log_share:
            best[key] = score
    return list(best.values())


def _fit_laws(problem: FittingProblem, chosen: Sequence[tuple[Explanation, Score]]) -> list[Explanation]:
    requests = []
    for base, score in chosen:
        _add_to_mechanisms(problem, score)
        requests.append(Request((*base.names, score.law.name), base))
    return _explained(problem, requests)


def _explained(problem: FittingProblem, requests: Sequence[Request]) -> list[Explanation]:
    return [explanation for explanation in problem.explain_all(requests) if explanation is not None]


def _add_to_mechanisms(problem: FittingProblem, score: Score) -> None:
    """Add the law to the mechanisms, with the starting points that the screening found."""
    law = score.law
    law.log_share = score.log_share
    law.screened_fits = (*law.screened_fits, score.guess, *score.further_starts)
    problem.lines.mechanisms.add(law)


def _with_named_mechanisms(problem: FittingProblem, search: Search, fitted: Sequence[Explanation]) -> list[Explanation]:
    """The best laws that were fitted without mechanisms, with each mechanism, where they may lead."""
    single = [explanation for explanation in fitted if len(explanation.names) == 1]
    single = sorted(single, key=search.log_weight, reverse=True)[:_PAIRED_LAWS]
    fitted_sets = {frozenset(explanation.names) for explanation in fitted}
    best = max((search.log_weight(explanation) for explanation in search.explanations), default=0.0)
    requests: list[Request] = []
    for explanation in single:
        if search.log_weight(explanation) < best - MAY_MATTER_NATS:
            continue
        requests += [
            Request((name, *explanation.names), explanation)
            for name in problem.lines.mechanisms.named
            if name not in search.unsupported and frozenset((name, *explanation.names)) not in fitted_sets
        ]
    return _explained(problem, requests)


def _without_companions(problem: FittingProblem, fitted: Sequence[Explanation]) -> list[Explanation]:
    """The fitted sets less one mechanism, where not yet fitted: their evidence tells whether the mechanism shows."""
    fitted_sets = {frozenset(explanation.names) for explanation in fitted}
    requests = []
    for explanation in fitted:
        companions = [name for name in explanation.names if name in problem.lines.mechanisms.named]
        for name in companions:
            rest = tuple(other for other in explanation.names if other != name)
            if frozenset(rest) not in fitted_sets:
                fitted_sets.add(frozenset(rest))
                requests.append(Request(rest))
    return _explained(problem, requests)


@dataclass(frozen=True)
class NearestLaw:
    """The best fitted law on top of the best set of mechanisms or of the null hypothesis, of so many `tried`.

    `explanation` is None where none could be fitted.
    """

    tried: int
    explanation: Explanation | None


def nearest_law(problem: FittingProblem, search: Search) -> NearestLaw | None:
    """For recordings that no supported law describes; None where no law can be tested."""
    null, (best, _) = search.null, max(search.weighed, key=lambda pair: pair[1])
    screening = _screening(problem, null, best)
    if screening is None:
        return None
    chosen, tried = [], 0
    for base in (null, best) if best.names else (null,):
        scores = _best_of_combinations(screening.scores(base))
        chosen.append((base, max(scores, key=lambda score: score.gain)))
        tried = max(tried, len(scores))
    fitted = [*_fit_laws(problem, chosen), *search.laws]
    return NearestLaw(tried, max(fitted, key=lambda explanation: explanation.log_evidence, default=None))


def law_of(problem: FittingProblem, explanation: Explanation) -> UnlistedLaw | None:
    """The unlisted law of an explanation, None where it has none."""
    for name in explanation.names:
        mechanism = problem.lines.mechanisms[name]
        if isinstance(mechanism, UnlistedLaw):
            return mechanism
    return None
