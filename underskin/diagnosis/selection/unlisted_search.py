"""The search for laws that nobody listed.

A score test of several hundred laws that nobody listed: what each would gain on top of an explanation, roughly.

What an explanation leaves is projected onto the change that a law would make, over a small grid of what bends it:
linear algebra under the noise, no fit. A law that acts on whole recordings is weighed on its gains
(`gain_residual`), one that acts along frequency on what lines lie off their own recording's best real multiple
(`residuals`).

A score test of the laws that nobody listed on indentation curves: what each would gain on top of an explanation.

What the explanation leaves is projected onto the change that a law would make of each sample, over a small grid of what
bends it, beside the explanation's own parameters: linear algebra, no fit.

Laws that nobody listed, as rivals of the mechanisms: which are fitted, alone and beside named ones.

A score test ranks them on top of nothing, of the best sets of mechanisms, and of what is left of
the best set without one member, for which a law may stand. The few that may matter are fitted like any other set. What
they gain on top of nothing is then tried beside each named mechanism, of FRFs alone.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

from underskin.autodiff import Differentiated
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.explanation import integrated as integrate
from underskin.diagnosis.inference.residuals import (
    force_and_slopes,
    information,
    information_beyond,
    line_residuals,
    precision_of,
)
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.gain_residual import GainResidual
from underskin.mechanisms.models.curve_state import Samples
from underskin.mechanisms.models.curves import CurveModel, times_of
from underskin.mechanisms.parameter import Normal, Parameter
from underskin.mechanisms.registry import CATALOGUE
from underskin.mechanisms.unlisted.axes import Axis
from underskin.mechanisms.unlisted.expressions import CurveLaw, Extent, curve_laws, of_samples
from underskin.mechanisms.unlisted.forms import Shape
from underskin.mechanisms.unlisted.grammar import FrequencyLaw, Grammar, combination
from underskin.mechanisms.unlisted.laws import LagLaw, RecordingLaw, UnlistedLaw
from underskin.recordings.campaign import curves_of
from underskin.units import Array, Floats, Indices

Law = TypeVar("Law", bound=UnlistedLaw)
_USUAL_CHANGE = np.array([1.0])  # times the sd of each amplitude's prior


@dataclass(frozen=True, eq=False)
class Score:
    """What a law gains in log evidence on top of an explanation; where it gains most, its amplitudes over the sds of
    their priors, and what bends it; `others` are fit coordinates elsewhere from which a fit may begin as well."""

    law: UnlistedLaw
    gain: float
    log_share: float
    amplitudes: Floats
    bending: Floats
    others: tuple[Floats, ...] = ()

    @property
    def guess(self) -> Floats:
        """The law's fit coordinates there."""
        count = len(self.law.parameters_bound) - len(self.law.amplitudes)
        return np.concatenate([self.amplitudes * prior_deviations(self.law), self.bending[:count]])


@dataclass(frozen=True, eq=False)
class _Group(Generic[Law]):
    """Laws with equally many amplitudes that enter at one place.

    `log_shares` of each; `first` point of each on the grid of what bends it, and one more; `grid` of each point;
    `scale`, the sds of the amplitudes' priors at each (points, amplitudes).
    """

    laws: list[Law]
    log_shares: list[float]
    first: Indices
    grid: Floats
    scale: Floats

    @classmethod
    def of(cls, laws: Sequence[tuple[Law, float]], alike: Callable[[Law], str]) -> list["_Group[Law]"]:
        """Laws with their log shares, by what they are `alike` in."""
        groups: dict[tuple[str, int], list[tuple[Law, float]]] = {}
        for law, log_share in laws:
            groups.setdefault((alike(law), len(law.amplitudes)), []).append((law, log_share))
        each = []
        for members in groups.values():
            own = [law for law, _ in members]
            counts = [len(law.grid) for law in own]
            first = np.cumsum([0, *counts])
            grid = np.zeros((first[-1], max(law.grid.shape[1] for law in own)))
            for law, start, end in zip(own, first[:-1], first[1:], strict=True):
                grid[start:end, : law.grid.shape[1]] = law.grid
            scale = np.repeat([prior_deviations(law) for law in own], counts, axis=0)
            each.append(cls(own, [log_share for _, log_share in members], first, grid, scale))
        return each

    def scores(self, gains: Floats, amplitudes: Floats) -> Iterator[Score]:
        """From the gain at each point, and the most probable amplitudes there."""
        start = self.first[:-1]
        counts = np.diff(self.first)
        means = np.logaddexp.reduceat(gains, start) - np.log(counts)
        highest = np.flatnonzero(gains == np.repeat(np.maximum.reduceat(gains, start), counts))
        best = highest[np.searchsorted(highest, start)]  # the first of each law
        return map(Score, self.laws, means.tolist(), self.log_shares, amplitudes[best], self.grid[best])


