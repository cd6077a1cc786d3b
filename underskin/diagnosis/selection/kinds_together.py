"""Several kinds of recordings in one campaign: explained together, unless they contradict each other.

That curves and FRFs are of one material is a hypothesis like any other: its rival, that each kind has a modulus and
strengths of its own, has the evidence of the kinds apart, with the same priors of what is missing, and a small prior:
another elastomer beside the skin's is rarer than a modulus that was declared wrong.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from underskin.diagnosis.inference.explanation import FittingProblem
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.curve_knowledge import OtherKind, of_curves
from underskin.diagnosis.selection.other_kinds import Beside
from underskin.diagnosis.selection.priors import least_evidence
from underskin.diagnosis.selection.search import search
from underskin.mechanisms.base import Kind
from underskin.recordings.campaign import Campaign
from underskin.surrogate.sigma_table import SigmaTable

_ALSO = 2  # answers of recordings alone whose sets are tried together with those of the curves
_TOLD = 0.05  # standard deviation of the logarithm of a modulus that is told
_APART = 3e-3  # prior of kinds that are not of one material

# Recordings explained beside the curves of other kinds, with sets that are to be among those tried; or alone
Fitted = Callable[[Beside | None, Sequence[frozenset[str]]], tuple[FittingProblem, Search]]


@dataclass(frozen=True)
class Joined:
    """The recordings of the kind that gives the verdict, with what the others tell.

    `search` on the `problem` that stands; `apart` is the search on these recordings alone, None where there is no
    other kind; `contradictory` is the probability that the kinds are not of one material.
    """

    problem: FittingProblem
    search: Search
    beside: Beside | None = None
    apart: Search | None = None
    contradictory: float = 0.0

    @property
    def apart_is_likelier(self) -> bool:
        """Whether the kinds contradict each other, so that each is explained alone."""
        return self.contradictory > 0.5

    def shows_on_curves(self, name: str, names: Sequence[str]) -> bool:
        """Whether a mechanism of a set shows on the recordings of another kind."""
        beside = self.search.beside
        if beside is None:
            return False
        others = [other for other in names if other != name]
        both = [(beside.told(kind, names), beside.told(kind, others)) for kind in beside.kinds]
        return any(whole.log_weight > smaller.log_weight + least_evidence(whole.best) for whole, smaller in both)


class Others:
    """The curves of other kinds than the one that gives the verdict."""

    def __init__(self, campaigns: Mapping[Kind, Campaign], table: SigmaTable, without: Sequence[str]) -> None:
        """By kind; mechanisms `without` which all is to be explained."""
        self._campaigns, self._table, self._without = campaigns, table, without

    @cached_property
    def _kinds(self) -> list[OtherKind]:
        """Each searched as if it were alone."""
        found = []
        for kind, campaign in self._campaigns.items():
            problem = of_curves(campaign, kind, self._table, self._without)
            found.append(OtherKind(kind, problem, search(problem).explanations))
        return found

    def joined(self, fitted: Fitted) -> Joined:
        """With the recordings that `fitted` explains, beside these or alone."""
        if not self._campaigns:
            return Joined(*fitted(None, ()))
        alone, apart = fitted(None, ())
        beside = Beside(self._kinds, apart.explanations)
        best = [frozenset(one.explanation.names) for one in apart.answers[:_ALSO] if one.explanation is not None]
        problem, together = fitted(beside, beside.asked_for(alone.lines, best))
        log_apart = _log_apart(apart, beside) + np.log(_APART)
        log_together = together.log_total + np.log1p(-_APART)
        contradictory = float(np.exp(log_apart - np.logaddexp(log_apart, log_together)))
        explained_alone = Joined(alone, apart, beside, apart, contradictory)
        if explained_alone.apart_is_likelier:
            return explained_alone
        return Joined(problem, replace(together, beside=beside), beside, apart, contradictory)


def telling_modulus(joined: Joined | None, names: Sequence[str]) -> frozenset[Kind]:
    """The other kinds that tell the modulus, under a set of mechanisms, as well as it must be known for d33."""
    if joined is None or joined.beside is None:
        return frozenset()
    beside = joined.beside
    return frozenset(kind.kind for kind in beside.kinds if beside.told(kind, names).modulus_deviation < _TOLD)


def _log_apart(apart: Search, beside: Beside) -> float:
    """The logarithm of the sum over what recordings alone say, times what curves say with parameters of their own."""
    return float(
        np.logaddexp.reduce(
            [
                weight + sum(beside.log_evidence_apart(kind, entry.names, apart.supported) for kind in beside.kinds)
                for entry, weight in apart.weighed
            ]
        )
    )
