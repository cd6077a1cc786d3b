"""What all surviving answers say together: which mechanisms are there, d33, and whether they predict alike."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr

from underskin.diagnosis.data.names import EXPLAINED
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.residuals import whole_prediction
from underskin.diagnosis.reporting.numbers import SDS_OF_95, parameter, place_of, rounded
from underskin.diagnosis.selection.answers import Answer, Search

_COUNTS = 0.003  # of the probability, below which an answer is left out of averages
_TWINS = 2.0  # nats by which sets with the one in place of the other differ at most
_NAMED, _LEAST_NAMED = 0.02, 3  # probability of a group that is listed, and how many are at least
_ALIKE = 0.5  # of the noise: answers that differ by less predict alike
_ENOUGH_ALIKE = 0.95


def presence(search: Search, present: Mapping[str, float]) -> list[dict[str, Any]]:
    """Groups of mechanisms that these recordings cannot tell apart, and the posterior that one of each is there.

    Two are in a group where some answer stands as well with the one in place of the other. `present` is the posterior
    of each mechanism, from which that of one alone in its group is taken.
    """
    found = []
    for group in _groups(search):
        together = sum(answer.probability for answer in search.answers if set(group) & set(answer.names))
        found.append((present.get(group[0], 0.0) if len(group) == 1 else together, group))
    found.sort(key=lambda entry: (-entry[0], entry[1]))
    return [
        {"mechanisms": group, "probability": round(probability, 3)}
        for place, (probability, group) in enumerate(found)
        if place < _LEAST_NAMED or probability >= _NAMED
    ]


def present(search: Search, problem: FittingProblem) -> dict[str, float]:
    """The posterior that each mechanism is there, also beside a law or a process that nobody listed."""
    found: dict[str, float] = {}
    for answer in search.answers:
        if answer.explanation is not None:
            for name in answer.names:
                found[name] = found.get(name, 0.0) + answer.probability
            continue
        laws = [(entry, search.log_weight(entry)) for entry in search.laws if search.shows(entry)]
        beside = [*laws, *search.processes_showing]
        total = np.logaddexp.reduce([weight for _, weight in beside]) if beside else 0.0
        for entry, weight in beside:
            for name in entry.names:
                if name in problem.lines.mechanisms.named:
                    share = answer.probability * float(np.exp(weight - total))
                    found[name] = found.get(name, 0.0) + share
    return found


def _groups(search: Search) -> list[list[str]]:
    standing = [
        answer.explanation
        for answer in search.answers
        if answer.explanation is not None and answer.probability > _COUNTS
    ]
    evidence = {frozenset(entry.names): entry.log_evidence for entry in standing}
    names = sorted({name for own in evidence for name in own})
    groups = [{name} for name in names]
    for one, two in _twins(evidence):
        first, second = (next(group for group in groups if name in group) for name in (one, two))
        if first is not second:
            first |= second
            groups.remove(second)
    return [sorted(group) for group in groups]


def _twins(evidence: Mapping[frozenset[str], float]) -> list[tuple[str, str]]:
    pairs = []
    for one, log_evidence in evidence.items():
        for two, other in evidence.items():
            apart = one ^ two
            if len(one) == len(two) and len(apart) == 2 and abs(log_evidence - other) < _TWINS:
                (mine,), (others,) = one - two, two - one
                pairs.append((mine, others))
    return pairs


def d33(search: Search) -> dict[str, Any] | None:
    """The median and the 95 % interval of d33 over all answers that have one, each with its probability; None where
    what no answer explains is more probable than all of them."""
    each = [
        (answer.probability, explanation)
        for answer in search.answers
        if answer.probability > _COUNTS and (explanation := _stands_on(search, answer)) is not None
    ]
    weights = np.array([probability for probability, _ in each])
    if weights.sum() < 0.5:
        return None
    stated = [parameter(explanation, place_of(explanation, "d33")) for _, explanation in each]
    middle = np.log([entry["value"] for entry in stated])
    deviation = np.log([entry["high"] / entry["low"] for entry in stated]) / (2 * SDS_OF_95)
    share = weights / weights.sum()

    def quantile(level: float) -> float:
        def beyond(at: float) -> float:
            return float(share @ ndtr((at - middle) / deviation) - level)

        far = 8 * deviation.max()
        return float(np.exp(brentq(beyond, middle.min() - far, middle.max() + far)))

    if len(stated) == 1:
        return stated[0]
    ends = {"value": rounded(quantile(0.5)), "low": rounded(quantile(0.025)), "high": rounded(quantile(0.975))}
    return {"name": "d33", "unit": stated[0]["unit"], **ends}


def _stands_on(search: Search, answer: Answer) -> Explanation | None:
    return answer.explanation if answer.explanation is not None else search.law


def alike(search: Search, problem: FittingProblem, floor_percent: float) -> dict[str, Any] | None:
    """The rivals of the leading answer that predict these recordings as it does, by less than half the noise, and the
    probability of all of them; None where that is too little to stand for one answer, or one stands alone."""
    leader = search.answers[0]
    if leader.explanation is None or not leader.explanation.names or leader.probability >= EXPLAINED:
        return None
    predicted = whole_prediction(problem, leader.explanation)
    size = float((np.abs(predicted) ** 2).sum())
    total, rivals, furthest = leader.probability, [], 0.0
    for answer in search.answers[1:]:
        if answer.explanation is None or answer.probability < _COUNTS or not answer.explanation.names:
            continue
        off = np.abs(whole_prediction(problem, answer.explanation) - predicted) ** 2
        percent = 100 * float(np.sqrt(off.sum() / size))
        if percent < _ALIKE * floor_percent:
            total += answer.probability
            furthest = max(furthest, percent)
            rivals.append(list(answer.names))
    if total < _ENOUGH_ALIKE or not rivals:
        return None
    return {"probability": round(total, 3), "rivals": rivals, "differ_percent": rounded(furthest, 2)}


def alike_clause(found: Mapping[str, Any]) -> str:
    """That one of several answers may serve as a model."""
    return (
        f"all that hold {100 * found['probability']:.1f} % predict these recordings alike, to "
        f"{found['differ_percent']:g} %: as a model any of them serves within what was measured"
    )
