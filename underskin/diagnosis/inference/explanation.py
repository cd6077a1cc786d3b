"""Sets of mechanisms as explanations of the recordings: their fits, from several starting points, and their evidence.

Fits begin on a grid over the prior quantiles of the mechanisms that a set adds to its parent, and at what the
recordings suggest for them (`best_starts`). Each set is fitted without position scatter and, where it could show, with
it; its evidence is the mean of both, weighted by their priors (`Explanation`). Sets that gain nothing on their parents
or lie far behind the best are pruned (`FittingProblem.explain`).
"""

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from scipy.ndimage import minimum_filter

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.evidence import Evidence, laplace_at
from underskin.diagnosis.inference.fit import Fitter, Scatter
from underskin.diagnosis.inference.gaussian import Gaussian
from underskin.diagnosis.inference.hypothesis import (
    Curvature,
    Evaluated,
    FitPoint,
    Hypothesis,
    Points,
    curvature,
)
from underskin.diagnosis.inference.least_squares import plain_least_squares
from underskin.diagnosis.noise import GAIN_PRIOR, POSITION_PRIOR, START_GAIN, Plateau
from underskin.errors import InvalidInput
from underskin.inversion.mixed_model import NO_POSITION_SCATTER, POSITION_RANGE
from underskin.mechanisms.base import Parameter, Unsupported
from underskin.mechanisms.laws.adhesion import Adhesion
from underskin.mechanisms.models.composed import Model, compose
from underskin.mechanisms.models.curves import CurveModel
from underskin.mechanisms.unlisted.laws import UnlistedLaw
from underskin.recordings.campaign import curves_of
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, Indices, Mask

_QUANTILES = {1: (0.03, 0.15, 0.3, 0.5, 0.7, 0.85, 0.97), 2: (0.1, 0.3, 0.5, 0.7, 0.9), 3: (0.2, 0.5, 0.8)}
_STARTS = 3  # fitted, of each hypothesis
# Newton steps of the noise levels at each start where a mechanism without a parent acts on them; else one
_NOISE_LEVEL_STEPS_WITHOUT_PARENT = 10
_CONTACT_POINT_STARTS = 4  # points of the grid, of curves, from which contact points are searched
_DEPTHS = (np.geomspace(1.5, 0.003, 24), np.geomspace(0.8, 1.25, 9), np.geomspace(0.96, 1.04, 7))  # of the one before


def best_starts(fitter: Fitter, request: "Request") -> Points:
    """The best of the local minima of a grid over the new mechanisms' prior quantiles, and of the values that the
    recordings suggest."""
    grid = _Grid(fitter.hypothesis, request.known)
    initial = fitter.initial(grid.coordinates, request.start)
    many_steps = fitter.covariance_indices.size and request.known is None
    at = fitter.update_noise_levels(initial, _NOISE_LEVEL_STEPS_WITHOUT_PARENT if many_steps else 1)
    cost = at.cost[: grid.size].reshape(grid.shape)
    # Many steps move the mechanisms' covariance parameters off the grid, so that all its points are kept.
    on_grid = np.arange(grid.size) if many_steps else np.flatnonzero(_are_lowest(cost))
    lowest = at[np.append(on_grid, np.arange(grid.size, len(at)))]
    if fitter.lines.curves:
        return _starts_of_curves(fitter, lowest, len(at) - grid.size, grid.new_names, request)
    return lowest.points[np.sort(_cheapest(lowest)[:_STARTS])]


