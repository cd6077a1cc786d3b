"""Sets of mechanisms fitted again from sets with one mechanism more.

A fit may be stuck where it would ask for a companion that is not there: beside that, the parameters of all find their
places, and keep them without it.
"""

from collections.abc import Callable

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request

_LEADING = 8.0  # nats behind the best within which sets are fitted again with one mechanism less
_STUCK = 1.0  # nats that a fit begun elsewhere must gain

Explanations = dict[frozenset[str], Explanation]  # by the names of their mechanisms


def was_stuck(before: Explanation | None, found: Explanation) -> bool:
    """Whether a set fits better as it is found now than before, where it was fitted at all."""
    return before is None or found.best.cost < before.best.cost - _STUCK


def from_larger(
    problem: FittingProblem, explanations: Explanations, weight: Callable[[Explanation], float]
) -> Explanations:
    """The sets with one mechanism less than the best ones, or than those among them that fit better for it, which fit
    better from there."""
    better: Explanations = {}
    least = max(map(weight, explanations.values())) - _LEADING
    waiting = [entry for entry in explanations.values() if weight(entry) > least]
    while waiting:
        requests = [
            Request(tuple(one for one in larger.names if one != name), larger=larger)
            for larger in waiting
            for name in larger.names
            if len(larger.names) > 1
        ]
        waiting = []
        for request, found in zip(requests, problem.explain(requests), strict=True):
            names = frozenset(request.names)
            if found is not None and was_stuck((explanations | better).get(names), found):
                better[names] = found
                waiting.append(found)
    return better