class Screening:
    """The laws of a campaign, and the change that each would make by a small amplitude; the same for every score."""

    def __init__(self, problem: FittingProblem, grammar: Grammar) -> None:
        """Of all laws of the grammar."""
        self._problem = problem
        self._ids = tuple(entry.id for entry in problem.collapsed.campaign.recordings)
        self._frequency, self._line = np.unique(problem.lines.frequency, return_inverse=True)
        self._features: dict[tuple[Axis, Shape], Floats] = {}

        def some(kind: type[Law]) -> list[tuple[Law, float]]:
            laws = zip(grammar.laws, grammar.log_shares.tolist(), strict=True)
            return [(law, log_share) for law, log_share in laws if isinstance(law, kind)]

        self._of_recordings = _Group.of(some(RecordingLaw), lambda law: law.description.acts_on)
        self._over_frequency = _Group.of(some(FrequencyLaw), lambda _: "")
        self._lags = _Group.of(some(LagLaw), lambda law: law.kind)

    def scores(self, explanation: Explanation) -> list[Score]:
        """Of every law, the grid of what bends it averaged."""
        along_lines = self._along_lines(explanation) if len(self._frequency) > 1 else ()
        return [*self._along_recordings(explanation), *along_lines]

    def _along_recordings(self, explanation: Explanation) -> Iterator[Score]:
        residual = GainResidual(self._problem, explanation)
        for group in self._of_recordings:
            features = np.concatenate([self._features_of(law) for law in group.laws])
            columns = self._sensitivity[group.laws[0].description.acts_on].T
            changes = np.concatenate([features * column[:, None] for column in columns], axis=2)
            changes *= group.scale[:, None]
            yield from group.scores(residual.gains(changes, _USUAL_CHANGE), residual.amplitudes(changes))

    def _along_lines(self, explanation: Explanation) -> Iterator[Score]:
        weights, moments, noise = self._moments(explanation)
        total, moment, own = weights.sum(axis=0), moments.sum(axis=0), weights.sum(axis=1)
        for group in self._over_frequency:
            tangents = np.concatenate([law.tangents(self._frequency) for law in group.laws]) * group.scale[:, None]
            changes = tangents.transpose(0, 2, 1)  # (points, features, frequencies)
            gram = np.einsum("pif,f,pjf->pij", changes.conj(), total, changes, optimize=True).real
            means = changes.real @ weights.T  # (points, features, recordings)
            gram = gram - np.einsum("pir,r,pjr->pij", means, 1 / own, means, optimize=True)
            yield from group.scores(*noise.gains(gram, (changes.conj() @ moment).real))
        for lags in self._lags:
            pattern = lags.laws[0].pattern(self._frequency)
            spread = weights @ np.abs(pattern) ** 2 - (weights @ pattern.real) ** 2 / own  # by recording
            lag = np.concatenate([self._lag(law) for law in lags.laws]) * lags.scale[:, None]
            turned = lag.transpose(0, 2, 1)
            gram = (turned * spread) @ lag if lag.shape[2] > 1 else (turned**2 @ spread)[:, None]
            yield from lags.scores(*noise.gains(gram, turned @ (moments @ pattern.conj()).real))

    @cached_property
    def _sensitivity(self) -> dict[str, Floats]:
        """∂ ln level by the features of laws that act on this (recordings, 1 or 2)."""
        laws = {law.description.acts_on: law for group in self._of_recordings for law in group.laws[:1]}
        return {acts_on: law.sensitivity(self._ids) for acts_on, law in laws.items()}

    def _lag(self, law: LagLaw) -> Floats:
        """Features of the recordings; what they make of lines depends on the kind of lag."""
        features = self._features_of(law)
        return np.exp(law.grid[:, :, None] * features) if law.shape.logarithmic else features

    def _features_of(self, law: RecordingLaw | LagLaw) -> Floats:
        """Of its form over its axis (points, recordings, features)."""
        key = law.axis, law.shape
        if key not in self._features:
            grid = law.shape.points
            values = grid_values(law.shape.shape_parameters, grid)
            each = [
                np.broadcast_to(one.value if isinstance(one, Differentiated) else one, (len(grid), len(self._ids)))
                for one in law.shape.features(law.axis.of(self._ids), values)
            ]
            self._features[key] = np.stack(each, axis=2)
        return self._features[key]

    def _moments(self, explanation: Explanation) -> tuple[Floats, Array, "_Levels"]:
        """Of lines by recording and distinct frequency: the weights, the residuals times them, and their χ²."""
        lines = self._problem.lines
        relative, weight = line_residuals(self._problem, explanation)
        size = lines.recordings, len(self._frequency)
        place = lines.recording * size[1] + self._line
        weights, real, imag = (
            np.asarray(np.bincount(place, values, size[0] * size[1]), dtype=float).reshape(size)
            for values in (weight, weight * relative.real, weight * relative.imag)
        )
        chi2 = float((weight * np.abs(relative) ** 2).sum())
        return weights, real + 1j * imag, _Levels(chi2, 2 * len(relative) - lines.recordings)