class _Grid:
    """Candidates for a hypothesis' starts: a grid over the parameters of its new mechanisms, then guesses.

    Attributes: `coordinates`, of the fit (candidates, mechanism parameters); `shape`, along each new parameter, and
    `size` of the grid; `new_names`, the mechanisms that the parent lacks.
    """

    def __init__(self, hypothesis: Hypothesis, explained: "Explanation | None") -> None:
        slices = hypothesis.spans
        known = {} if explained is None else {name: explained.coordinates(name) for name in explained.names}
        parent = {name: known[name] for name in slices if name in known}
        # A mechanism also counts as new if its parameters differ from those in the parent.
        self.new_names = [name for name, span in slices.items() if len(parent.get(name, ())) != span.stop - span.start]
        parameters = {name: hypothesis.model.parameters[slices[name]] for name in self.new_names}
        varied = sum(not parameter.starts for of_mechanism in parameters.values() for parameter in of_mechanism)
        quantiles = _QUANTILES.get(varied, (0.5,))
        if any(isinstance(hypothesis.lines.mechanisms[name], UnlistedLaw) for name in self.new_names):
            quantiles = (0.5,)
        axes = [
            [parameter.to_fit(value) for value in parameter.starts] or [parameter.quantile(q) for q in quantiles]
            for name in self.new_names
            for parameter in parameters[name]
        ]
        columns = [column for name in self.new_names for column in range(slices[name].start, slices[name].stop)]
        points = [*itertools.product(*axes)]
        self.shape = [len(axis) for axis in axes] or [1]
        self.size = len(points)
        points += map(tuple, _guesses(self.new_names, hypothesis))
        self.coordinates = np.zeros((len(points), hypothesis.mechanism_parameter_count))
        for name, values in parent.items():
            if name not in self.new_names:
                self.coordinates[:, slices[name]] = values
        self.coordinates[:, columns] = points


def _with_contact_points(fitter: Fitter, at: Evaluated) -> Evaluated:
    """Of indentations: the best contact point of each curve, by a search with ever finer steps of the depth.

    Given the shared parameters curves are independent, so one set of depths serves all of them.
    """
    hypothesis, model = fitter.hypothesis, fitter.model
    assert isinstance(model, CurveModel)
    indices = model.contact_points
    travels = [curve.displacement_mm for curve in curves_of(fitter.lines.campaign)]
    deepest, span = np.array([travel.max() for travel in travels]), np.array([np.ptp(travel) for travel in travels])
    covariance = np.tile([GAIN_PRIOR.middle, 0.0, hypothesis.smooth.middle, *at.points.covariance[0, 3:]], (len(at), 1))
    levels = fitter.levels(covariance[:1, None])
    depth = np.repeat(span[None], len(at), axis=0)
    for ratios in _DEPTHS:
        depths = depth[:, None] * ratios[:, None]  # (starts, ratios, curves)
        tried = np.clip(deepest - depths, fitter.low[indices], fitter.high[indices]).reshape(-1, len(indices))
        points = at.points[np.repeat(np.arange(len(at)), len(ratios))]
        fit = points.fit.copy()
        fit[:, indices] = tried
        sums = fitter.products(replace(points, fit=fit), slopes=False, place=False).summed(levels)
        uu, uy, yy = (part[:, 0] for part in (sums.uu, sums.uy, np.broadcast_to(sums.yy, sums.uu.shape)))
        residual = yy - 2 * uy + uu - (uu - uy) ** 2 / (START_GAIN**-2 + uu)
        best = residual.reshape(depths.shape).argmin(axis=1)[:, None]
        depth = np.take_along_axis(depths, best, axis=1)[:, 0]
    chosen = at.points.fit.copy()
    chosen[:, indices] = np.clip(deepest - depth, fitter.low[indices], fitter.high[indices])
    return fitter.evaluate(replace(at.points, fit=chosen, covariance=covariance), slopes=False)


def _starts_of_curves(
    fitter: Fitter, lowest: Evaluated, guess_count: int, new_names: Sequence[str], request: "Request"
) -> Points:
    """The best starts of curves, with contact points searched where none are known; the last `guess_count` of `lowest`
    are guesses."""
    grid_count = len(lowest) - guess_count
    ranked = _cheapest(lowest[:grid_count])[:_CONTACT_POINT_STARTS]
    candidates = lowest[np.append(np.sort(ranked), np.arange(grid_count, len(lowest)))]
    is_single = len(fitter.model.names) == 1
    moves_contact = is_single and Adhesion.name in new_names
    if fitter.lines.kind == "indentation" and (moves_contact or request.start is None):
        candidates = _with_contact_points(fitter, candidates)
    begins_at_guesses = any(isinstance(fitter.lines.mechanisms[name], UnlistedLaw) for name in new_names)
    count = 1 if request.known is not None and not begins_at_guesses else _STARTS
    starts = candidates.points[np.sort(_cheapest(candidates)[:count])]
    if not (moves_contact and guess_count):
        return starts
    # The null hypothesis' modulus and contact points may lead away from the jumps of the curves: the best guess is also
    # fitted from the priors' centres.
    initial = fitter.initial(lowest.points.fit[grid_count:, : fitter.hypothesis.mechanism_parameter_count])
    return Points.joined([starts, initial.best.points])


