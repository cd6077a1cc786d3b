"""Where a fit begins: a grid over what is new in a set of mechanisms, and what the recordings suggest of it."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import minimum_filter

from underskin.diagnosis.inference.curve_starts import softer, with_contact_points
from underskin.diagnosis.inference.hypothesis import FitPoint, Hypothesis, own_places
from underskin.diagnosis.inference.optimizer import Evaluated, Fitter
from underskin.diagnosis.inference.points import Points, together
from underskin.mechanisms.parameter import Parameter
from underskin.units import Floats, Indices, Mask

_QUANTILES = {1: (0.03, 0.15, 0.3, 0.5, 0.7, 0.85, 0.97), 2: (0.1, 0.3, 0.5, 0.7, 0.9), 3: (0.2, 0.5, 0.8)}
_KEPT_STARTS = 3
_SETTLING, _SETTLING_ALONE = 1, 10  # steps of the noise levels from each start, and of a mechanism that acts on them
_KEPT_OF_PARENT = 1  # of curves, from an explanation with one mechanism less
_PLACED_STARTS = 4  # of curves, whose contact points are looked for


@dataclass(frozen=True)
class Beginning:
    """Where the fit of a hypothesis may begin.

    `parent`: fit coordinates of its mechanisms that were fitted without the others; None where none were. `begin`:
    where the nuisances begin; None for their priors' centres. `alone`: those of the others where these were fitted
    alone, another guess.
    """

    parent: Mapping[str, Sequence[float]] | None
    begin: FitPoint | None
    alone: Mapping[str, Sequence[float]]


def best_starts(fitter: Fitter, beginnings: Sequence[Beginning]) -> list[Points]:
    """Of each hypothesis the best of the local minima of a grid over the new mechanisms' prior quantiles, and of what
    recordings suggest."""
    grids = [_Grid(*pair) for pair in zip(fitter.hypotheses, beginnings, strict=True)]
    begun = fitter.begin([grid.own for grid in grids], [entry.begin for entry in beginnings])
    settles = fitter.own.size and all(entry.parent is None for entry in beginnings)
    tried = fitter.settle(begun, _SETTLING_ALONE if settles else _SETTLING)
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

    def __init__(self, hypothesis: Hypothesis, beginning: Beginning) -> None:
        places = own_places(hypothesis.model.names, hypothesis.lines)
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
        self.own = np.zeros((len(points), hypothesis.own_parameters))
        for name, values in known.items():
            if name not in self.new:
                self.own[:, places[name]] = values
        self.own[:, free] = points


def _of_curves(fitter: Fitter, lowest: Evaluated, guessed: int, new: Sequence[str], beginning: Beginning) -> Points:
    """The best starts of curves, contact points looked for where none are known; the last so many are guesses."""
    count = len(lowest) - guessed
    ranked = _cheapest(lowest[:count])[:_PLACED_STARTS]
    several = lowest[np.append(np.sort(ranked), np.arange(count, len(lowest)))]
    alone = len(fitter.hypotheses[0].model.names) == 1
    sticks = alone and any(fitter.lines.mechanisms[name].moves_contact_points for name in new)
    if fitter.lines.kind == "indentation" and (sticks or beginning.begin is None):
        several = with_contact_points(fitter, softer(fitter, several) if sticks else several)
    guesses = any(fitter.lines.mechanisms[name].begins_at_guesses for name in new)
    kept = _KEPT_OF_PARENT if beginning.parent is not None and not guesses else _KEPT_STARTS
    chosen = several.points[np.sort(_cheapest(several)[:kept])]
    if new and beginning.parent is not None and beginning.begin is not None:
        chosen = together(chosen, _without_effect(fitter, new, beginning.parent, beginning.begin))
    if not (sticks and guessed):
        return chosen
    # What the null hypothesis made of modulus and contact points may lead away from where the jumps are.
    own = fitter.hypotheses[0].own_parameters
    begun = fitter.begin([lowest.points.fit[count:, :own]], [None])
    return together(chosen, begun.points[_cheapest(begun)[:1]])


def _without_effect(
    fitter: Fitter, new: Sequence[str], parent: Mapping[str, Sequence[float]], begin: FitPoint
) -> Points:
    """Where a set's fit stands, with the mechanisms that were added to it as near as may be to no effect."""
    (hypothesis,) = fitter.hypotheses
    own = np.zeros((1, hypothesis.own_parameters))
    for name, place in own_places(hypothesis.model.names, hypothesis.lines).items():
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
