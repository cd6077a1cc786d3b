"""The lines' noise once more, without the course along frequency that a law describes.

Between two lines on the flank of a resonance an FRF bends, and the noise that is read from how rough the lines are
(line_noise.py) comes out too large there, several times so where the flank moves with the preload. The level that all
lines share then falls, the others seem too noisy, and a law that adds variance (`mains_pickup`) is credited with the
difference. So the single mechanisms that act along frequency are fitted first; where one of them describes the lines,
the roughness is that of what its prediction leaves. A prediction that is smooth takes nothing of the noise away; all
mechanisms are then compared anew under this one noise, though it was estimated beside one of them.
"""

from collections.abc import Mapping

import numpy as np

from underskin.diagnosis.data.dataset import lines
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, needs_lines
from underskin.mechanisms.base import Unsupported
from underskin.mechanisms.models.pickup import PICKUP_NAMES
from underskin.mechanisms.registry import CATALOGUE
from underskin.recordings.campaign import Campaign
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

_SPEAKS = 10.0  # nats of evidence over the base model from which a law's course is taken off
_CHANGED = 0.03  # change of the noise of some line, relative, below which it stays as it was


def frf_problem(campaign: Campaign, uneven: Mapping[str, Floats], table: SigmaTable) -> FittingProblem:
    """The lines of a campaign's FRFs with their noise, ready to be explained."""
    problem = FittingProblem(lines(campaign, uneven), table)
    best = _best_along_frequency(problem)
    if best is None:
        return problem
    refined = lines(campaign, uneven, best.best.at.prediction.value)
    change = np.abs(refined.deviation / problem.lines.deviation - 1).max()
    return FittingProblem(refined, table) if change > _CHANGED else problem


def _best_along_frequency(problem: FittingProblem) -> Explanation | None:
    """The single mechanism acting on lines apart that explains them best, where it does so far better than nothing."""
    nothing = problem.explain(())
    assert nothing is not None
    singles = []
    for name, mechanism in CATALOGUE.items():
        if "frf" not in mechanism.kinds or not needs_lines(name):
            continue
        try:
            found = problem.explain((name,))
        except Unsupported:
            continue
        if found is not None and not any(entry.name in PICKUP_NAMES for entry in found.model.parameters):
            singles.append(found)
    best = max(singles, key=lambda entry: entry.log_evidence, default=nothing)
    return best if best.log_evidence > nothing.log_evidence + _SPEAKS else None
