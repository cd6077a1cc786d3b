"""What the base model idealises although declared facts say it: laws without a free parameter, such as the layer's."""

from collections.abc import Collection
from typing import Any

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.unseen import beside
from underskin.diagnosis.reporting.numbers import rounded
from underskin.diagnosis.selection.answers import Answer, Search
from underskin.diagnosis.selection.priors import declared_laws

_COUNTS = 0.03  # of the probability, below which an answer is asked no more than whether it holds the law


def idealised(search: Search, problem: FittingProblem, shown: Explanation) -> list[dict[str, Any]]:
    """Of each such law the posterior that it is there, over all answers, and what it does to the response that is
    `shown`, root mean square in percent of it.

    It has even odds beside its absence under every answer; where it shows too little to be named in one, its share of
    that is by the evidence.
    """
    named = problem.lines.mechanisms.named
    stated = {frozenset(answer.names) for answer in search.answers}
    return [
        {
            "name": name,
            "probability": round(sum(_probability(one, problem, name, stated) for one in search.answers), 3),
            "effect_percent": rounded(_effect_percent(problem, shown, name), 2),
        }
        for name in named
        if name in declared_laws(problem.lines) and name not in search.unsupported
    ]


def _probability(answer: Answer, problem: FittingProblem, name: str, stated: Collection[frozenset[str]]) -> float:
    """The posterior of an answer and the law together; 0 of one beside which the answer with the law is `stated`."""
    if answer.explanation is None or name in answer.names:
        return answer.probability * (0.5 if answer.explanation is None else 1.0)
    with_law = frozenset({name, *answer.explanation.names, *answer.alone})
    if answer.probability < _COUNTS or with_law in stated:
        return 0.0
    measured = "youngs_modulus" if problem.lines.curves else "d33"
    found = beside(problem, answer.explanation, name, measured)
    odds = 0.0 if found is None else float(found.share.sum())
    return answer.probability * odds / (1 + odds)


def _effect_percent(problem: FittingProblem, shown: Explanation, name: str) -> float:
    """Since the law has no parameter, the models with and without it have the same."""
    without = tuple(one for one in shown.names if one != name)
    order = [one for one in problem.lines.mechanisms if one in {*without, name}]
    models = [problem.hypothesis(names, placed=False).model for names in (without, tuple(order))]
    before, after = (model.predict(shown.point.fit).value for model in models)
    change, size = (float(np.linalg.norm(of)) for of in (after - before, before))
    return 100 * change / max(size, 1e-300)
