"""A second estimate of the lines' noise, without the course along frequency that a law describes.

On the flank of a resonance an FRF bends between two lines, and noise that is estimated from the roughness of the lines
(line_noise.py) comes out too large there, several times so where the flank moves with the preload. The level that all
lines share then falls, the others seem too noisy, and a law that adds variance (`mains_pickup`) is credited with the
difference. So the single mechanisms that act along frequency are fitted first; where one of them describes the lines,
the roughness is that of its residual. A smooth prediction removes no noise. All mechanisms are then compared under this
one estimate, though it was made beside one of them.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from underskin.diagnosis.data.dataset import lines
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.mechanisms.base import Unsupported
from underskin.mechanisms.registry import Known
from underskin.recordings.campaign import Campaign
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

_SPEAKS = 10.0  # nats of evidence over the base model from which a law's course is taken off
_CHANGED = 0.03  # change of the noise of some line, relative, below which it stays as it was


def frf_problem(
    campaign: Campaign, uneven: Mapping[str, Floats], table: SigmaTable, mechanisms: Known
) -> tuple[FittingProblem, list[Explanation]]:
    """The lines of a campaign's FRFs with their noise, ready to be explained; and the explanations that are known."""
    measured = replace(lines(campaign, uneven), mechanisms=mechanisms)
    mechanisms.bind(measured.campaign, table, "frf")
    problem = FittingProblem(measured, table)
    nothing, *singles = known = _along_frequency(problem)
    fixed = [one for one in singles if not any(entry.acts_on == "line_variance" for entry in one.model.parameters)]
    best = max(fixed, key=lambda entry: entry.log_evidence, default=nothing)
    if best.log_evidence <= nothing.log_evidence + _SPEAKS:
        return problem, known
    refined = lines(campaign, uneven, (problem.lines, best.best.prediction.value))
    refined = replace(refined, mechanisms=mechanisms)
    change = np.abs(refined.deviation / problem.lines.deviation - 1).max()
    return (FittingProblem(refined, table), []) if change > _CHANGED else (problem, known)


def _along_frequency(problem: FittingProblem) -> list[Explanation]:
    """Nothing, and the single mechanisms that act on lines apart."""
    requests = [Request(())]
    for name, mechanism in problem.lines.mechanisms.named.items():
        if "frf" not in mechanism.kinds or not mechanism.needs_lines:
            continue
        try:
            problem.hypothesis((name,), placed=False)
        except Unsupported:
            continue
        requests.append(Request((name,)))
    return [entry for entry in problem.explain(requests) if entry is not None]
