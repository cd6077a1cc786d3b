"""Curves that contradict each other: their moduli differ by more than a poor rig scatters.

b_i = ln(Σ f m/d² / Σ m²/d²) of curve i, its force f over the stated model m: its modulus over the common one. Of a
poor rig b has the standard deviation s = 5 %, so that Σ (b_i − b̄)²/s² is χ² of n − 1 degrees of freedom. A sphere's
modulus goes with 1/√R, so that exchanged radii, or a diameter for a radius, change b by half a logarithm of a ratio
that is known.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np
from scipy.special import chdtrc

from underskin.diagnosis.data.names import MOST_QUOTED
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.residuals import row_prediction
from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.inversion.mixed_model import GAIN_RANGE
from underskin.recordings.campaign import IndentationRecording
from underskin.units import Floats

_CHANCE = 1e-3  # of a poor rig whose curves would be said to contradict each other


def curve_spread_findings(problem: FittingProblem, stated: Explanation) -> list[Finding]:
    """The modulus of each curve beside the stated one, where they differ beyond what a rig scatters."""
    lines, recordings = problem.lines, problem.lines.campaign.recordings
    if not lines.curves or len(recordings) < 2:
        return []
    model = row_prediction(problem, stated).real
    weighted = model / lines.deviation**2
    along, square = (np.add.reduceat(weighted * column, lines.first) for column in (lines.value.real, model))
    if not (along > 0).all():
        return []
    logarithms = np.log(along / square)
    if _agree(logarithms):
        return []
    curves = [recording for recording in recordings if isinstance(recording, IndentationRecording)]
    radii = [curve.indenter_radius_mm for curve in curves] if len(curves) == len(recordings) else []
    remedies = [words for words, changed in _other_radii(radii) if _agree(logarithms - np.log(changed) / 2)]
    arguments = {
        "ids": [recording.id for recording in recordings],
        "factors": np.exp(logarithms - logarithms.mean()).tolist(),
        "remedies": remedies[:MOST_QUOTED],
    }
    return [Finding(Reason.CURVES_DIFFER, "", "force_n", arguments)]


def _agree(logarithms: Floats) -> bool:
    statistic = np.sum((logarithms - logarithms.mean()) ** 2) / GAIN_RANGE[1] ** 2
    return bool(chdtrc(len(logarithms) - 1, statistic) > _CHANCE)


def _other_radii(radii: Sequence[float]) -> Iterator[tuple[str, Floats]]:
    """Each slip of a lab in the radii, in words, and the radius over the declared one by curve (curves,)."""
    declared = np.array(radii)
    for low, high in combinations(sorted(set(radii)), 2):
        exchanged = np.where(declared == low, high, np.where(declared == high, low, declared))
        yield f"the spheres of {low:g} and {high:g} mm are exchanged", exchanged / declared
    for radius in sorted(set(radii)):
        for factor, words in ((0.5, "the diameter"), (2.0, "half the radius")):
            if len(set(radii)) > 1:
                changed = np.where(declared == radius, factor, 1.0)
                yield f"{radius:g} mm is {words} of that sphere", changed
