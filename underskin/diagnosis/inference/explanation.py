"""One set of mechanisms as an explanation of the recordings: fitted from several starts, and its evidence.

Every set is fitted without positioning scatter and, where that could show, with it; its evidence is the mean of the
two under their prior.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.evidence import Evidence, around, integrated
from underskin.diagnosis.inference.hypothesis import FitPoint, Hypothesis
from underskin.diagnosis.inference.likelihood import Curvature
from underskin.diagnosis.inference.optimizer import Evaluated, Fitter
from underskin.diagnosis.inference.position_curvature import curvature
from underskin.diagnosis.noise.noise_priors import GAIN_PRIOR
from underskin.mechanisms.models.composed import Model, compose
from underskin.mechanisms.models.composition import parameters_together
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.usual_scatter import NO_POSITION_SCATTER, POSITION_RANGE
from underskin.surrogate.sigma_table import SigmaTable

_QUANTILES = {1: (0.03, 0.15, 0.3, 0.5, 0.7, 0.85, 0.97), 2: (0.1, 0.3, 0.5, 0.7, 0.9), 3: (0.2, 0.5, 0.8)}
_KEPT_STARTS = 3
_DECIDED = 0.999  # probability beyond which a parent's positioning scatter, or none, is its offspring's
_COUNTS = 8.0  # nats behind the other fit within which one counts
_POSITION_STARTS = (0.07e-3, 0.14e-3, 0.28e-3)  # [m]
_LEAST_GAIN = 1.0  # in log posterior density
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
    def of(cls, names: Sequence[str], each: Sequence[tuple[float, Evidence]]) -> Self:
        """From the fits, the log prior of each beside it."""
        weights = np.array([prior + fit.log_evidence for prior, fit in each])
        total = float(np.logaddexp.reduce(weights))
        best = each[int(np.argmax(weights))][1]
        scattered = [fit.fitter.hypothesis.placed for _, fit in each]
        placed = float(np.exp(weights[scattered] - total).sum())
        return cls(tuple(name for name in CATALOGUE if name in names), total, best, placed, tuple(each))

    def integrated(self) -> Self:
        """With the evidence of each fit that counts over all values of what the lines leave loose."""
        least = max(prior + fit.log_evidence for prior, fit in self.each) - _COUNTS
        return self.of(
            self.names,
            [(prior, integrated(fit) if prior + fit.log_evidence > least else fit) for prior, fit in self.each],
        )

    @property
    def model(self) -> Model:
        """The composed model."""
        return self.best.fitter.hypothesis.model

    @property
    def point(self) -> FitPoint:
        """The most probable parameters."""
        return self.best.at.point

    def own(self, name: str) -> list[float]:
        """The fit coordinates of one of its mechanisms."""
        return list(self.point.fit[own_places(self.names, self.best.fitter.hypothesis.lines)[name]])


def own_places(names: Sequence[str], lines: Lines) -> dict[str, slice]:
    """Where in a composed model's parameters each mechanism's are."""
    mechanisms = [mechanism for name, mechanism in CATALOGUE.items() if name in names]
    places, first = {}, 0
    for name, own in parameters_together(mechanisms, lines.campaign, lines.kind).items():
        places[name] = slice(first, first + len(own))
        first += len(own)
    return places


class FittingProblem:
    """Recordings of one kind and their noise, to which hypotheses are fitted: all rows, and a mean a recording."""

    def __init__(self, lines: Lines, table: SigmaTable) -> None:
        """Collapse, and work out how σ bends; curves are not collapsed and have no place."""
        self.lines = lines
        self.kind = kind = lines.kind
        self.table = table
        self.collapsed = lines.collapsed() if kind == "frf" else lines
        none = np.zeros(lines.recordings)
        self.curvature = curvature(self.collapsed, table) if kind == "frf" else Curvature(none, none)

    def hypothesis(self, names: Sequence[str], placed: bool, *, whole: bool = False) -> Hypothesis:
        """The set's model on the lines that it needs; raises Unsupported."""
        lines = self.lines if whole or any(CATALOGUE[name].needs_lines for name in names) else self.collapsed
        return Hypothesis(compose(names, lines.campaign, self.table, self.kind), lines, self.curvature, placed)

    def explain(self, names: Sequence[str], parent: Explanation | None = None) -> Explanation | None:
        """The set's explanation; from a parent's, which has one mechanism less, where one is given.

        None where the log posterior density gains less than `_LEAST_GAIN` over the parent: the added mechanism does
        not show. Its evidence is a Laplace approximation, until it is `integrated`. Raises Unsupported.
        """
        plain = self.hypothesis(names, False)
        fitters = [Fitter(plain), Fitter(replace(plain, placed=True))]
        weights = np.log([NO_POSITION_SCATTER, 1 - NO_POSITION_SCATTER])
        fits: list[tuple[float, Evidence]] = []
        starts: list[Evaluated] = []
        if parent is None or parent.placed < _DECIDED:
            starts = [fitters[0].improve(at.point) for at in self._starts(fitters[0], names, parent)]
            best = min(starts, key=lambda entry: entry.cost)
            if not self._gains(best, parent, 0):
                return None
            if parent is None and not self._position_matters(best):
                weights[0] = 0.0
            fits.append((weights[0], around(fitters[0], best)))
        if (parent is None and weights[0] < 0) or (parent is not None and parent.placed > 1 - _DECIDED):
            beside = starts or self._starts(fitters[1], names, parent)
            best = min((fitters[1].improve(_placed_start(fitters[1], at)) for at in beside), key=lambda at: at.cost)
            if not self._gains(best, parent, 1):
                return None
            fits.append((weights[1], around(fitters[1], best)))
        return Explanation.of(names, fits)

    def refit(self, explanation: Explanation) -> Explanation | None:
        """A set that was fitted to more recordings, fitted to these, from where it stood; by the Laplace approximation.

        None where the set has other parameters here. Raises Unsupported.
        """
        placed = explanation.best.fitter.hypothesis.placed
        fitter = Fitter(self.hypothesis(explanation.names, placed))
        if [entry.name for entry in fitter.parameters] != [entry.name for entry in explanation.model.parameters]:
            return None
        best = around(fitter, fitter.improve(replace(explanation.point, bend=fitter.no_bend)))
        return Explanation.of(explanation.names, [(0.0, best)])

    @staticmethod
    def _gains(at: Evaluated, parent: Explanation | None, placed: int) -> bool:
        if parent is None or int(parent.placed > 0.5) != placed:
            return True
        return at.cost < parent.best.at.cost - _LEAST_GAIN

    def _position_matters(self, at: Evaluated) -> bool:
        slopes = at.prediction.position_slopes
        if slopes is None:
            return False
        p = POSITION_RANGE[1]
        size = np.abs(at.prediction.value) ** 2 + 1e-300
        first = (np.abs(slopes) ** 2).sum(axis=0) / size
        second = self.curvature.square[at_recording(self, at)]
        effect = p**2 * first + 0.5 * p**4 * second
        return bool(effect.max() > _LEAST_SCATTER**2)

    def _starts(self, fitter: Fitter, names: Sequence[str], parent: Explanation | None) -> list[Evaluated]:
        """The best of the local minima of a grid over the new mechanisms' prior quantiles."""
        lines = fitter.hypothesis.lines
        places = own_places(names, lines)
        own = np.zeros(max((place.stop for place in places.values()), default=0))
        free: list[int] = []
        axes: list[list[float]] = []
        known = {} if parent is None else {name: parent.own(name) for name in parent.names}
        # New too is what has other parameters beside the mechanism that was added.
        new = [name for name, place in places.items() if len(known.get(name, ())) != place.stop - place.start]
        parameters = {name: fitter.parameters[places[name]] for name in new}
        quantiles = _QUANTILES.get(sum(map(len, parameters.values())), (0.5,))
        for name, place in places.items():
            if name in new:
                free += range(place.start, place.stop)
                axes += [[entry.quantile(q) for q in quantiles] for entry in parameters[name]]
            else:
                own[place] = known.get(name, [])
        tried: dict[tuple[int, ...], Evaluated] = {}
        for index in itertools.product(*(range(len(axis)) for axis in axes)):
            own[free] = [axis[at] for axis, at in zip(axes, index, strict=True)]
            tried[index] = fitter.settle(fitter.begin(own, parent.point if parent else None), 1)
        lowest = [index for index in tried if _is_lowest(index, tried)]
        return sorted((tried[index] for index in lowest), key=lambda entry: entry.cost)[:_KEPT_STARTS]


