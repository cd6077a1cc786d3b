"""Measured against the base model: each recording's gain residual, each line's residual, and how uncertain they are.

The residual of a recording is what it lies above its model, relative; that of a line is what it lies above its own
recording's best real multiple of the model: a recording's lines share one gain error, so their mean and their shape are
kept apart.
"""

from dataclasses import dataclass

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.units import Array, Floats


@dataclass(frozen=True)
class Residuals:
    """Against one explanation's most probable parameters."""

    gain: Floats  # (recordings,) relative
    gain_deviation: Floats  # (recordings,) expected sd: gain scatter, positioning and lines
    line: Array  # (rows,) complex, relative
    line_weight: Floats  # (rows,) 1/variance of real and of imaginary part


def whole_prediction(problem: FittingProblem, explanation: Explanation) -> Array:
    """The explanation's prediction on all lines."""
    value: Array = explanation.best.prediction.value
    return value if len(value) == len(problem.lines.value) else value[problem.lines.recording]


def line_residuals(problem: FittingProblem, explanation: Explanation) -> tuple[Array, Floats]:
    """Each line over its recording's own best real multiple of the model, less 1, and its weight 1/variance.

    The variance is that before the noise's level; mains pick-up adds to it.
    """
    lines, prediction, best = problem.lines, whole_prediction(problem, explanation), explanation.best
    first = lines.first
    further = 0.0 if best.prediction.pickup_rows is None else best.pickup_variance / best.levels.level**2
    precision = 1 / (lines.deviation**2 + further)
    along = np.add.reduceat(precision * (prediction.conj() * lines.value).real, first)
    size = np.add.reduceat(precision * np.abs(prediction) ** 2, first)
    fitted = prediction * (along / size)[lines.recording]
    safe = np.where(np.abs(fitted) > 0, fitted, 1.0)
    return (lines.value - fitted) / safe, precision * np.abs(fitted) ** 2


def residuals(problem: FittingProblem, explanation: Explanation, gain: float, position: float) -> Residuals:
    """The residuals, with the scatters that are expected of them: `gain` (relative) and `position` [m]."""
    lines = problem.lines
    prediction = whole_prediction(problem, explanation)
    precision = lines.deviation**-2
    size = np.add.reduceat(precision * np.abs(prediction) ** 2, lines.first)
    along = np.add.reduceat(precision * (prediction.conj() * lines.value).real, lines.first)
    relative = explanation.best.relative_place_slopes
    placed = position**2 * (relative**2).sum(axis=0) + 0.5 * position**4 * problem.curvature.square
    line, weight = line_residuals(problem, explanation)
    return Residuals(along / size - 1, np.sqrt(gain**2 + placed + 1 / size), line, weight)
