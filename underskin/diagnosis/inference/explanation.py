"""Sets of mechanisms as explanations of the recordings.

Where a fit begins: a grid over what is new in a set of mechanisms, and what the recordings suggest of it. Hypotheses
with and without positioning scatter: which are evaluated together, and how one begins at another.

One set of mechanisms as an explanation of the recordings: fitted from several starts, and its evidence.

Sets are fitted without positioning scatter and, where it could show, with it; the evidence is the mean of both.
"""

import itertools
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from scipy.ndimage import minimum_filter

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.evidence import Evidence, around
from underskin.diagnosis.inference.evidence import integrated as over_all_values
from underskin.diagnosis.inference.fit import POSITION, Fitter, with_contact_points, with_softer_moduli
from underskin.diagnosis.inference.gaussian import Gaussian
from underskin.diagnosis.inference.hypothesis import (
    Curvature,
    Evaluated,
    FitPoint,
    Hypothesis,
    Points,
    curvature,
    joined_points,
    parameter_slices,
    points_of,
    stacked,
)
from underskin.diagnosis.inference.least_squares import plain_least_squares
from underskin.diagnosis.noise import GAIN_PRIOR, POSITION_PRIOR, Plateau
from underskin.errors import InvalidInput
from underskin.mechanisms.base import Unsupported
from underskin.mechanisms.models.composed import Model, compose
from underskin.mechanisms.parameter import Parameter
from underskin.recordings.usual_scatter import NO_POSITION_SCATTER, POSITION_RANGE
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, Indices, Mask

_QUANTILES = {1: (0.03, 0.15, 0.3, 0.5, 0.7, 0.85, 0.97), 2: (0.1, 0.3, 0.5, 0.7, 0.9), 3: (0.2, 0.5, 0.8)}
_KEPT_STARTS = 3
_SETTLING, _SETTLING_ALONE = 1, 10  # steps of the noise levels from each start, and of a mechanism that acts on them
_KEPT_OF_PARENT = 1  # of curves, from an explanation with one mechanism less
_PLACED_STARTS = 4  # of curves, whose contact points are looked for


@dataclass(frozen=True)
class StartingPoint:
    """Where the fit of a hypothesis may begin.

    `parent`: fit coordinates of its mechanisms that were fitted without the others; None where none were. `begin`:
    where the nuisances begin; None for their priors' centres. `alone`: those of the others where these were fitted
    alone, another guess.
    """

    parent: Mapping[str, Sequence[float]] | None
    begin: FitPoint | None
    alone: Mapping[str, Sequence[float]]


def best_starts(fitter: Fitter, beginnings: Sequence[StartingPoint]) -> list[Points]:
    """Of each hypothesis the best of the local minima of a grid over the new mechanisms' prior quantiles, and of what
    recordings suggest."""
    grids = [_Grid(*pair) for pair in zip(fitter.hypotheses, beginnings, strict=True)]
    begun = fitter.initial([grid.own for grid in grids], [entry.begin for entry in beginnings])
    settles = fitter.covariance_indices.size and all(entry.parent is None for entry in beginnings)
    tried = fitter.update_noise_levels(begun, _SETTLING_ALONE if settles else _SETTLING)
    edges = np.cumsum([0, *(len(grid.own) for grid in grids)])
    starts = []
    for number, (grid, beginning) in enumerate(zip(grids, beginnings, strict=True)):
        own = tried[edges[number] : edges[number + 1]]
        cost = own.cost[: grid.size].reshape(grid.shape)
        # Noise levels that have settled have left the grid.
        on_grid = np.arange(grid.size) if settles else np.flatnonzero(_are_lowest(cost))
        lowest = own[np.append(on_grid, np.arange(grid.size, len(own)))]
        if fitter.lines.curves:
            guessed = len(own) - grid.size
            starts.append(_of_curves(fitter, lowest, guessed, grid.new, beginning))
        else:
            starts.append(lowest.points[np.sort(_cheapest(lowest)[:_KEPT_STARTS])])
    return starts


