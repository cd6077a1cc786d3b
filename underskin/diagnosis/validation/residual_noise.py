"""Whether what an explanation leaves is noise: the check of the residual that decides between named and unexplained."""

from collections.abc import Sequence

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.selection.curve_sets import left_smooth
from underskin.diagnosis.validation.cross_validation import HeldOut, in_sample, total
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.mechanisms.unnamed.laws import in_plain_words

_ABOVE_NOISE, _LEAST_REMAINDER = 2.0, 3e-3  # times the noise, and of the largest force
NOISY = 2.0  # times what the lines' own roughness says
_GRANTED = 4.0  # times as much remainder of a compression as the null hypothesis is allowed
_GRANTED_TO_LAWS = 0.05  # of what least squares leave under the null hypothesis of an indentation
_STRUCTURED = 2.0**0.5  # times the noise: what is added is as large
_LEAST_STRUCTURE = 5e-4  # of the largest force
_SLOW = 3.0  # times the slow noise that the air shows
_PLAIN_STRUCTURE = 40.0  # nats of a smooth error; a law that is right leaves 5 to 20, very seldom more than 30
_LEAST_LEVEL = 0.6  # of the noise that samples show: below, how few of them bend, or steps of a converter, made that
REACHES_NOISE = 1.5  # times the noise floor: an error that noise explains


def above_noise(problem: FittingProblem, explanation: Explanation, groups: Sequence[HeldOut]) -> list[Finding]:
    """Of curves: a residual above the noise, and held-out parts that are predicted no better than by the base model."""
    if problem.lines.smooth is None:
        return []
    findings = []
    smooth, noise = _smooth_part(problem, explanation)
    if _is_above_noise(smooth, noise):
        findings.append(Finding(Reason.REMAINDER, "", "force_n", {"percent": 100 * smooth, "times": smooth / noise}))
    before, after = total(groups)
    if explanation.names and after.recordings and after.rmse_percent >= before.rmse_percent:
        arguments = {
            "groups": [entry.group for entry in groups],
            "mechanisms": [in_plain_words(problem.lines.mechanisms[name]) for name in explanation.names],
            "before_percent": before.rmse_percent,
            "after_percent": after.rmse_percent,
        }
        findings.append(Finding(Reason.HELD_OUT_NO_BETTER, "", "force_n", arguments))
    return findings


def keeps_structure(problem: FittingProblem, explanation: Explanation, null: Explanation) -> bool:
    """Whether structure in the residual contradicts an explanation, however improbable its rivals are.

    Of indentations structure is a smooth part above the noise of a sample, or one that all samples together show
    plainly; a law is granted it where plain least squares leave less than a twentieth of what
    they leave under the null hypothesis, since every law of contact idealises. Of a law of compressions more is
    granted. Of the null hypothesis on FRFs structure is lines that scatter about the model more than about their
    neighbours by as much as those do.
    """
    if problem.lines.smooth is None:
        return not explanation.names and explanation.best.levels.level > _STRUCTURED
    smooth, noise = _smooth_part(problem, explanation)
    if problem.kind != "indentation":
        return _is_above_noise(smooth / _GRANTED if explanation.names else smooth, noise)
    assert problem.lines.smooth is not None
    slow = float(problem.lines.smooth.slow.max() / np.median(problem.lines.smooth.scale))
    if smooth <= max(_LEAST_STRUCTURE, _SLOW * slow):
        return False
    known = explanation.best.levels.level > _LEAST_LEVEL
    if smooth <= _STRUCTURED * noise and not (known and left_smooth(explanation) > _PLAIN_STRUCTURE):
        return False
    return explanation.least_squares[1] >= _GRANTED_TO_LAWS * null.least_squares[1]


def largest_floor_percent(problem: FittingProblem, null: Explanation, groups: Sequence[HeldOut]) -> float:
    """What noise alone would make of the error, in the recordings and in each group held out, the largest [%]."""
    return max(entry.floor_percent for entry in (in_sample(problem, null), *(entry.before for entry in groups)))


def _smooth_part(problem: FittingProblem, explanation: Explanation) -> tuple[float, float]:
    """Of curves: the size of what is left smoothly, and a sample's noise, both relative to the largest force.

    Noise is at least what neighbouring samples show.
    """
    lines, levels = problem.lines, explanation.best.levels
    assert lines.smooth is not None
    return levels.smooth, max(levels.level, 1.0) * float(np.median(lines.deviation / lines.smooth.scale))


def _is_above_noise(smooth: float, noise: float) -> bool:
    return smooth > max(_ABOVE_NOISE * noise, _LEAST_REMAINDER)