def _cheapest(at: Evaluated) -> Indices:
    """Indices of the points in ascending order of cost."""
    return np.argsort(at.cost, kind="stable")


def _guesses(names: Sequence[str], hypothesis: Hypothesis) -> list[list[float]]:
    """Fit coordinates of these mechanisms' parameters by guesses from the recordings, in all combinations; none where a
    mechanism has no guess."""
    conditions, kind, mechanisms = hypothesis.lines.campaign, hypothesis.lines.kind, hypothesis.lines.mechanisms
    alternatives = []
    for name in names:
        parameters = mechanisms[name].parameters(conditions, kind)
        values = [
            dict(zip([parameter.name for parameter in parameters], guess, strict=True))
            for guess in mechanisms[name].guesses(conditions, kind)
        ]
        alternatives.append([[_coordinate(parameter, guess) for parameter in parameters] for guess in values])
    return [list(itertools.chain(*combined)) for combined in itertools.product(*alternatives)] if names else []


def _coordinate(parameter: Parameter, guess: Mapping[str, float]) -> float:
    unit = 1.0 if parameter.relative_to is None else guess[parameter.relative_to]
    return float(np.clip(parameter.to_fit(guess[parameter.name] / unit), *parameter.bounds))


def _are_lowest(cost: Floats) -> Mask:
    """The local minima of a grid."""
    neighbourhood_minimum = minimum_filter(cost, size=3, mode="nearest")
    return np.asarray(cost <= neighbourhood_minimum)


def hardly_scatters(evidence: Evidence) -> bool:
    """Whether the position scatter is below the usual one: the added mechanism may explain the parent's scatter."""
    return float(evidence.point.covariance[Scatter.POSITION]) < POSITION_PRIOR.middle


def without_scatter(points: Points) -> Points:
    """The points of a hypothesis with position scatter, without that parameter."""
    return replace(points, covariance=np.delete(points.covariance, Scatter.POSITION, axis=1))


_SCATTER_CERTAINTY = (
    0.999  # probability of position scatter, or of none, beyond which children are fitted as the parent
)
_LEAST_GAIN = 1.0  # in log posterior density over the parent
PRUNE_NATS = 30.0  # of log posterior density behind the best: the evidence is more than 10 nats behind
_LEAST_SCATTER = 3e-3  # relative effect of position scatter on a recording, below which it is not fitted


@dataclass(frozen=True)
class Explanation:
    """A set of mechanisms and its evidence.

    `best` is the more probable of its fits with and without position scatter.
    """

    names: tuple[str, ...]
    log_evidence: float
    best: Evidence
    p_position_scatter: float  # probability that there is position scatter, given this set
    fits: tuple[tuple[float, Evidence], ...]  # log prior and fit, without and with it, as far as fitted

    @classmethod
    def of(cls, fits: Sequence[tuple[float, Evidence]]) -> Self:
        """From the log prior and the evidence of each fit."""
        weights = np.array([prior + fit.log_evidence for prior, fit in fits])
        total = float(np.logaddexp.reduce(weights))
        best = fits[int(np.argmax(weights))][1]
        scattered = [fit.hypothesis.has_position_scatter for _, fit in fits]
        p_position_scatter = float(np.exp(weights[scattered] - total).sum())
        return cls(fits[0][1].hypothesis.model.names, total, best, p_position_scatter, tuple(fits))

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
        """Of curves, `plain_least_squares` from the most probable parameters: their fit, and its residual [%]."""
        return plain_least_squares(self.best.hypothesis, self.point.fit)

    def coordinates(self, name: str) -> list[float]:
        """The most probable fit coordinates of one of its mechanisms."""
        return list(self.point.fit[self.spans[name]])

    @property
    def spans(self) -> dict[str, slice]:
        """The slice of the parameters that belongs to each mechanism."""
        return self.best.hypothesis.spans

    def index(self, name: str) -> int:
        """The index of a parameter."""
        return self.best.hypothesis.index(name)