class _Grid:
    """Coordinates of a hypothesis' mechanisms (points, own): a grid, then guesses.

    Attributes: `own`; `shape`, along each new parameter, and `size` of the grid; `new`, the mechanisms that are.
    """

    def __init__(self, hypothesis: Hypothesis, beginning: StartingPoint) -> None:
        places = parameter_slices(hypothesis.model.names, hypothesis.lines)
        known = beginning.parent or {}
        # New too is what has other parameters beside the mechanism that was added.
        self.new = [name for name, place in places.items() if len(known.get(name, ())) != place.stop - place.start]
        parameters = {name: hypothesis.model.parameters[places[name]] for name in self.new}
        loose = sum(not entry.starts for own in parameters.values() for entry in own)
        quantiles = _QUANTILES.get(loose, (0.5,))
        if any(hypothesis.lines.mechanisms[name].begins_at_guesses for name in self.new):
            quantiles = (0.5,)
        axes = [
            [entry.to_fit(value) for value in entry.starts] or [entry.quantile(q) for q in quantiles]
            for name in self.new
            for entry in parameters[name]
        ]
        free = [place for name in self.new for place in range(places[name].start, places[name].stop)]
        points = [*itertools.product(*axes)]
        self.shape = [len(axis) for axis in axes] or [1]
        self.size = len(points)
        points += map(tuple, _guesses(self.new, hypothesis))
        alone = [value for name in self.new for value in beginning.alone.get(name, ())]
        if self.new and len(alone) == len(free):
            points.append(tuple(alone))
        self.own = np.zeros((len(points), hypothesis.mechanism_parameter_count))
        for name, values in known.items():
            if name not in self.new:
                self.own[:, places[name]] = values
        self.own[:, free] = points


def _of_curves(fitter: Fitter, lowest: Evaluated, guessed: int, new: Sequence[str], beginning: StartingPoint) -> Points:
    """The best starts of curves, contact points looked for where none are known; the last so many are guesses."""
    count = len(lowest) - guessed
    ranked = _cheapest(lowest[:count])[:_PLACED_STARTS]
    several = lowest[np.append(np.sort(ranked), np.arange(count, len(lowest)))]
    alone = len(fitter.hypotheses[0].model.names) == 1
    sticks = alone and any(fitter.lines.mechanisms[name].moves_contact_points for name in new)
    if fitter.lines.kind == "indentation" and (sticks or beginning.begin is None):
        several = with_contact_points(fitter, with_softer_moduli(fitter, several) if sticks else several)
    guesses = any(fitter.lines.mechanisms[name].begins_at_guesses for name in new)
    kept = _KEPT_OF_PARENT if beginning.parent is not None and not guesses else _KEPT_STARTS
    chosen = several.points[np.sort(_cheapest(several)[:kept])]
    if new and beginning.parent is not None and beginning.begin is not None:
        chosen = joined_points(chosen, _without_effect(fitter, new, beginning.parent, beginning.begin))
    if not (sticks and guessed):
        return chosen
    # What the null hypothesis made of modulus and contact points may lead away from where the jumps are.
    own = fitter.hypotheses[0].mechanism_parameter_count
    begun = fitter.initial([lowest.points.fit[count:, :own]], [None])
    return joined_points(chosen, begun.points[_cheapest(begun)[:1]])


def _without_effect(
    fitter: Fitter, new: Sequence[str], parent: Mapping[str, Sequence[float]], begin: FitPoint
) -> Points:
    """Where a set's fit stands, with the mechanisms that were added to it as near as may be to no effect."""
    (hypothesis,) = fitter.hypotheses
    own = np.zeros((1, hypothesis.mechanism_parameter_count))
    for name, place in parameter_slices(hypothesis.model.names, hypothesis.lines).items():
        own[0, place] = (
            [_of_no_effect(one) for one in hypothesis.model.parameters[place]] if name in new else parent.get(name, ())
        )
    return replace(fitter.start([own], [begin]), covariance=begin.covariance[None])


def _of_no_effect(entry: Parameter) -> float:
    """The fit coordinate within the bounds that is nearest to no effect; the prior's centre where none is."""
    if entry.limit is None:
        return entry.start
    low, high = entry.bounds
    if entry.fit_limit is not None:
        return float(np.clip(entry.fit_limit, low, high))
    return high if entry.limit > 0 else low


def _cheapest(at: Evaluated) -> Indices:
    """The points in the order of their costs."""
    return np.argsort(at.cost, kind="stable")


def _guesses(names: Sequence[str], hypothesis: Hypothesis) -> list[list[float]]:
    """Fit coordinates of these mechanisms' parameters as the recordings suggest them; none where one has no guess."""
    conditions, kind, known = hypothesis.lines.campaign, hypothesis.lines.kind, hypothesis.lines.mechanisms
    each = []
    for name in names:
        entries = known[name].parameters(conditions, kind)
        values = [
            dict(zip([one.name for one in entries], guess, strict=True))
            for guess in known[name].guesses(conditions, kind)
        ]
        each.append([[_coordinate(one, guess) for one in entries] for guess in values])
    return [list(itertools.chain(*combined)) for combined in itertools.product(*each)] if names else []


def _coordinate(entry: Parameter, values: Mapping[str, float]) -> float:
    unit = 1.0 if entry.relative_to is None else values[entry.relative_to]
    return float(np.clip(entry.to_fit(values[entry.name] / unit), *entry.bounds))


