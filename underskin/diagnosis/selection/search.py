"""Which sets of mechanisms are fitted; how probable each is, answers.py works out.

Priors over sets are fixed (priors.py). Singles are all fitted; pairs and triples grow greedily from the best, but all
pairs are fitted of curves, and of laws of declared values, material, contact and increment. The best are then fitted
again without each of their mechanisms (smaller_sets.py); from what fits better for it, sets grow once more.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.explanation import integrated as integrate
from underskin.diagnosis.selection import curve_sets
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.priors import LARGEST
from underskin.diagnosis.selection.smaller_sets import Explanations, from_larger
from underskin.diagnosis.selection.unnamed_rivals import discrepancy
from underskin.mechanisms.base import Stage, Unsupported

_PARENTS, _LARGEST = 3, 3
_BEST = 3  # nothing and two more: processes are tried on top of the best two
_WITHIN = 6.0  # nats behind the best within which evidence is worth integrating: that moves it by less than 2
_OF_CONTACTS = (Stage.DECLARED, Stage.MATERIAL, Stage.CONTACT)  # that change contacts' stiffness
_PAIRED = (*_OF_CONTACTS, Stage.LOAD_INCREMENT)  # of which two may cancel, so that neither shows alone
_BEHIND = 12.0  # nats behind the best beyond which a single is no parent


def search(
    problem: FittingProblem, known: Sequence[Explanation] = (), asked_for: Sequence[frozenset[str]] = ()
) -> Search:
    """Fit nothing, every single, sets that other kinds of recordings have `asked_for`, then what grows from the best.

    What is `known` of them is taken over.
    """
    explained = {frozenset(entry.names): entry for entry in known}
    sets = _Sets(problem, explained, _unsupported(problem), asked_for)
    catalogue = problem.lines.mechanisms.named
    nothing, singles = Request(()), [Request((name,)) for name in sets.names]
    if problem.lines.curves:  # whose contact points the null hypothesis finds once for all
        sets.explain([nothing])
        singles = [replace(request, begin=sets.explanations[frozenset()].point) for request in singles]
    sets.explain([nothing, *singles])
    beside = [Request(tuple(name for name in catalogue if name in one), kept=True) for one in asked_for if len(one) > 1]
    sets.explain(beside)
    largest = LARGEST if asked_for else _LARGEST
    sets.grow(largest)
    if sets.refit_smaller() and not problem.lines.curves:  # of which all pairs were fitted
        sets.grow(largest)
    sets.integrate(_BEST)
    result = sets.search
    best = sorted((entry for entry in result.explanations if entry.names), key=result.log_weight, reverse=True)[:2]
    processes = tuple((entry, discrepancy(problem, entry)) for entry in (sets.explanations[frozenset()], *best))
    return replace(result, discrepancies=processes)


def _unsupported(problem: FittingProblem) -> dict[str, str]:
    """The mechanisms that the recordings do not support, and what these lack."""
    unsupported: dict[str, str] = {}
    for name in problem.lines.mechanisms.named:
        try:
            problem.hypothesis((name,), placed=False)
        except Unsupported as refusal:
            unsupported[name] = refusal.reason
    return unsupported


@dataclass
class _Sets:
    """The sets that were fitted so far, those that were `tried`, and those whose evidence is `integrated` over their
    loose parameters; other kinds of recordings `asked_for` some."""

    problem: FittingProblem
    explanations: Explanations
    unsupported: dict[str, str]
    asked_for: Sequence[frozenset[str]] = ()
    tried: set[frozenset[str]] = field(default_factory=set)
    integrated: set[frozenset[str]] = field(default_factory=set)

    @property
    def names(self) -> list[str]:
        """The mechanisms that the recordings support."""
        return [name for name in self.problem.lines.mechanisms.named if name not in self.unsupported]

    @property
    def search(self) -> Search:
        """All of them as rivals."""
        return Search(tuple(self.explanations.values()), (), self.unsupported, tried=len(self.tried))

    def explain(self, requests: Sequence[Request]) -> None:
        """Add the explanations of sets that have none yet, from the first parent in whose company the last one
        shows."""
        self.tried |= {frozenset(request.names) for request in requests}
        while requests:
            now: dict[frozenset[str], Request] = {}
            later = []
            for request in requests:
                key = frozenset(request.names)
                if key in self.explanations:
                    continue
                if key in now:
                    later.append(request)
                else:
                    now[key] = request
            best = min((entry.best.cost for entry in self.explanations.values()), default=np.inf)
            for key, explanation in zip(now, self.problem.explain(list(now.values()), best), strict=True):
                if explanation is not None:
                    self.explanations[key] = explanation
            requests = later

    def integrate(self, best: int) -> None:
        """Integrate the evidence that may count, and that of the `best` anyhow."""
        weight = self.search.log_weight
        ranked = sorted(self.explanations, key=lambda names: weight(self.explanations[names]), reverse=True)
        least = weight(self.explanations[ranked[0]]) - _WITHIN
        chosen = [
            names
            for place, names in enumerate(ranked)
            if names not in self.integrated and (place < best or weight(self.explanations[names]) > least)
        ]
        whole = integrate([self.explanations[names] for names in chosen])
        self.explanations |= dict(zip(chosen, whole, strict=True))
        self.integrated |= set(chosen)

    def grow(self, largest: int) -> None:
        """Add sets of two mechanisms and more that grow from the best, one mechanism at a time."""
        curves = self.problem.lines.curves
        for size in range(2, largest + 1):
            self.integrate(1)
            if curves and size == 2:
                requests = self._all_pairs(self.names)
                self.explain(requests)
                self.explanations |= curve_sets.afresh(self.problem, self.explanations, requests)
            else:
                self.explain(self._larger(size))

    def _larger(self, size: int) -> list[Request]:
        """The best sets with one mechanism less, each with one more.

        Where that leads nowhere, from starts over both: of the best single with any other, and of two that shape the
        response over frequency, since the one bends to the other as long as it is alone; of two that move one and the
        same resonance, since the mass that was found on other contacts is not theirs.
        """
        known, catalogue = self.problem.lines.mechanisms, self.problem.lines.mechanisms.named
        requests, over_both = [], []
        parents = _parents(self.search, size, self.asked_for)
        for parent in parents:
            rings = any(known[name].needs_stiffness for name in parent.names)
            for name in self.names:
                if name in parent.names:
                    continue
                names = tuple(entry for entry in catalogue if entry in {*parent.names, name})
                requests.append(Request(names, parent, self.explanations.get(frozenset([name]))))
                moves = all(known[one].stage is not Stage.ADDED_CHARGE for one in names)  # the mean, not the covariance
                shape = all("frequency_hz" in known[one].axes for one in names)
                if (
                    size == 2
                    and moves
                    and (shape or parent is parents[0] or (rings and known[name].stage in _OF_CONTACTS))
                ):
                    over_both.append(Request(names))
        if size == 2:
            paired = [name for name in self.names if known[name].stage in _PAIRED]
            over_both += self._all_pairs(paired)
        return [*requests, *over_both]

    def _all_pairs(self, names: Sequence[str]) -> list[Request]:
        """Every pair, from the better of its two: two may hide each other."""
        requests = []
        for pair in itertools.combinations(names, 2):
            known = [self.explanations[key] for one in pair if (key := frozenset([one])) in self.explanations]
            requests.append(Request(pair, max(known, key=lambda entry: entry.log_evidence, default=None)))
        return requests

    def refit_smaller(self) -> bool:
        """Fit the best sets again without each of their mechanisms; whether any fits better for it."""
        refitted = from_larger(self.problem, self.explanations, self.search.log_weight)
        self.explanations |= refitted
        self.integrated -= set(refitted)
        return bool(refitted)


def _parents(result: Search, size: int, asked_for: Sequence[frozenset[str]]) -> list[Explanation]:
    """The explanations, one mechanism smaller, from which sets of this size grow: the best of all, and of those that
    were asked for, some of which are larger."""
    ranked = sorted(result.explanations, key=result.log_weight, reverse=True)
    best = result.log_weight(ranked[0])
    if size > 2:
        own = next(entry for entry in ranked if len(entry.names) < size)
        asked = next((one for one in ranked if len(one.names) == size - 1 and frozenset(one.names) in asked_for), own)
        return [one for one in ([own] if asked is own else [own, asked]) if len(one.names) == size - 1]
    smaller = [entry for entry in ranked if len(entry.names) == size - 1][:_PARENTS]
    return [entry for entry in smaller if result.log_weight(entry) > best - _BEHIND]
