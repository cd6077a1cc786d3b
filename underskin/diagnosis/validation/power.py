"""Which mechanisms these recordings would have shown, and from which strength on.

A mechanism would have shown if, at the noise that was found, its expected gain in log likelihood ½χ² pays for what it
costs: the prior odds of nothing missing, those that an explanation must win by, and Occam's factor of its strength,
½ log(1 + χ²). χ² is what the nuisances leave of its typical signature (signatures.py), which grows as the strength
squared.
"""

from dataclasses import dataclass

import numpy as np

from underskin.diagnosis.data.names import EXPLAINED
from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.selection.priors import least_evidence, log_prior
from underskin.diagnosis.validation.signatures import Signatures

_LARGEST = 100.0  # % of the response: what changes less than that nowhere is not told from the nuisances
_ROUNDS = 20


@dataclass(frozen=True)
class Power:
    """The least change of the response, as a root mean square over all rows [%], from which on a mechanism shows."""

    mechanism: str
    smallest_visible_percent: float


def power(signatures: Signatures, explanation: Explanation, supported: int) -> list[Power]:
    """Of each mechanism that could show here at all, the most visible first.

    Parameters
    ----------
    signatures
        Of the recordings' design.
    explanation
        Whose noise levels are taken: the answer's.
    supported
        How many mechanisms the campaign supports, among which the prior is shared.
    """
    if not signatures.owners:
        return []
    chi2 = np.diag(signatures.left(explanation.best.levels)[0])
    least = least_chi2(supported, least_evidence(explanation))
    visible = []
    for name in dict.fromkeys(signatures.owners):
        typical = signatures.owners.index(name)
        if chi2[typical] <= 0:
            continue
        percent = signatures.percent[typical] * float(np.sqrt(least / chi2[typical]))
        if percent < _LARGEST:
            visible.append(Power(name, percent))
    return sorted(visible, key=lambda entry: entry.smallest_visible_percent)


def least_chi2(supported: int, shows: float) -> float:
    """The χ² from which on one of so many mechanisms is expected to be named, which must bring `shows` nats."""
    odds = max(log_prior(0, supported) - log_prior(1, supported) + np.log(EXPLAINED / (1 - EXPLAINED)), shows)
    chi2 = 2 * odds
    for _ in range(_ROUNDS):
        chi2 = 2 * odds + np.log1p(chi2)
    return float(chi2)
