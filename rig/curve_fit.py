"""Weighted least squares of a law on curves that share one modulus, by Levenberg's and Marquardt's method.

Curve i is predicted as  (1 + s g_i) F(E, z_i) + Σ c_ij C_ij,  with a zero of displacement z_i, a gain g_i in units of
its scatter s (prior of unit variance) and amounts c_ij of its columns; ln E has a prior where one is given.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from rig.layer import Floats

_ROUNDS = 40
_ENOUGH = 3e-4  # of χ², absolute and relative
_DAMPING = 1e-3
_MOST_DAMPING = 1e4
_FARTHEST = 20.0  # of ln E from its start: beyond it a body has no stiffness that numbers hold
_STEP = 1e-5  # of ln E

Law = Callable[[int, float, float], Floats]  # force of a curve at ln E and a zero of displacement


@dataclass(frozen=True)
class Curve:
    """Force and its noise (samples,), and columns (linear parameters, samples)."""

    force: Floats
    deviation: Floats
    columns: Floats


@dataclass(frozen=True)
class Priors:
    """Mean and deviation of ln E, infinite where it is free, and the scatter of the gains."""

    log_modulus: float = 0.0
    modulus_deviation: float = np.inf
    gain: float = 0.0


def least_chi2(
    law: Law, curves: Sequence[Curve], priors: Priors, zero: float, zero_step: float
) -> tuple[float, list[Floats]]:
    """The least χ², priors included, and the prediction of each curve there; infinite from where the law has none.

    Parameters
    ----------
    law : callable
        Force (samples,) of a curve by its number, ln E and zero of displacement.
    curves : sequence of Curve
    priors : Priors
    zero : float
        Start of the zeros; ln E starts at its mean.
    zero_step : float
        Step for the derivatives by the zeros, in units of displacement.
    """
    fit = _Fit(law, curves, priors, zero_step)
    point = np.zeros(1 + len(curves) * fit.per_curve)
    point[0] = priors.log_modulus
    point[1 :: fit.per_curve] = zero
    chi2, damping = fit.chi2(point), _DAMPING
    if not np.isfinite(chi2):
        return np.inf, fit.predictions(point)
    matrix, right = fit.normal_equations(point)
    for _ in range(_ROUNDS):
        scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
        scaled = matrix / np.outer(scale, scale) + damping * np.eye(len(point))
        trial = point + np.linalg.lstsq(scaled, right / scale, rcond=None)[0] / scale
        reached = fit.chi2(trial)
        if reached < chi2:
            small = chi2 - reached < _ENOUGH * (1 + reached)
            point, chi2, damping = trial, reached, max(damping / 10, 1e-12)
            if small:
                break
            matrix, right = fit.normal_equations(point)
        else:
            damping *= 10
            if damping > _MOST_DAMPING:
                break
    return chi2, fit.predictions(point)


class _Fit:
    def __init__(self, law: Law, curves: Sequence[Curve], priors: Priors, zero_step: float) -> None:
        self.law, self.curves, self.priors, self.zero_step = law, curves, priors, zero_step
        self.per_curve = 2 + len(curves[0].columns)  # parameters of a curve: zero, gain, amounts of its columns

    def _of(self, point: Floats, number: int) -> tuple[float, float, Floats]:
        of_curve = point[1 + number * self.per_curve : 1 + (number + 1) * self.per_curve]
        return float(of_curve[0]), 1 + self.priors.gain * float(of_curve[1]), of_curve[2:]

    def predictions(self, point: Floats) -> list[Floats]:
        """The prediction of each curve."""
        result = []
        for number, curve in enumerate(self.curves):
            zero, gain, amounts = self._of(point, number)
            result.append(gain * self.law(number, float(point[0]), zero) + amounts @ curve.columns)
        return result

    def chi2(self, point: Floats) -> float:
        """χ² with the priors; infinite or NaN for a step that went far astray, which is then rejected."""
        if abs(point[0] - self.priors.log_modulus) > _FARTHEST:
            return np.inf
        with np.errstate(over="ignore", invalid="ignore"):
            pairs = zip(self.predictions(point), self.curves, strict=True)
            total = sum(float(np.sum(((curve.force - force) / curve.deviation) ** 2)) for force, curve in pairs)
        off = (point[0] - self.priors.log_modulus) / self.priors.modulus_deviation
        return total + float(off**2 + np.sum(point[2 :: self.per_curve] ** 2))

    def normal_equations(self, point: Floats) -> tuple[Floats, Floats]:
        """Half the Hessian of χ², and minus half its gradient."""
        matrix, right = np.zeros((len(point), len(point))), np.zeros(len(point))
        for number, (curve, predicted) in enumerate(zip(self.curves, self.predictions(point), strict=True)):
            zero, gain, _ = self._of(point, number)
            here = self.law(number, float(point[0]), zero)
            by_modulus = (self.law(number, float(point[0]) + _STEP, zero) - here) / _STEP
            by_zero = (self.law(number, float(point[0]), zero + self.zero_step) - here) / self.zero_step
            rows = np.stack([gain * by_modulus, gain * by_zero, self.priors.gain * here, *curve.columns])
            rows = rows / curve.deviation
            at = [0, *range(1 + number * self.per_curve, 1 + (number + 1) * self.per_curve)]
            matrix[np.ix_(at, at)] += rows @ rows.T
            right[at] += rows @ ((curve.force - predicted) / curve.deviation)
        gains = np.arange(2, len(point), self.per_curve)
        matrix[gains, gains] += 1
        right[gains] -= point[gains]
        weight = self.priors.modulus_deviation**-2
        matrix[0, 0] += weight
        right[0] -= weight * (point[0] - self.priors.log_modulus)
        return matrix, right
