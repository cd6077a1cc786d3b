"""What a parameter would be if one more mechanism were there that the recordings hardly tell from it.

A glue line that slips by the same share under every sphere only changes d33: it does not show, and a fit without it is
as good. At places spread evenly over such a mechanism's prior all else is fitted again, the noise levels as well; each
counts by the evidence that it leaves. Where the sensors' spread is free, the parameter is averaged over it at each.
"""

import numpy as np
from scipy.stats import qmc

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.hypothesis import own_places
from underskin.diagnosis.inference.laplace import around_levels, around_mean
from underskin.diagnosis.inference.optimizer import Evaluated, Fitter
from underskin.diagnosis.inference.over_spread import Normals, over_spread, together
from underskin.diagnosis.inference.points import Points
from underskin.errors import InvalidInput
from underskin.mechanisms.base import Unsupported
from underskin.units import Floats

_PLACES = {0: 1, 1: 12, 2: 24}  # for so many parameters
_MOST_PLACES = 48
_MOST = 600.0  # nats that shares tell: e to the power of 710 is more than a float holds
_COUNTS = 6.0  # nats behind the fit without the mechanism within which a place counts


def beside(problem: FittingProblem, explanation: Explanation, name: str, parameter: str) -> Normals | None:
    """A parameter of the model with one more mechanism, each share relative to the explanation without it, e^600 at
    most.

    None where the recordings do not support the mechanism, or it moves no prediction.
    """
    best, known = explanation.best, problem.lines.mechanisms
    names = tuple(entry for entry in known if entry in {*explanation.names, name})
    if not known[name].moves_predictions:
        return None
    try:
        hypothesis = problem.hypothesis(names, best.hypothesis.placed)
    except (Unsupported, InvalidInput):
        return None
    places = own_places(names, hypothesis.lines)
    new = range(places[name].start, places[name].stop)
    if any(len(explanation.own(one)) != places[one].stop - places[one].start for one in explanation.names):
        return None  # beside it another mechanism has other parameters
    entries = [hypothesis.model.parameters[place] for place in new]
    levels = _evenly(len(entries))
    fit = np.zeros((len(levels), len(hypothesis.model.parameters)))
    fit[:, hypothesis.own_parameters :] = best.point.fit[best.hypothesis.own_parameters :]
    for one in explanation.names:
        fit[:, places[one]] = explanation.own(one)
    for column, entry in zip(new, entries, strict=True):
        fit[:, column] = [entry.quantile(level) for level in levels[:, column - new.start].tolist()]
    held = Fitter([hypothesis], held=[new])
    at = _fitted(held, fit, explanation)
    if not len(at):
        return None
    values, covariances = around_mean(held, at)
    whole = values + around_levels(held, at)
    without = around_mean(best.fitter, best.at)[0] + around_levels(best.fitter, best.at)
    gained = whole - without
    shares = np.exp(np.minimum(gained, gained - gained.max() + _MOST)) / len(fit)
    place = [entry.name for entry in hypothesis.model.parameters].index(parameter)
    spread = over_spread(held, at, place)
    if spread is not None:
        return together([normals.times(share) for normals, share in zip(spread, shares.tolist(), strict=True)])
    index = int(np.searchsorted(np.flatnonzero(held.free[0]), place))
    deviation = np.sqrt([covariance[index, index] for covariance in covariances])
    return Normals(shares, at.points.fit[:, place], deviation)


def _evenly(parameters: int) -> Floats:
    """Probabilities between 0 and 1, spread evenly over so many parameters (places, parameters)."""
    count = _PLACES.get(parameters, _MOST_PLACES)
    places = (np.arange(count) + 0.5) / count
    if parameters < 2:
        return np.asarray(places[:, None][:, :parameters])
    others = qmc.Halton(parameters - 1, scramble=False).random(count + 1)[1:]
    return np.column_stack([places, others])


def _fitted(held: Fitter, fit: Floats, explanation: Explanation) -> Evaluated:
    """The places that count, with all that is not held fitted."""
    point, cost = explanation.point, explanation.best.cost
    covariance, bend = (np.tile(values, (len(fit), 1)) for values in (point.covariance, point.bend))
    begun = held.evaluate(Points(np.zeros(len(fit), dtype=np.intp), fit, covariance, bend))
    fitted = held.descend(begun, 1, lambda at: np.full(len(at), cost + _COUNTS))
    return fitted[np.flatnonzero(fitted.cost < cost + _COUNTS)]
