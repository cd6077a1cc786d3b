"""One set of mechanisms as an explanation of the recordings: fitted from several starts, and its evidence.

Sets are fitted without positioning scatter and, where it could show, with it; the evidence is the mean of both.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.evidence import Evidence, around
from underskin.diagnosis.inference.evidence import integrated as over_all_values
from underskin.diagnosis.inference.hypothesis import FitPoint, Hypothesis, own_places
from underskin.diagnosis.inference.knowledge import Knowledge
from underskin.diagnosis.inference.least_squares import plain_least_squares
from underskin.diagnosis.inference.likelihood import Curvature
from underskin.diagnosis.inference.optimizer import Evaluated, Fitter
from underskin.diagnosis.inference.points import Points, alone, stacked
from underskin.diagnosis.inference.position_curvature import curvature
from underskin.diagnosis.inference.scattered import groups, hardly_scatters, with_scatter, without_scatter
from underskin.diagnosis.inference.starts import Beginning, best_starts
from underskin.diagnosis.noise.noise_priors import GAIN_PRIOR, Plateau
from underskin.errors import InvalidInput
from underskin.mechanisms.base import Unsupported
from underskin.mechanisms.models.composed import Model, compose
from underskin.recordings.usual_scatter import NO_POSITION_SCATTER, POSITION_RANGE
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

_DECIDED = 0.999  # probability beyond which a parent's positioning scatter, or none, is its offspring's
_COUNTS = 8.0  # nats behind the other fit within which one counts
_LEAST_GAIN = 1.0  # in log posterior density
_HOPELESS = 30.0  # nats of it behind the best beyond which a fit is left: its evidence is more than 10 behind
_LEAST_SCATTER = 3e-3  # relative effect of positioning scatter on a recording below which it is not looked for


@dataclass(frozen=True)
class Explanation:
    """`best` is the more probable of the fits with and without positioning scatter."""

    names: tuple[str, ...]
    log_evidence: float
    best: Evidence
    placed: float  # probability that there is positioning scatter, given this set
    each: tuple[tuple[float, Evidence], ...]  # without and with it, as far as they were fitted, with their log priors

    @classmethod
    def of(cls, each: Sequence[tuple[float, Evidence]]) -> Self:
        """From the fits, the log prior of each beside it."""
        weights = np.array([prior + fit.log_evidence for prior, fit in each])
        total = float(np.logaddexp.reduce(weights))
        best = each[int(np.argmax(weights))][1]
        scattered = [fit.hypothesis.placed for _, fit in each]
        placed = float(np.exp(weights[scattered] - total).sum())
        return cls(each[0][1].hypothesis.model.names, total, best, placed, tuple(each))

    @property
    def model(self) -> Model:
        """The composed model."""
        return self.best.hypothesis.model

    @property
    def point(self) -> FitPoint:
        """The most probable parameters."""
        return self.best.point

    @cached_property
    def least_squares(self) -> tuple[Floats, float]:
        """Of curves, `plain_least_squares` from the most probable parameters: their fit, and what it leaves [%]."""
        return plain_least_squares(self.best.hypothesis, self.point.fit)

    def own(self, name: str) -> list[float]:
        """The fit coordinates of one of its mechanisms."""
        return list(self.point.fit[own_places(self.names, self.best.hypothesis.lines)[name]])


@dataclass(frozen=True)
class Request:
    """A set of mechanisms to explain; `parent`: the explanation of a set with one less, `alone` that of the other."""

    names: tuple[str, ...]
    parent: Explanation | None = None
    alone: Explanation | None = None
    begin: FitPoint | None = None  # where nuisances begin, if not where the parent has them
    larger: Explanation | None = None  # a set with one mechanism more, from whose fit this one begins
    kept: bool = False  # fitted to its end however far behind it begins, and explained though it gains nothing

    @property
    def without_scatter(self) -> bool:
        """Whether it is fitted without positioning scatter."""
        return self.parent is None or self.parent.placed < _DECIDED

    def target(self, placed: bool) -> float:
        """The cost below which a fit is better than the parent's of like scatter; ∞ where that cannot be compared."""
        if self.parent is None or self.kept or (self.parent.placed > 0.5) is not placed:
            return np.inf
        return self.parent.best.cost - _LEAST_GAIN


Beside = Callable[[Model, Lines], Knowledge | None]


