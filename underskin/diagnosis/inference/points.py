"""Points of several hypotheses, one after another, and what was worked out there."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from underskin.diagnosis.inference.products import Products
from underskin.units import Floats, Indices, Mask


@dataclass(frozen=True)
class Points:
    """Where fits stand: coordinates of the models (points, parameters), of the covariance, and the sensors' log gains.

    `owner` says which hypothesis each point is of, in rising order; models with fewer parameters than others have
    zeros behind their own.
    """

    owner: Indices
    fit: Floats
    covariance: Floats
    bend: Floats

    def __len__(self) -> int:
        return len(self.owner)

    def __getitem__(self, points: Indices | Mask | slice) -> "Points":
        return Points(self.owner[points], self.fit[points], self.covariance[points], self.bend[points])


def together(one: Points, other: Points) -> Points:
    """The points of both, which are of one hypothesis."""
    names = "owner", "fit", "covariance", "bend"
    return Points(*(np.concatenate([getattr(one, name), getattr(other, name)]) for name in names))


def alone(points: Points, owner: int, count: int) -> Points:
    """The points of one of several hypotheses, which has so many parameters, as those of it alone."""
    own = points[points.owner == owner]
    return Points(np.zeros_like(own.owner), own.fit[:, :count], own.covariance, own.bend)


def stacked(points: Sequence[Points]) -> Points:
    """Points of several hypotheses, of the first, the second and so on, in this order."""
    owner = np.repeat(np.arange(len(points)), [len(entry) for entry in points])
    fit = np.zeros((len(owner), max(entry.fit.shape[1] for entry in points)))
    for number, entry in enumerate(points):
        fit[owner == number, : entry.fit.shape[1]] = entry.fit
    covariance, bend = (np.concatenate([getattr(entry, name) for entry in points]) for name in ("covariance", "bend"))
    return Points(owner, fit, covariance, bend)


@dataclass(frozen=True)
class Evaluated:
    """Points with what was worked out there; `cost` is minus the log posterior density (up to what all share).

    `growth` ∂ log |t|²/∂θ of the position's slopes (points, recordings, parameters): not finite where a fit has not
    needed it yet.
    """

    points: Points
    products: Products
    cost: Floats
    growth: Floats | None = None

    def __len__(self) -> int:
        return len(self.points)

    def some(self, points: Indices) -> "Evaluated":
        """At some of the points, in their order: itself where that is all of them."""
        return self if len(points) == len(self) else self[points]

    def __getitem__(self, points: Indices | Mask | slice) -> "Evaluated":
        if isinstance(points, np.ndarray) and points.dtype == bool and points.all():
            return self
        growth = None if self.growth is None else self.growth[points]
        return Evaluated(self.points[points], self.products[points], self.cost[points], growth)

    def best(self) -> Indices:
        """The point of least cost of each hypothesis that has one."""
        order = np.lexsort((self.cost, self.points.owner))
        owner = self.points.owner[order]
        return order[np.append(True, owner[1:] != owner[:-1])] if len(order) else order
