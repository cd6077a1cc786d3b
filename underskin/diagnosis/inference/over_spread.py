"""A parameter's posterior over all values of the sensors' spread, which two sensors leave open by a factor.

At its most probable value the spread is too small: that is where the sensors that were recorded differ least from their
mean. At each of a grid of values the mean parameters are normal, at most a Newton step away.
"""

from dataclasses import replace

import numpy as np

from underskin.diagnosis.inference.laplace import Evidence, around_mean
from underskin.diagnosis.inference.unseen import Normals

_PLACES = 24


def over_spread(evidence: Evidence, place: int) -> Normals | None:
    """The parameter at a place among the model's; None where the hypothesis has no free spread.

    The shares sum to 1.
    """
    hypothesis, fitter, at = evidence.hypothesis, evidence.fitter, evidence.at
    spreads = [entry for entry in hypothesis.model.parameters if entry.acts_on == "gain_spread"]
    if not spreads:
        return None
    column = [entry.name for entry in hypothesis.covariance].index(spreads[0].name)
    low, high = spreads[0].bounds
    covariance = np.tile(at.points.covariance, (_PLACES, 1))
    covariance[:, column] = low + (high - low) * (np.arange(_PLACES) + 0.5) / _PLACES
    several = at[np.zeros(_PLACES, dtype=np.intp)]
    moved = fitter.weighed(fitter.with_covariance(several.points, covariance), several.products)
    moved = replace(moved, growth=several.growth)
    values, covariances = around_mean(fitter, moved)
    information, gradient = fitter.posterior_equations(moved)
    step = np.linalg.solve(information, gradient[..., None])[:, place, 0]
    index = hypothesis.mean_places.index(place)
    deviation = np.sqrt([covariance[index, index] for covariance in covariances])
    share = np.exp(values - values.max())
    return Normals(share / share.sum(), moved.points.fit[:, place] + step, deviation)