class FittingProblem:
    """Recordings of one kind and their noise, to which hypotheses are fitted: all rows, and a mean a recording."""

    def __init__(
        self, lines: Lines, table: SigmaTable, beside: Beside | None = None, gain: Plateau = GAIN_PRIOR
    ) -> None:
        """Collapse, and work out how σ bends; curves are not collapsed and have no place. `beside` says what recordings
        of other kinds know of a model's parameters; `gain` is the prior of the gain scatter's logarithm."""
        self.lines = lines
        self.beside = beside
        self.gain = gain
        self.kind = kind = lines.kind
        self.table = table
        self.collapsed = lines.collapsed() if kind == "frf" else lines
        none = np.zeros(lines.recordings)
        self.curvature = curvature(self.collapsed, table) if kind == "frf" else Curvature(none, none)
        self._hypotheses: dict[tuple[frozenset[str], bool, bool], Hypothesis] = {}

    def hypothesis(self, names: Sequence[str], placed: bool, *, whole: bool = False) -> Hypothesis:
        """The set's model on the lines that it needs; raises Unsupported."""
        whole = whole or any(self.lines.mechanisms[name].needs_lines for name in names)
        key = frozenset(names), whole, placed
        if key not in self._hypotheses:
            other = self._hypotheses.get((frozenset(names), whole, not placed))
            if other is None:
                lines = self.lines if whole else self.collapsed
                model = compose(names, lines.campaign, self.table, self.kind, lines.mechanisms)
                known = None if self.beside is None else self.beside(model, lines)
                other = Hypothesis(model, lines, self.curvature, placed, gain=self.gain, knowledge=known)
            self._hypotheses[key] = replace(other, placed=placed)
        return self._hypotheses[key]

    def explain(self, requests: Sequence[Request], best: float = np.inf) -> list[Explanation | None]:
        """The sets' explanations.

        None where the log posterior density gains less than `_LEAST_GAIN` over the parent's: the added mechanism does
        not show; and where a set of mechanisms is hopeless, by `_HOPELESS` nats behind the others or what is the `best`
        cost so far. Evidences are Laplace approximations, until they are `integrated`. Raises Unsupported.
        """
        plain, placed = (
            [self.hypothesis(request.names, scattered) for request in requests] for scattered in (False, True)
        )
        scattered = {number for number, request in enumerate(requests) if not request.without_scatter}
        starts = _starts(
            {number: plain[number] for number in range(len(requests)) if number not in scattered}, requests
        )
        placed_starts = _starts({number: placed[number] for number in sorted(scattered)}, requests)
        fits: list[list[tuple[float, Evidence]]] = [[] for _ in requests]
        log_priors = np.log([NO_POSITION_SCATTER, 1 - NO_POSITION_SCATTER])
        also_placed: dict[int, Points] = {}
        fitted = _fitted(plain, starts, requests, best)
        parentless = {number: improved for number, improved, _ in fitted if requests[number].parent is None}
        matters = self._position_matters(plain, parentless)
        for number, improved, evidence in fitted:
            parent = requests[number].parent
            if evidence is None and parent is not None and parent.placed <= 0.5:
                continue
            also = parent.placed > 1 - _DECIDED if parent else matters[number]
            if evidence is not None:
                fits[number].append((float(log_priors[0]) if also or parent else 0.0, evidence))
            if also:
                also_placed[number] = improved
        placed_starts |= with_scatter(placed, also_placed)
        best = min([best, *(evidence.cost for own in fits for _, evidence in own)])
        shown_plain = {number for number, own in enumerate(fits) if own}
        scattering = _fitted(placed, placed_starts, requests, best)
        _add(fits, scattering, log_priors[1])
        for number, _, evidence in scattering:
            if evidence is None and np.isfinite(requests[number].target(True)):
                fits[number].clear()
        also_plain = {
            number: without_scatter(improved)
            for number, improved, evidence in scattering
            if evidence is not None
            and number not in shown_plain
            and (number not in scattered or hardly_scatters(evidence))
        }
        _add(fits, _fitted(plain, also_plain, requests, best), log_priors[0])
        return [Explanation.of(own) if own else None for own in fits]

    def refit(self, explanations: Sequence[Explanation]) -> list[Explanation | None]:
        """Sets fitted to more recordings, fitted to these from where they stood; by the Laplace approximation.

        None where a set has other parameters here, or these recordings do not support it.
        """
        hypotheses: list[Hypothesis] = []
        starts: dict[int, Points] = {}
        for entry in explanations:
            try:
                hypothesis = self.hypothesis(entry.names, entry.best.hypothesis.placed)
            except (Unsupported, InvalidInput):
                continue  # what was left out is what the mechanism, or any model of a curve, needs
            if [one.name for one in hypothesis.model.parameters] == [one.name for one in entry.model.parameters]:
                fitter = Fitter([hypothesis])
                # Bounds may be narrower here: those of a time follow from how often the curves were sampled.
                fit = np.clip(entry.point.fit, fitter.low[0], fitter.high[0])
                starts[len(hypotheses)] = fitter.at(replace(entry.point, fit=fit, bend=fitter.no_bend))
                hypotheses.append(hypothesis)
        requests = [Request(hypothesis.model.names) for hypothesis in hypotheses]
        fitted = {requests[number].names: evidence for number, _, evidence in _fitted(hypotheses, starts, requests)}
        each = [fitted.get(entry.names) for entry in explanations]
        return [Explanation.of([(0.0, evidence)]) if evidence else None for evidence in each]

    def _position_matters(self, hypotheses: Sequence[Hypothesis], points: Mapping[int, Points]) -> dict[int, bool]:
        """Of those hypotheses that have points, whether positioning scatter as large as it usually gets would show in
        some recording."""
        matters = dict.fromkeys(points, False)
        if self.lines.curves:
            return matters
        for members in groups(points, hypotheses):
            fitter = Fitter([hypotheses[number] for number in members])
            together = stacked([points[number] for number in members])
            products = fitter.products(together, slopes=False, place=True)
            if products.place_slopes is not None:
                first = (products.place_slopes**2).sum(axis=0) / (products.level**2 + 1e-300)
                effect = POSITION_RANGE[1] ** 2 * first + 0.5 * POSITION_RANGE[1] ** 4 * self.curvature.square
                shows = effect.max(axis=1) > _LEAST_SCATTER**2
                for owner, number in enumerate(members):
                    matters[number] = bool(shows[together.owner == owner].any())
        return matters