@dataclass(frozen=True)
class Request:
    """A set of mechanisms to explain; `parent` is the explanation of the set without one of them."""

    names: tuple[str, ...]
    parent: Explanation | None = None
    nuisances: FitPoint | None = None  # starting values of the nuisances, if not the parent's
    larger: Explanation | None = None  # of the set with one mechanism more, from whose values the fit begins
    rival: Explanation | None = None  # what a fit must gain on, if not on the parent's
    never_pruned: bool = False  # fitted to convergence and explained, however far behind and even without gain

    @property
    def start(self) -> FitPoint | None:
        """The point with the nuisances' starting values; None for their priors' centres."""
        return self.known.point if self.nuisances is None and self.known is not None else self.nuisances

    @property
    def known(self) -> Explanation | None:
        """The explanation with the mechanisms' starting values."""
        return self.larger or self.parent

    @property
    def without_scatter(self) -> bool:
        """Whether it is fitted without position scatter."""
        return self.parent is None or self.parent.p_position_scatter < _SCATTER_CERTAINTY

    def cost_to_beat(self, has_position_scatter: bool) -> float:
        """The cost below which a fit gains enough on its rival's; ∞ where there is none to compare.

        Only fits that both have position scatter, or both lack it, are compared.
        """
        rival = self.rival or self.parent
        if rival is None or self.never_pruned or (rival.p_position_scatter > 0.5) is not has_position_scatter:
            return np.inf
        return rival.best.cost - _LEAST_GAIN


OtherKindsLikelihood = Callable[[Model, Lines], Gaussian | None]