def _are_lowest(cost: Floats) -> Mask:
    """Where on a grid no neighbour is lower."""
    around_each = minimum_filter(cost, size=3, mode="nearest")
    return np.asarray(cost <= around_each)


def with_scatter(hypotheses: Sequence[Hypothesis], points: Mapping[int, Points]) -> dict[int, Points]:
    """For hypotheses with positioning scatter, from the points of those without it."""
    starts: dict[int, Points] = {}
    for members in groups(points, hypotheses):
        fitter = Fitter([hypotheses[number] for number in members])
        begun = fitter.with_scatter(stacked([points[number] for number in members]))
        starts |= {number: points_of(begun, owner, fitter.counts[owner]) for owner, number in enumerate(members)}
    return starts


def hardly_scatters(evidence: Evidence) -> bool:
    """Whether the positioning scatter that a parent needed is less than usual here: what was added may explain it."""
    return float(evidence.point.covariance[POSITION]) < POSITION_PRIOR.middle


def without_scatter(points: Points) -> Points:
    """The points of a hypothesis with positioning scatter, less that."""
    return replace(points, covariance=np.delete(points.covariance, POSITION, axis=1))


def groups(
    numbers: Iterable[int], hypotheses: Sequence[Hypothesis] | Mapping[int, Hypothesis]
) -> Collection[list[int]]:
    """Which of these hypotheses can be evaluated together."""
    groups: dict[object, list[int]] = {}
    for number in numbers:
        groups.setdefault(hypotheses[number].group(number), []).append(number)
    return groups.values()


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
    has_position_scatter: float  # probability that there is positioning scatter, given this set
    each: tuple[tuple[float, Evidence], ...]  # without and with it, as far as they were fitted, with their log priors

    @classmethod
    def of(cls, each: Sequence[tuple[float, Evidence]]) -> Self:
        """From the fits, the log prior of each beside it."""
        weights = np.array([prior + fit.log_evidence for prior, fit in each])
        total = float(np.logaddexp.reduce(weights))
        best = each[int(np.argmax(weights))][1]
        scattered = [fit.hypothesis.has_position_scatter for _, fit in each]
        has_position_scatter = float(np.exp(weights[scattered] - total).sum())
        return cls(each[0][1].hypothesis.model.names, total, best, has_position_scatter, tuple(each))

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
        return list(self.point.fit[parameter_slices(self.names, self.best.hypothesis.lines)[name]])


@dataclass(frozen=True)
class Request:
    """A set of mechanisms to explain; `parent`: the explanation of a set with one less, `alone` that of the other."""

    names: tuple[str, ...]
    parent: Explanation | None = None
    alone: Explanation | None = None
    begin: FitPoint | None = None  # where nuisances begin, if not where the parent has them
    initial: Explanation | None = None  # from whose parameters the fit begins
    never_pruned: bool = False  # fitted to its end however far behind, and explained though it gains nothing

    @property
    def without_scatter(self) -> bool:
        """Whether it is fitted without positioning scatter."""
        return self.parent is None or self.parent.has_position_scatter < _DECIDED

    def cost_to_beat(self, has_position_scatter: bool) -> float:
        """The cost below which a fit is better than the parent's of like scatter; ∞ where that cannot be compared."""
        if (
            self.parent is None
            or self.never_pruned
            or (self.parent.has_position_scatter > 0.5) is not has_position_scatter
        ):
            return np.inf
        return self.parent.best.cost - _LEAST_GAIN


OtherKindsLikelihood = Callable[[Model, Lines], Gaussian | None]


