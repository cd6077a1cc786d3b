"""Which sets of mechanisms are fitted, and how probable each is.

Priors over sets are fixed: see PRIORS. Within a size, every set of mechanisms that the campaign supports is equally
probable. Singles are all fitted; pairs and triples grow greedily from the best.
"""

import math
from dataclasses import dataclass

from underskin.diagnosis.explanation import Explanation, Workbench
from underskin.mechanisms.catalogue import CATALOGUE
from underskin.mechanisms.mechanism import Unsupported

PRIORS = {"nothing_missing": 0.30, "one": 0.42, "two": 0.16, "three": 0.02, "none_of_these": 0.10}
_PARENTS = 3
_BEHIND = 12.0  # nats behind the best beyond which a single is no parent


@dataclass(frozen=True)
class Search:
    """All explanations tried, and the mechanisms that the campaign does not support, with the reason."""

    explanations: tuple[Explanation, ...]
    unsupported: dict[str, str]

    def log_weight(self, explanation: Explanation) -> float:
        """Prior times evidence."""
        return explanation.log_evidence + log_prior(len(explanation.names), self.supported)

    @property
    def supported(self) -> int:
        """How many mechanisms the campaign supports."""
        return len(CATALOGUE) - len(self.unsupported)

    @property
    def ranked(self) -> list[Explanation]:
        """The most probable first."""
        return sorted(self.explanations, key=self.log_weight, reverse=True)


def log_prior(size: int, supported: int) -> float:
    """The logarithm of the prior of one set of that many mechanisms."""
    share = PRIORS[("nothing_missing", "one", "two", "three")[size]]
    return math.log(share) - math.log(math.comb(supported, size))


def search(bench: Workbench) -> Search:
    """Fit nothing, every single, then what grows from the best."""
    nothing = bench.explain(())
    assert nothing is not None
    found: dict[frozenset[str], Explanation] = {frozenset(): nothing}
    unsupported: dict[str, str] = {}
    for name in CATALOGUE:
        try:
            single = bench.explain((name,))
        except Unsupported as refusal:
            unsupported[name] = refusal.reason
            continue
        assert single is not None
        found[frozenset((name,))] = single
    names = [name for name in CATALOGUE if name not in unsupported]
    for size in (2, 3):
        result = Search(tuple(found.values()), unsupported)
        ranked = result.ranked
        parents = [entry for entry in ranked if len(entry.names) == size - 1][:_PARENTS]
        best = result.log_weight(ranked[0])
        parents = [entry for entry in parents if result.log_weight(entry) > best - _BEHIND]
        if size == 3:
            parents = parents[:1] if ranked[0] in parents else []
        for parent in parents:
            for name in names:
                chosen = frozenset((*parent.names, name))
                if len(chosen) != size or chosen in found:
                    continue
                grown = bench.explain(tuple(chosen), parent)
                if grown is not None:
                    found[chosen] = grown
    return Search(tuple(found.values()), unsupported)