class FittingProblem:
    """Recordings of one kind and their noise, to which hypotheses are fitted: all lines, and one mean a recording."""

    def __init__(
        self,
        lines: Lines,
        table: SigmaTable,
        other_kinds: OtherKindsLikelihood | None = None,
        gain: Plateau = GAIN_PRIOR,
    ) -> None:
        """Collapse the lines of FRFs and compute the curvature of σ; curves are not collapsed and have no place.

        `other_kinds` gives the likelihood of a model's parameters by recordings of other kinds; `gain` is the prior of
        the gain scatter's logarithm.
        """
        self.lines = lines
        self.other_kinds = other_kinds
        self.gain = gain
        self.kind = kind = lines.kind
        self.table = table
        self.collapsed = lines.collapsed()
        none = np.zeros(lines.recordings)
        self.curvature = curvature(self.collapsed, table) if kind == "frf" else Curvature(none, none)
        self._hypotheses: dict[tuple[frozenset[str], bool, bool], Hypothesis] = {}

    def hypothesis(self, names: Sequence[str], has_position_scatter: bool, *, all_lines: bool = False) -> Hypothesis:
        """The set's model, on all lines where asked or needed by a mechanism, else on the means; raises Unsupported."""
        all_lines = all_lines or any(self.lines.mechanisms[name].needs_lines for name in names)
        key = frozenset(names), all_lines, has_position_scatter
        if key not in self._hypotheses:
            hypothesis = self._hypotheses.get((frozenset(names), all_lines, not has_position_scatter))
            if hypothesis is None:
                lines = self.lines if all_lines else self.collapsed
                model = compose(names, lines.campaign, self.table, self.kind, lines.mechanisms)
                gaussian = None if self.other_kinds is None else self.other_kinds(model, lines)
                hypothesis = Hypothesis(
                    model, lines, self.curvature, has_position_scatter, gain=self.gain, other_kinds=gaussian
                )
            self._hypotheses[key] = replace(hypothesis, has_position_scatter=has_position_scatter)
        return self._hypotheses[key]

    def explain(self, request: Request, best: float = np.inf) -> Explanation | None:
        """The set's explanation, with and without position scatter where that could show.

        None where the log posterior density gains less than `_LEAST_GAIN` over the parent's: the added mechanism is not
        supported; and where the set is pruned, `PRUNE_NATS` behind the `best` cost so far. Evidences are Laplace
        approximations. Raises Unsupported.
        """
        parent = request.parent
        plain, scattered = (Fitter(self.hypothesis(request.names, has_scatter)) for has_scatter in (False, True))
        log_priors = np.log([NO_POSITION_SCATTER, 1 - NO_POSITION_SCATTER]).tolist()
        fits: list[tuple[float, Evidence]] = []
        if request.without_scatter:
            improved, evidence = _fitted(plain, best_starts(plain, request), request, best)
            if evidence is None and parent is not None and parent.p_position_scatter <= 0.5:
                return None
            tries_scatter = (
                self._position_matters(plain, improved)
                if parent is None
                else parent.p_position_scatter > 1 - _SCATTER_CERTAINTY
            )
            if evidence is not None:
                fits.append((log_priors[0] if tries_scatter or parent else 0.0, evidence))
                best = min(best, evidence.cost)
            if not tries_scatter:
                return Explanation.of(fits) if fits else None
            starts = scattered.with_scatter(improved)
        else:
            starts = best_starts(scattered, request)
        improved, evidence = _fitted(scattered, starts, request, best)
        if evidence is None:
            gains = fits and fits[0][1].cost < request.cost_to_beat(has_position_scatter=True)
            return Explanation.of(fits) if gains else None
        if not fits and (request.without_scatter or hardly_scatters(evidence)):
            _, without = _fitted(plain, without_scatter(improved), request, min(best, evidence.cost))
            fits += [] if without is None else [(log_priors[0], without)]
        return Explanation.of([*fits, (log_priors[1], evidence)])

    def explain_all(self, requests: Sequence[Request]) -> list[Explanation | None]:
        """The same of several sets, one after another, each pruned against the best before it."""
        explanations: list[Explanation | None] = []
        best = np.inf
        for request in requests:
            explanations.append(explanation := self.explain(request, best))
            best = best if explanation is None else min(best, explanation.best.cost)
        return explanations

    def refit(self, explanations: Sequence[Explanation]) -> list[Explanation | None]:
        """Explanations of more recordings, fitted to these from their most probable points; Laplace approximations.

        None where a set has other parameters for these recordings, or they do not support it.
        """
        refitted: list[Explanation | None] = []
        best = np.inf
        for explanation in explanations:
            evidence = self._refitted(explanation, best)
            best = best if evidence is None else min(best, evidence.cost)
            refitted.append(None if evidence is None else Explanation.of([(0.0, evidence)]))
        return refitted

    def _refitted(self, explanation: Explanation, best: float) -> Evidence | None:
        try:
            hypothesis = self.hypothesis(explanation.names, explanation.best.hypothesis.has_position_scatter)
        except (Unsupported, InvalidInput):
            return None  # a recording that the mechanism, or any model of a curve, needs was left out
        names = [parameter.name for parameter in hypothesis.model.parameters]
        if names != [parameter.name for parameter in explanation.model.parameters]:
            return None
        fitter = Fitter(hypothesis)
        # Bounds may be narrower here: those of a time follow from how often the curves were sampled.
        fit = np.clip(explanation.point.fit, fitter.low, fitter.high)
        start = fitter.at(replace(explanation.point, fit=fit, sensor_log_gain=fitter.no_sensor_log_gain))
        return _fitted(fitter, start, Request(explanation.names), best)[1]

    def _position_matters(self, fitter: Fitter, points: Points) -> bool:
        """Whether position scatter, as large as it usually gets, would show in some recording at one of the points."""
        products = fitter.products(points, slopes=False, place=True)
        if products.squared_slopes is None:
            return False
        first = products.squared_slopes / (products.level**2 + 1e-300)
        effect = POSITION_RANGE[1] ** 2 * first + 0.5 * POSITION_RANGE[1] ** 4 * self.curvature.square
        return bool((effect > _LEAST_SCATTER**2).any())


def _fitted(fitter: Fitter, starts: Points, request: Request, best: float) -> tuple[Points, Evidence | None]:
    """The improved starts, and the evidence of the best; None where that does not gain on its parent, or is pruned: far
    behind the `best` cost so far."""
    cost_to_beat = request.cost_to_beat(fitter.has_position_scatter)
    # Of curves every pair is tried, and begins from a single mechanism.
    pruned = not (request.never_pruned or len(request.names) <= (1 if fitter.lines.curves else 0))

    def target(at: Evaluated) -> Floats:
        margin = PRUNE_NATS if pruned else np.inf
        return np.full(len(at), min(cost_to_beat, min(best, float(at.cost.min())) + margin))

    compared = request.parent or request.rival
    near = np.inf if compared is None else compared.best.cost + PRUNE_NATS
    improved = fitter.improve(starts, target, near)
    leading = improved.best
    supported = leading.cost[0] < target(leading)[0]
    return improved.points, laplace_at(fitter, leading) if supported else None