class FittingProblem:
    """Recordings of one kind and their noise, to which hypotheses are fitted: all rows, and a mean a recording."""

    def __init__(
        self,
        lines: Lines,
        table: SigmaTable,
        other_kinds: OtherKindsLikelihood | None = None,
        gain: Plateau = GAIN_PRIOR,
    ) -> None:
        """`other_kinds` is what recordings of other kinds say of a model's parameters, `gain` the prior of the gain
        scatter's logarithm; lines of FRFs are collapsed to a mean for each recording."""
        self.lines = lines
        self.other_kinds = other_kinds
        self.gain = gain
        self.kind = kind = lines.kind
        self.table = table
        self.collapsed = lines.collapsed() if kind == "frf" else lines
        none = np.zeros(lines.recordings)
        self.curvature = curvature(self.collapsed, table) if kind == "frf" else Curvature(none, none)
        self._hypotheses: dict[tuple[frozenset[str], bool, bool], Hypothesis] = {}

    def hypothesis(self, names: Sequence[str], has_position_scatter: bool, *, whole: bool = False) -> Hypothesis:
        """The set's model on the lines that it needs; raises Unsupported."""
        whole = whole or any(self.lines.mechanisms[name].needs_lines for name in names)
        key = frozenset(names), whole, has_position_scatter
        if key not in self._hypotheses:
            other = self._hypotheses.get((frozenset(names), whole, not has_position_scatter))
            if other is None:
                lines = self.lines if whole else self.collapsed
                model = compose(names, lines.campaign, self.table, self.kind, lines.mechanisms)
                known = None if self.other_kinds is None else self.other_kinds(model, lines)
                other = Hypothesis(
                    model, lines, self.curvature, has_position_scatter, gain=self.gain, other_kinds=known
                )
            self._hypotheses[key] = replace(other, has_position_scatter=has_position_scatter)
        return self._hypotheses[key]

    def explain(self, requests: Sequence[Request], best: float = np.inf) -> list[Explanation | None]:
        """The sets' explanations.

        None where the log posterior density gains less than `_LEAST_GAIN` over the parent's: the added mechanism does
        not show; and where a set of mechanisms is hopeless, by `_HOPELESS` nats behind the others or what is the `best`
        cost so far. Evidences are Laplace approximations, until they are `integrated`. Raises Unsupported.
        """
        plain, has_position_scatter = (
            [self.hypothesis(request.names, scattered) for request in requests] for scattered in (False, True)
        )
        scattered = {number for number, request in enumerate(requests) if not request.without_scatter}
        starts = _starts(
            {number: plain[number] for number in range(len(requests)) if number not in scattered}, requests
        )
        placed_starts = _starts({number: has_position_scatter[number] for number in sorted(scattered)}, requests)
        fits: list[list[tuple[float, Evidence]]] = [[] for _ in requests]
        log_priors = np.log([NO_POSITION_SCATTER, 1 - NO_POSITION_SCATTER])
        also_placed: dict[int, Points] = {}
        fitted = _fitted(plain, starts, requests, best)
        parentless = {number: improved for number, improved, _ in fitted if requests[number].parent is None}
        matters = self._position_matters(plain, parentless)
        for number, improved, evidence in fitted:
            parent = requests[number].parent
            if evidence is None and parent is not None and parent.has_position_scatter <= 0.5:
                continue
            also = parent.has_position_scatter > 1 - _DECIDED if parent else matters[number]
            if evidence is not None:
                fits[number].append((float(log_priors[0]) if also or parent else 0.0, evidence))
            if also:
                also_placed[number] = improved
        placed_starts |= with_scatter(has_position_scatter, also_placed)
        best = min([best, *(evidence.cost for own in fits for _, evidence in own)])
        shown_plain = {number for number, own in enumerate(fits) if own}
        scattering = _fitted(has_position_scatter, placed_starts, requests, best)
        _add(fits, scattering, log_priors[1])
        for number, _, evidence in scattering:
            if evidence is None and np.isfinite(requests[number].cost_to_beat(True)):
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
                hypothesis = self.hypothesis(entry.names, entry.best.hypothesis.has_position_scatter)
            except (Unsupported, InvalidInput):
                continue  # what was left out is what the mechanism, or any model of a curve, needs
            if [one.name for one in hypothesis.model.parameters] == [one.name for one in entry.model.parameters]:
                fitter = Fitter([hypothesis])
                # Bounds may be narrower here: those of a time follow from how often the curves were sampled.
                fit = np.clip(entry.point.fit, fitter.low[0], fitter.high[0])
                starts[len(hypotheses)] = fitter.at(
                    replace(entry.point, fit=fit, sensor_log_gain=fitter.no_sensor_log_gain)
                )
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
    """With the evidence of each fit that counts over all values of the position scatter."""
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
        gains = np.array([requests[number].cost_to_beat(fitter.has_position_scatter) for number in members])[
            points.owner
        ]
        least = 1 if fitter.lines.curves else 0  # of curves every pair is tried, which begins from a single one
        never_pruned = [requests[number].never_pruned or len(requests[number].names) <= least for number in members]
        hopeless = np.where(never_pruned, np.inf, _HOPELESS)[points.owner]

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
            fits.append((number, points_of(improved.points, owner, fitter.counts[owner]), evidence.get(owner)))
    return fits


def _starts(hypotheses: Mapping[int, Hypothesis], requests: Sequence[Request]) -> dict[int, Points]:
    """Where the fits of requests begin."""
    starts: dict[int, Points] = {}
    for members in groups(hypotheses, hypotheses):
        beginnings = []
        for number in members:
            parent, begin = requests[number].parent, requests[number].begin
            known = None if parent is None else {name: parent.own(name) for name in parent.names}
            initial = requests[number].initial
            if initial is not None:
                known, begin = {name: initial.own(name) for name in requests[number].names}, initial.point
            added = requests[number].alone
            alone = {} if added is None else {name: added.own(name) for name in added.names}
            beginnings.append(StartingPoint(known, parent.point if parent and begin is None else begin, alone))
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