def grid_values(bending: Sequence[Parameter], grid: Floats) -> dict[str, Differentiated]:
    """What bends a form at the points of a grid (points, parameters), as values without derivatives."""
    values = {}
    for entry, at in zip(bending, grid.T, strict=True):
        value = np.exp(at) if entry.scale == "log" else at
        values[entry.name] = Differentiated(value[:, None], np.zeros((0, len(grid), 1)))
    return values


def prior_deviations(law: UnlistedLaw) -> Floats:
    """Of the amplitudes (amplitudes,)."""
    priors = [entry.prior for entry in law.parameters_bound[: len(law.amplitudes)]]
    return np.array([prior.sd for prior in priors if isinstance(prior, Normal)])


@dataclass(frozen=True)
class _Levels:
    """χ² of the lines and its degrees of freedom; the noise's level is what suits best, at least 1."""

    chi2: float
    freedom: int

    def gains(self, gram: Floats, moment: Floats) -> tuple[Floats, Floats]:
        """log p with amplitudes of prior sd 1 over that without (points,), and their most probable values."""
        eye = np.eye(gram.shape[-1])
        first = max(1.0, self.chi2 / max(self.freedom, 1))
        before = -0.5 * self.chi2 / first - 0.5 * self.freedom * np.log(first)
        level = np.full(len(gram), 1.0)
        for _ in range(4):
            solved = np.linalg.solve(gram + level[:, None, None] * eye, moment[..., None])[..., 0]
            left = self.chi2 - np.maximum((solved * moment).sum(axis=1), 0.0)
            level = np.maximum(1.0, left / max(self.freedom, 1))
        determinant = np.linalg.slogdet(eye + gram / level[:, None, None])[1]
        after = -0.5 * left / level - 0.5 * self.freedom * np.log(level) - 0.5 * determinant
        return np.asarray(after - before), np.asarray(solved)


_HELD = 2e-3  # of the range of displacement: off the deepest sample while a sphere is held
_ELSEWHERE = 30.0  # nats behind the best point of a grid within which a fit begins too


