"""Which sets of mechanisms are fitted; how probable each is, answers.py works out.

Priors over sets are fixed (priors.py). Singles are all fitted; pairs and triples grow greedily from the best, but of
curves all pairs are.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.explanation import integrated as integrate
from underskin.diagnosis.selection import curve_sets
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.curve_sets import Explanations
from underskin.diagnosis.selection.priors import LARGEST
from underskin.diagnosis.selection.unnamed_rivals import discrepancy
from underskin.mechanisms.base import Unsupported

_PARENTS, _LARGEST = 3, 3
_BEST = 3  # nothing and two more: processes are tried on top of the best two
_WITHIN = 6.0  # nats behind the best within which evidence is worth integrating: that moves it by less than 2
_BEHIND = 12.0  # nats behind the best beyond which a single is no parent


def search(
    problem: FittingProblem, known: Sequence[Explanation] = (), asked_for: Sequence[frozenset[str]] = ()
) -> Search:
    """Fit nothing, every single, sets that other kinds of recordings have `asked_for`, then what grows from the best.

    What is `known` of them is taken over.
    """
    explanations: Explanations = {frozenset(entry.names): entry for entry in known}
    tried = {frozenset[str]()}
    unsupported: dict[str, str] = {}
    catalogue = problem.lines.mechanisms.named
    for name in catalogue:
        try:
            problem.hypothesis((name,), placed=False)
        except Unsupported as refusal:
            unsupported[name] = refusal.reason
    names = [name for name in catalogue if name not in unsupported]
    singles = [Request(()), *(Request((name,)) for name in names)]
    tried |= {frozenset(request.names) for request in singles}
    if problem.lines.curves:  # whose contact points the null hypothesis finds once for all
        _explain(problem, explanations, singles[:1])
        singles = [Request(request.names, begin=explanations[frozenset()].point) for request in singles[1:]]
    _explain(problem, explanations, singles)
    beside = [Request(tuple(name for name in catalogue if name in one), kept=True) for one in asked_for if len(one) > 1]
    tried |= {frozenset(request.names) for request in beside}
    _explain(problem, explanations, beside)
    integrated: Explanations = {}
    for size in range(2, (LARGEST if asked_for else _LARGEST) + 1):
        integrated |= _integrated(explanations, frozenset(integrated), unsupported, 1)
        explanations |= integrated
        if problem.lines.curves and size == 2:
            requests = curve_sets.all_pairs(names, explanations)
        else:
            requests = [
                Request(tuple(entry for entry in catalogue if entry in {*parent.names, name}), parent)
                for parent in _parents(Search(tuple(explanations.values()), (), unsupported), size, asked_for)
                for name in names
                if name not in parent.names
            ]
        tried |= {frozenset(request.names) for request in requests}
        _explain(problem, explanations, requests)
        if problem.lines.curves and size == 2:
            explanations |= curve_sets.afresh(problem, explanations, requests)
    if problem.lines.curves:
        weight = Search(tuple(explanations.values()), (), unsupported).log_weight
        refitted = curve_sets.from_larger(problem, explanations, weight)
        explanations |= refitted
        integrated = {names: entry for names, entry in integrated.items() if names not in refitted}
    explanations |= _integrated(explanations, frozenset(integrated), unsupported, _BEST)
    result = Search(tuple(explanations.values()), (), unsupported, tried=len(tried))
    best = sorted((entry for entry in result.explanations if entry.names), key=result.log_weight, reverse=True)[:2]
    processes = tuple((entry, discrepancy(problem, entry)) for entry in (explanations[frozenset()], *best))
    return replace(result, discrepancies=processes)


def _explain(problem: FittingProblem, explanations: Explanations, requests: Sequence[Request]) -> None:
    """Add the explanations of sets that have none yet, from the first parent in whose company the last one shows."""
    while requests:
        now, later = {}, []
        for request in requests:
            key = frozenset(request.names)
            if key in explanations:
                continue
            if key in now:
                later.append(request)
            else:
                now[key] = request
        best = min((entry.best.cost for entry in explanations.values()), default=np.inf)
        for key, explanation in zip(now, problem.explain(list(now.values()), best), strict=True):
            if explanation is not None:
                explanations[key] = explanation
        requests = later


def _integrated(
    explanations: Explanations, done: frozenset[frozenset[str]], unsupported: dict[str, str], best: int
) -> Explanations:
    """The explanations whose evidence may count, and the `best` anyhow, integrated over their loose parameters.

    Those `done` are left out.
    """
    weight = Search(tuple(explanations.values()), (), unsupported).log_weight
    ranked = sorted(explanations, key=lambda names: weight(explanations[names]), reverse=True)
    least = weight(explanations[ranked[0]]) - _WITHIN
    chosen = [
        names
        for place, names in enumerate(ranked)
        if names not in done and (place < best or weight(explanations[names]) > least)
    ]
    return dict(zip(chosen, integrate([explanations[names] for names in chosen]), strict=True))


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
