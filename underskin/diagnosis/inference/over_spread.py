"""A parameter's posterior over all values of the sensors' spread, which two sensors leave open by a factor.

At its most probable value the spread is too small: that is where the sensors that were recorded differ least from their
mean. At each of a grid of values the mean parameters are normal, at most a Newton step away.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from underskin.diagnosis.inference.laplace import around_mean
from underskin.diagnosis.inference.optimizer import Evaluated, Fitter
from underskin.units import Floats

_PLACES = 24


@dataclass(frozen=True)
class Normals:
    """A mixture of normal distributions of one fit coordinate; `share` (normals,) need not sum to 1."""

    share: Floats
    mean: Floats
    deviation: Floats

    def times(self, factor: float) -> "Normals":
        """With every share so many times as large."""
        return Normals(factor * self.share, self.mean, self.deviation)

    def moved(self, by: float) -> "Normals":
        """With every mean so much larger."""
        return Normals(self.share, self.mean + by, self.deviation)


def together(several: Sequence[Normals]) -> Normals:
    """All normals of several mixtures."""
    return Normals(
        *(np.concatenate([getattr(one, name) for one in several]) for name in ("share", "mean", "deviation"))
    )


def over_spread(fitter: Fitter, at: Evaluated, place: int) -> list[Normals] | None:
    """The parameter at a place among the model's, around each of several points of one hypothesis; None where that has
    no free spread.

    The shares of each sum to 1.
    """
    hypothesis = fitter.hypotheses[0]
    spreads = [entry for entry in hypothesis.model.parameters if entry.acts_on == "gain_spread"]
    if not spreads:
        return None
    column = [entry.name for entry in hypothesis.covariance].index(spreads[0].name)
    low, high = spreads[0].bounds
    several = at[np.repeat(np.arange(len(at)), _PLACES)]
    covariance = several.points.covariance.copy()
    covariance[:, column] = np.tile(low + (high - low) * (np.arange(_PLACES) + 0.5) / _PLACES, len(at))
    moved = fitter.weighed(fitter.with_covariance(several.points, covariance), several.products)
    moved = replace(moved, growth=several.growth)
    values, covariances = around_mean(fitter, moved)
    free = np.flatnonzero(fitter.free[0])
    index = int(np.searchsorted(free, place))
    information, gradient = fitter.posterior_equations(moved)
    step = np.linalg.solve(information[:, free[:, None], free], gradient[:, free, None])[:, index, 0]
    mean = moved.points.fit[:, place] + step
    deviation = np.sqrt([covariance[index, index] for covariance in covariances])
    return [
        Normals(_shares(values[own]), mean[own], deviation[own])
        for own in (slice(first, first + _PLACES) for first in range(0, len(values), _PLACES))
    ]


def _shares(values: Floats) -> Floats:
    share = np.exp(values - values.max())
    return np.asarray(share / share.sum())