class CurveScreening:
    """The laws of a campaign of indentations."""

    def __init__(self, problem: FittingProblem, nothing: Explanation, best: Explanation) -> None:
        """With contact as the null hypothesis, `nothing`, has it; `best` is the best explanation."""
        self._lines, self._best = problem.lines, best
        curves = curves_of(self._lines.campaign)
        model = nothing.best.hypothesis.model
        assert isinstance(model, CurveModel)
        contacts = nothing.point.fit[model.contact_points].tolist()
        depths = [float(one.displacement_mm.max()) - at for one, at in zip(curves, contacts, strict=True)]
        times = {one.id: times_of(one) for one in curves}
        turns = {one.id: _last_deep(one.displacement_mm) for one in curves}
        back = any(turns[one.id] < len(one.displacement_mm) - 1 for one in curves)
        extent = Extent(
            depth_mm=max(depths),
            force_n=float(np.abs(self._lines.value.real).max()),
            time_s=max(float(np.ptp(own)) for own in times.values()),
            start_times={name: float(own[0]) for name, own in times.items()},
            turn_times={name: float(own[turns[name]]) for name, own in times.items()} if back else {},
        )
        self.laws = curve_laws(extent, timed=all(one.time_s is not None for one in curves))

    def scores(self, explanation: Explanation) -> list[Score]:
        """Of every law, the grid of what bends it averaged; under the noise that the best explanation found, since a
        worse one takes what a law would change for noise."""
        force, slopes, stiffness = force_and_slopes(explanation)
        samples = self._samples(explanation)
        changes = [self._changes(law, samples, force, stiffness) for law, _ in self.laws]
        left = self._lines.value.real - force
        flat = [one.reshape(-1, len(force)) for one in changes]
        whole = information(explanation, np.concatenate([slopes, *flat, left[None]]), self._best)
        shown = information_beyond(whole, np.arange(len(slopes)), precision_of(explanation.best.hypothesis))
        scores, first = [], 0
        for (law, log_share), own in zip(self.laws, changes, strict=True):
            points, count = own.shape[:2]
            rows = first + np.arange(points * count).reshape(points, count)
            first += points * count
            gram = shown[rows[:, :, None], rows[:, None, :]] + np.eye(count)
            moment = shown[rows, -1]
            amplitudes = np.linalg.solve(gram, moment[..., None])[..., 0]
            gains = 0.5 * (amplitudes * moment).sum(axis=1) - 0.5 * np.linalg.slogdet(gram)[1]
            best = int(np.argmax(gains))
            mean = float(np.logaddexp.reduce(gains) - np.log(points))
            others = [place for place in range(points) if place != best and gains[place] > gains[best] - _ELSEWHERE]
            guesses = tuple(np.append(amplitudes[place] * prior_deviations(law), law.grid[place]) for place in others)
            scores.append(Score(law, mean, log_share, amplitudes[best], law.grid[best], guesses))
        return scores

    def _samples(self, explanation: Explanation) -> Samples:
        """Each sample as a curve of its own."""
        model = explanation.best.hypothesis.model
        assert isinstance(model, CurveModel)
        curves, recording = curves_of(self._lines.campaign), self._lines.recording
        contact = explanation.point.fit[model.contact_points][recording]
        travel = np.concatenate([one.displacement_mm for one in curves]) - contact
        time = np.concatenate([times_of(one) for one in curves])
        return Samples([curves[number].id for number in recording], 1e-3 * travel[None, :, None], time[:, None])

    @staticmethod
    def _changes(law: CurveLaw, samples: Samples, force: Floats, stiffness: Floats) -> Floats:
        """What each feature changes in the force by an amplitude of its prior's deviation (grid, features, samples)."""
        values = {name: of_samples(value) for name, value in grid_values(law.shape.shape_parameters, law.grid).items()}
        unit = {"force": np.ones_like(force), "position": stiffness}.get(law.description.acts_on, force)
        each = []
        for feature, deviation in zip(
            law.features(samples, force[None, :, None], values), prior_deviations(law), strict=True
        ):
            value = feature.value if isinstance(feature, Differentiated) else feature
            whole = np.broadcast_to(value, (len(law.grid), *samples.travel.shape[1:]))[..., 0]
            each.append(deviation * unit * whole)
        return np.stack(each, axis=1)


def _last_deep(displacement: Floats) -> int:
    """The last sample before a sphere turns back: the deepest one, or that with which a hold ends."""
    return int(np.flatnonzero(displacement >= displacement.max() - _HELD * np.ptp(displacement))[-1])


