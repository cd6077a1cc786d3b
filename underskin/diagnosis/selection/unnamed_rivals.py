"""Unmodelled discrepancies as rivals of the mechanisms, with the noise and the parameters of every hypothesis.

- δ of a recording, FRF = model · (1 + δ), see `recording_gp`; of a line, see `frequency_gp`; or both;
- scatter from recording to recording far beyond that of rigs: 20 % have a cause that no mechanism names;
- of curves, a smooth error far beyond that of laws of contact.

Amplitudes of δ below 1.5 % are not considered: a law that is right to that misses no physics.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from underskin.diagnosis.inference.evidence import around, laplace
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.hypothesis import Hypothesis
from underskin.diagnosis.inference.optimizer import Fitter
from underskin.diagnosis.noise.correlated_error import UNNAMED
from underskin.diagnosis.noise.noise_priors import UNUSUAL_GAIN, UNUSUAL_POSITION
from underskin.diagnosis.selection.frequency_gp import over_lines
from underskin.diagnosis.selection.recording_gp import over_recordings
from underskin.recordings.usual_scatter import GAIN_RANGE, POSITION_RANGE

_KINDS = {"recordings": 0.45, "lines": 0.4, "both": 0.05, "scatter": 0.1}


@dataclass(frozen=True)
class Discrepancy:
    """The evidence for δ on top of one explanation: log Z of the whole, and of δ over each axis against none."""

    log_evidence: float
    axes: dict[str, float]  # log evidence gained; "frequency_hz" for lines


def discrepancy(problem: FittingProblem, explanation: Explanation) -> Discrepancy:
    """What a process gains on top of an explanation."""
    if problem.lines.curves:
        return _along_curves(problem, explanation)
    over = {
        "recordings": over_recordings(problem, explanation),
        "lines": over_lines(problem, explanation),
        "scatter": _unusual_scatter(explanation),
    }
    gained = {
        kind: float(logsumexp(list(gains.values())) - np.log(len(gains))) for kind, gains in over.items() if gains
    }
    if "recordings" in gained and "lines" in gained:
        gained["both"] = gained["recordings"] + gained["lines"]
    each = [np.log(_KINDS[kind]) + gain for kind, gain in gained.items()]
    total = float(logsumexp(each)) if each else -np.inf
    return Discrepancy(explanation.log_evidence + total, {**over["recordings"], **over["lines"], **over["scatter"]})


def _unusual_scatter(explanation: Explanation) -> dict[str, float]:
    """What scatter beyond the usual gains; looked for where the fit went beyond the usual itself."""
    levels = explanation.best.levels
    usual = explanation.best.hypothesis
    evidence = {}
    if levels.gain > GAIN_RANGE[1]:
        wider = replace(usual, gain=UNUSUAL_GAIN)
        evidence["scatter of gain"] = _refitted(wider, explanation, 0, UNUSUAL_GAIN.low)
    if levels.position > POSITION_RANGE[1]:
        wider = replace(usual, position=UNUSUAL_POSITION)
        evidence["scatter of position"] = _refitted(wider, explanation, 2, UNUSUAL_POSITION.low)
    return {name: log_evidence - explanation.log_evidence for name, log_evidence in evidence.items()}


def _refitted(hypothesis: Hypothesis, explanation: Explanation, place: int, least: float) -> float:
    """The evidence of a hypothesis whose `place`-th parameter of the covariance is large, from at least `least`."""
    fitter = Fitter([hypothesis])
    covariance = explanation.point.covariance.copy()
    covariance[place] = max(covariance[place], least)
    point = replace(explanation.point, covariance=covariance)
    improved = fitter.improve(fitter.at(point))
    if not hypothesis.lines.curves:
        return laplace(fitter, improved).log_evidence
    # By the quadratic of both: integrals over what is loose would take longer than all else, and add about the same.
    plain = Fitter([explanation.best.hypothesis])
    beneath = around(plain, plain.evaluate(plain.at(explanation.point)))[0].log_evidence
    return explanation.log_evidence + around(fitter, improved)[0].log_evidence - beneath


def _along_curves(problem: FittingProblem, explanation: Explanation) -> Discrepancy:
    """The smooth error that every hypothesis has of curves, large: everything is fitted again beneath it."""
    log_evidence = _refitted(
        replace(problem.hypothesis(explanation.names, placed=False), smooth=UNNAMED), explanation, 2, UNNAMED.low
    )
    return Discrepancy(log_evidence, {"displacement_mm": log_evidence - explanation.log_evidence})