def _is_lowest(index: tuple[int, ...], tried: dict[tuple[int, ...], Evaluated]) -> bool:
    """Whether no neighbour on the grid is lower."""
    around = (tuple(np.add(index, step)) for step in itertools.product((-1, 0, 1), repeat=len(index)))
    return all(tried[index].cost <= tried[other].cost for other in around if other in tried)


def at_recording(problem: FittingProblem, at: Evaluated) -> np.ndarray:
    """The recording of each row of an evaluated prediction."""
    return (
        problem.lines.recording if len(at.prediction.value) == len(problem.lines.value) else problem.collapsed.recording
    )


def _placed_start(fitter: Fitter, at: Evaluated) -> FitPoint:
    """The best of a few scales of positioning scatter, d33 following each."""
    if fitter.holds(at.point):
        return at.point
    gain, level, *own = at.point.covariance
    # Where positioning scatter is large, what was fitted without it may be far off: also from d33 afresh
    fresh = fitter.begin(at.point.fit[: len(at.point.fit) - fitter.nuisances])
    tried = []
    for begin, position in itertools.product((at, fresh), _POSITION_STARTS):
        covariance = np.array([min(gain, GAIN_PRIOR.middle), level, np.log(position), *own])
        tried.append(fitter.rescaled(begin, covariance))
    return min(tried, key=lambda entry: entry.cost).point