_BENEATH = 1  # sets of mechanisms, the most probable, on top of which laws are tried, and nothing
_FITTED = 8  # laws at most
_BEHIND, _BEHIND_SHARE = (
    12.0,
    0.35,
)  # nats of the best by its score, or that share of what it gains, behind which none is
_MAY_MATTER = 6.0  # nats behind the most probable answer by its score
_ALONE_IN_COMPANY = 2  # laws that are tried beside every mechanism; of curves alone, whatever the mechanisms do
_ALONE = 5  # laws on FRFs that are tried alone where no set of mechanisms comes near
_FAR = 50.0  # nats that a law gains on top of the best set, where that took the wrong mechanisms for the law
_SHOWS_ALONE = 5.0  # nats
_OVER_SLOW = 25.0  # nats
_INTEGRATED, _WITHIN = 4, 6.0


def with_laws(problem: FittingProblem, search: Search) -> list[Explanation]:
    """The explanations that hold a law, fitted, of those that may matter; none of recordings that show too little."""
    nothing = next(entry for entry in search.explanations if not entry.names)
    ranked = sorted((entry for entry in search.explanations if search.is_supported(entry)), key=search.log_weight)[::-1]
    screening = _screening(problem, nothing, ranked[0])
    if screening is None:
        return []
    best = search.log_weight(ranked[0])
    candidates: list[tuple[float, Explanation, Score]] = []
    for beneath in _beneath(search, nothing, ranked):
        prior = search.log_prior_beneath(beneath)
        candidates += [
            (beneath.log_evidence + prior + score.gain + score.log_share, beneath, score)
            for score in _of_combinations(screening.scores(beneath))
        ]
    candidates.sort(key=lambda entry: -entry[0])
    least = candidates[0][0] - max(_BEHIND, _BEHIND_SHARE * (candidates[0][0] - best))
    chosen = [entry for entry in candidates[:_FITTED] if entry[0] > max(least, best - _MAY_MATTER)]
    alone = [entry for entry in candidates if entry[1] is nothing and entry[2].gain > _SHOWS_ALONE]
    if problem.lines.curves:  # of which many laws bend the force as named mechanisms do
        chosen += [entry for entry in alone[:_ALONE_IN_COMPANY] if entry not in chosen]
    elif candidates[0][0] > best + _FAR:
        chosen += [entry for entry in alone[:_ALONE] if entry not in chosen]
    fitted = _fitted(problem, [(beneath, score) for _, beneath, score in chosen])
    if not problem.lines.curves:
        fitted += _beside_named(problem, search, fitted)
    fitted += _without_company(problem, fitted)
    fitted.sort(key=search.log_weight, reverse=True)
    if problem.lines.curves:  # whose integrals take longer than all else, and move little
        return _beyond_slow_noise(problem, search, fitted)
    close = [entry for entry in fitted if search.log_weight(entry) > search.log_weight(fitted[0]) - _WITHIN]
    some = close[:_INTEGRATED]
    return [*integrate(some), *(entry for entry in fitted if entry not in some)] if some else []


def _beyond_slow_noise(problem: FittingProblem, search: Search, fitted: Sequence[Explanation]) -> list[Explanation]:
    """Of curves: where the air shows noise that neighbouring samples share, a law must bring more, since it bends to
    that."""
    smooth = problem.lines.smooth
    if smooth is None or not smooth.slow.any():
        return list(fitted)
    named = problem.lines.mechanisms.named
    known = {frozenset(entry.names): entry.log_evidence for entry in search.explanations}
    beneath = [known.get(frozenset(name for name in entry.names if name in named), -np.inf) for entry in fitted]
    return [entry for entry, less in zip(fitted, beneath, strict=True) if entry.log_evidence > less + _OVER_SLOW]


def _screening(problem: FittingProblem, nothing: Explanation, best: Explanation) -> Screening | CurveScreening | None:
    """Of recordings of this kind; None where no law follows what they have."""
    if problem.kind == "indentation":
        return CurveScreening(problem, nothing, best)
    if problem.kind != "frf":
        return None
    named = problem.lines.mechanisms.named
    beside = tuple(CATALOGUE.values())
    grammar = Grammar.of(problem.collapsed.campaign, problem.lines.frequency, problem.table, beside, named)
    return Screening(problem, grammar) if grammar.laws else None


