"""Least squares of several parts that share parameters, and Fisher's information of one of them.

Each part gives whitened residuals r(θ) of what it expects; parameters have Gaussian priors, wide ones where none is
given, which only keep what nothing determines finite:
    χ²(θ) = Σ |r(θ)|² + Σ ((θ − mean)/sd)²,  information = JᵀJ, J the derivative of all residuals.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.optimize import least_squares

from rig.errors import RigError
from rig.layer import Floats

_STEP = 1e-4
_TOLERANCE = 1e-4  # of χ²
_EVALUATIONS = 40
_SMALL = 0.1  # χ² that needs no second fit
_HELD = 1e-4
_ASTRAY = 1e6  # residuals outside the rig's solutions: such a step is rejected


class Part(Protocol):
    """A part of a joint fit that shares parameters with others."""

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of its parameters."""

    @property
    def count(self) -> int:
        """Number of its residuals."""

    def residuals(self, values: Mapping[str, float]) -> Floats:
        """Whitened residuals (residuals,) at the parameters; RigError beyond what the rig has solved."""


@dataclass(frozen=True)
class Prior:
    """Mean and standard deviation of a parameter; by default so wide that it is free."""

    mean: float = 0.0
    sd: float = 3.0


def least_chi2(parts: Sequence[Part], priors: Mapping[str, Prior], at_first: Sequence[str] = ()) -> float:
    """The least χ², from the priors' means; infinite if the parts cannot be calculated there.

    A first fit holds the parameters `at_first`, which keeps the second from distant minima.
    """
    problem = _Problem(parts, priors)
    start = problem.mean
    if not np.all(np.abs(problem.residuals(start)) < _ASTRAY):
        return np.inf
    held = {name: Prior(problem.mean[problem.names.index(name)], _HELD) for name in at_first}
    reached, nearby = _descend(_Problem(parts, {**priors, **held}), start)
    return reached if reached < _SMALL else _descend(problem, nearby)[0]


def _descend(problem: "_Problem", start: Floats) -> tuple[float, Floats]:
    fitted = least_squares(
        problem.residuals, start, problem.jacobian, method="lm", ftol=_TOLERANCE, max_nfev=_EVALUATIONS
    )
    return float(2 * fitted.cost), np.asarray(fitted.x)


def deviation(parts: Sequence[Part], priors: Mapping[str, Prior], name: str) -> float:
    """Standard deviation of a parameter by the information where all of them are 0, which is the truth."""
    return float(np.sqrt(covariance(parts, priors, (name,))[0, 0]))


def covariance(parts: Sequence[Part], priors: Mapping[str, Prior], names: Sequence[str]) -> Floats:
    """Covariance of parameters (names, names) by the information where all of them are 0, which is the truth."""
    problem = _Problem(parts, priors)
    here = np.zeros(len(problem.names))
    ahead, behind = problem.jacobian(here, _STEP), problem.jacobian(here, -_STEP)
    derivative = np.where(np.abs(ahead) < np.abs(behind), ahead, behind)  # the other may step over a jump of a curve
    places = [problem.names.index(name) for name in names]
    return np.asarray(np.linalg.inv(derivative.T @ derivative)[np.ix_(places, places)])


class _Problem:
    def __init__(self, parts: Sequence[Part], priors: Mapping[str, Prior]) -> None:
        self.parts = parts
        self.names = sorted({name for part in parts for name in part.parameters})
        chosen = [priors.get(name, Prior()) for name in self.names]
        self.mean, self.sd = np.array([prior.mean for prior in chosen]), np.array([prior.sd for prior in chosen])

    def residuals(self, point: Floats) -> Floats:
        """Of all parts, and of the priors."""
        values = dict(zip(self.names, point.tolist(), strict=True))
        return np.concatenate([*(_reached(part, values) for part in self.parts), (point - self.mean) / self.sd])

    def jacobian(self, point: Floats, step: float = _STEP) -> Floats:
        """Derivative of `residuals` (residuals, parameters)."""
        values, blocks = dict(zip(self.names, point.tolist(), strict=True)), []
        for part in self.parts:
            here = _reached(part, values)
            block = np.zeros((len(here), len(self.names)))
            for name in part.parameters:
                stepped = _reached(part, values | {name: values[name] + step})
                block[:, self.names.index(name)] = (stepped - here) / step
            blocks.append(block)
        return np.concatenate([*blocks, np.diag(1 / self.sd)])


def _reached(part: Part, values: Mapping[str, float]) -> Floats:
    """Residuals of a part, very large if it cannot be calculated."""
    with np.errstate(all="ignore"):
        try:
            result = part.residuals(values)
        except RigError:
            return np.full(part.count, _ASTRAY)
    return np.nan_to_num(np.clip(result, -_ASTRAY, _ASTRAY), nan=_ASTRAY)