def integrated(explanations: Sequence[Explanation]) -> list[Explanation]:
    """With the evidence of each fit that counts over all values of what the lines leave loose."""
    counting = []
    for number, entry in enumerate(explanations):
        least = max(prior + fit.log_evidence for prior, fit in entry.each) - _COUNTS
        counting += [
            (number, place) for place, (prior, fit) in enumerate(entry.each) if prior + fit.log_evidence > least
        ]
    each = [list(entry.each) for entry in explanations]
    whole = over_all_values([each[number][place][1] for number, place in counting])
    for (number, place), fit in zip(counting, whole, strict=True):
        each[number][place] = each[number][place][0], fit
    return [Explanation.of(own) for own in each]


def _fitted(
    hypotheses: Sequence[Hypothesis], starts: Mapping[int, Points], requests: Sequence[Request], best: float = np.inf
) -> list[tuple[int, Points, Evidence | None]]:
    """Of each hypothesis that has starts: its number, the starts improved, and the evidence of the best; None where
    that does not gain on its parent, or is hopeless beside the others and the `best` cost so far."""
    fits: list[tuple[int, Points, Evidence | None]] = []
    for members in groups(starts, hypotheses):
        fitter = Fitter([hypotheses[number] for number in members])
        points = stacked([starts[number] for number in members])
        gains = np.array([requests[number].target(fitter.placed) for number in members])[points.owner]
        least = 1 if fitter.lines.curves else 0  # of curves every pair is tried, which begins from a single one
        kept = [requests[number].kept or len(requests[number].names) <= least for number in members]
        hopeless = np.where(kept, np.inf, _HOPELESS)[points.owner]

        def target(at: Evaluated, gains: Floats = gains, hopeless: Floats = hopeless, best: float = best) -> Floats:
            return np.minimum(gains, min(best, float(at.cost.min())) + hopeless)

        improved = fitter.improve(points, target)
        shown = [row for row in improved.best().tolist() if improved.cost[row] < target(improved)[row]]
        best = min(best, float(improved.cost.min()))
        evidence: dict[int, Evidence] = {}
        if shown:
            owners = improved.points.owner[shown].tolist()
            evidence = dict(zip(owners, around(fitter, improved[np.array(shown)]), strict=True))
        for owner, number in enumerate(members):
            fits.append((number, alone(improved.points, owner, fitter.counts[owner]), evidence.get(owner)))
    return fits


def _starts(hypotheses: Mapping[int, Hypothesis], requests: Sequence[Request]) -> dict[int, Points]:
    """Where the fits of requests begin."""
    starts: dict[int, Points] = {}
    for members in groups(hypotheses, hypotheses):
        beginnings = []
        for number in members:
            parent, begin = requests[number].parent, requests[number].begin
            known = None if parent is None else {name: parent.own(name) for name in parent.names}
            larger = requests[number].larger
            if larger is not None:
                known, begin = {name: larger.own(name) for name in requests[number].names}, larger.point
            added = requests[number].alone
            alone = {} if added is None else {name: added.own(name) for name in added.names}
            beginnings.append(Beginning(known, parent.point if parent and begin is None else begin, alone))
        starts |= dict(
            zip(members, best_starts(Fitter([hypotheses[number] for number in members]), beginnings), strict=True)
        )
    return starts


def _add(
    fits: Sequence[list[tuple[float, Evidence]]],
    fitted: Iterable[tuple[int, Points, Evidence | None]],
    log_prior: float,
) -> None:
    """Add the evidence that there is to each hypothesis' fits."""
    for number, _, evidence in fitted:
        if evidence is not None:
            fits[number].append((float(log_prior), evidence))