def _beneath(search: Search, nothing: Explanation, ranked: Sequence[Explanation]) -> list[Explanation]:
    """On top of which laws are tried."""
    chosen = {nothing.names: nothing}
    named = [entry for entry in ranked if entry.names][:_BENEATH]
    known = {frozenset(entry.names): entry for entry in search.explanations}
    for entry in named:
        chosen[entry.names] = entry
    for entry in named[:1]:
        for name in entry.names:
            smaller = known.get(frozenset(entry.names) - {name})
            if smaller is not None:
                chosen[smaller.names] = smaller
    return list(chosen.values())


def _of_combinations(scores: Sequence[Score]) -> list[Score]:
    """The best of each combination of where, what and form."""
    best: dict[tuple[str, str, str], Score] = {}
    for score in scores:
        key = combination(score.law)
        if key not in best or score.gain + score.log_share > best[key].gain + best[key].log_share:
            best[key] = score
    return list(best.values())


def _fitted(problem: FittingProblem, chosen: Sequence[tuple[Explanation, Score]]) -> list[Explanation]:
    requests = []
    for beneath, score in chosen:
        _admit(problem, score)
        requests.append(Request((*beneath.names, score.law.name), beneath))
    explained = problem.explain(requests) if requests else []
    return [entry for entry in explained if entry is not None]


def _admit(problem: FittingProblem, score: Score) -> None:
    """Let models hold the law, and fits begin where the screening found it."""
    law = score.law
    law.log_share = score.log_share
    law.screened_fits = (*law.screened_fits, score.guess, *score.others)
    problem.lines.mechanisms.add(law)


def _beside_named(problem: FittingProblem, search: Search, fitted: Sequence[Explanation]) -> list[Explanation]:
    """The best laws that were fitted alone, beside each mechanism, where they may lead."""
    alone = [entry for entry in fitted if len(entry.names) == 1]
    alone = sorted(alone, key=search.log_weight, reverse=True)[:_ALONE_IN_COMPANY]
    known = {frozenset(entry.names) for entry in fitted}
    best = max((search.log_weight(entry) for entry in search.explanations), default=0.0)
    requests: list[Request] = []
    for entry in alone:
        if search.log_weight(entry) < best - _MAY_MATTER:
            continue
        requests += [
            Request((name, *entry.names), entry)
            for name in problem.lines.mechanisms.named
            if name not in search.unsupported and frozenset((name, *entry.names)) not in known
        ]
    explained = problem.explain(requests) if requests else []
    return [entry for entry in explained if entry is not None]


def _without_company(problem: FittingProblem, fitted: Sequence[Explanation]) -> list[Explanation]:
    """Laws without one of their companions, where that was not fitted: whether the companion shows is read from it."""
    known = {frozenset(entry.names) for entry in fitted}
    requests = []
    for entry in fitted:
        companions = [name for name in entry.names if name in problem.lines.mechanisms.named]
        for name in companions:
            rest = tuple(other for other in entry.names if other != name)
            if frozenset(rest) not in known:
                known.add(frozenset(rest))
                requests.append(Request(rest))
    explained = problem.explain(requests) if requests else []
    return [entry for entry in explained if entry is not None]


@dataclass(frozen=True)
class NearestLaw:
    """Of so many laws `tried` the fitted one that gains most on top of the best set of mechanisms, or of nothing; None
    where none gains anything."""

    tried: int
    explanation: Explanation | None


def nearest_law(problem: FittingProblem, search: Search) -> NearestLaw | None:
    """Of recordings that no law that shows describes; None where none could be."""
    nothing = next(entry for entry in search.explanations if not entry.names)
    best = max((entry for entry in search.explanations if search.is_supported(entry)), key=search.log_weight)
    screening = _screening(problem, nothing, best)
    if screening is None:
        return None
    chosen, tried = [], 0
    for beneath in (nothing, best) if best.names else (nothing,):
        scores = _of_combinations(screening.scores(beneath))
        chosen.append((beneath, max(scores, key=lambda score: score.gain)))
        tried = max(tried, len(scores))
    fitted = [*_fitted(problem, chosen), *search.laws]
    return NearestLaw(tried, max(fitted, key=lambda entry: entry.log_evidence, default=None))


def law_of(problem: FittingProblem, explanation: Explanation) -> UnlistedLaw | None:
    """The law that an explanation holds."""
    for name in explanation.names:
        mechanism = problem.lines.mechanisms[name]
        if isinstance(mechanism, UnlistedLaw):
            return mechanism
    return None
