"""What other recordings say of a model's parameters: Laplace's approximation of their likelihood, a quadratic."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from underskin.diagnosis.inference.points import Points
from underskin.units import Floats


@dataclass(frozen=True, eq=False)
class Knowledge:
    """ln L(x) = height + linear·x − ½ xᵀ precision x, in a model's fit coordinates x (parameters,)."""

    precision: Floats  # (parameters, parameters)
    linear: Floats  # (parameters,)
    height: float

    @classmethod
    def of(cls, matrix: Floats, offset: Floats, mean: Floats, precision: Floats, height: float) -> Self:
        """From a normal likelihood of quantities q = matrix x + offset: height − ½ (q − mean)ᵀ precision (q − mean)."""
        away = offset - mean
        return cls(
            matrix.T @ precision @ matrix, -matrix.T @ precision @ away, float(height - 0.5 * away @ precision @ away)
        )

    def __add__(self, other: "Knowledge") -> "Knowledge":
        return Knowledge(self.precision + other.precision, self.linear + other.linear, self.height + other.height)

    def log_density(self, fit: Floats) -> float:
        """ln L at one point (parameters,)."""
        return float(self.height + self.linear @ fit - 0.5 * fit @ self.precision @ fit)


class KnowledgeOfSeveral:
    """That of several hypotheses, whose parameters are padded to equally many."""

    def __init__(self, each: Sequence[Knowledge | None], most: int) -> None:
        """None where nothing is known beside the recordings themselves."""
        self._precision, self._linear = np.zeros((len(each), most, most)), np.zeros((len(each), most))
        self._height = np.zeros(len(each))
        for number, one in enumerate(each):
            if one is not None:
                count = len(one.linear)
                self._precision[number, :count, :count] = one.precision
                self._linear[number, :count], self._height[number] = one.linear, one.height

    def log_densities(self, points: Points) -> Floats:
        """ln L at points (points,)."""
        owner, fit = points.owner, points.fit
        bent = np.einsum("np,npq,nq->n", fit, self._precision[owner], fit)
        return np.asarray(self._height[owner] + (self._linear[owner] * fit).sum(axis=1) - 0.5 * bent)

    def equations(self, points: Points) -> tuple[Floats, Floats]:
        """Information (points, parameters, parameters) and gradient (points, parameters) of ln L."""
        precision = self._precision[points.owner]
        return precision, self._linear[points.owner] - np.einsum("npq,nq->np", precision, points.fit)
