"""By how much d33 would be off if a mechanism were there that these recordings cannot show.

Where a mechanism's typical strength leaves too little beside d33, E and h to be named, these take up what it does: by
(H + P)⁻¹ Hₛ to first order, H the information on them, P that of their priors and Hₛ what they share with the
mechanism's signature (signatures.py).
"""

from dataclasses import dataclass

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.noise.noise_levels import NoiseLevels
from underskin.diagnosis.selection.priors import least_evidence
from underskin.diagnosis.validation.power import least_chi2
from underskin.diagnosis.validation.signatures import Signatures
from underskin.mechanisms.base import Kind, Stage
from underskin.units import Floats


@dataclass(frozen=True)
class HiddenShift:
    """A mechanism that would not be named at its typical strength, and the logarithm of the factor by which d33 would
    be off; `declared`: it is a wrong declared number."""

    mechanism: str
    log_factor: float
    declared: bool

    @property
    def percent(self) -> float:
        """Of d33."""
        return float(100 * np.expm1(self.log_factor))


def hidden_shifts(
    problem: FittingProblem,
    signatures: Signatures,
    explanation: Explanation,
    supported: int,
    other_kinds: frozenset[Kind] = frozenset(),
) -> list[HiddenShift]:
    """Of FRFs: the mechanisms that are not in the stated `explanation` and would not be named beside it.

    `supported` is how many the campaign supports, among which the prior is shared; recordings of `other_kinds` tell the
    mechanisms that act on them too, with which the signatures do not count.
    """
    if problem.lines.curves or not signatures.owners:
        return []
    levels = explanation.best.levels
    chi2 = np.diag(signatures.left(levels)[0])
    off = _of_d33(signatures, levels)
    least = least_chi2(supported, least_evidence(explanation))
    return [
        HiddenShift(name, float(off[place]), problem.lines.mechanisms[name].stage is Stage.DECLARED)
        for name, place in signatures.typical.items()
        if name not in explanation.names
        and chi2[place] < least
        and not other_kinds & {*problem.lines.mechanisms[name].kinds}
    ]


def _of_d33(signatures: Signatures, levels: NoiseLevels) -> Floats:
    """What ln d33 is off by for each signature (signatures,)."""
    return signatures.taken_up(levels)[signatures.nuisances.index("d33")]
