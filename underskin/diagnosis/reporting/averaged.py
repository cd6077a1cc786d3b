"""What all surviving answers say together: which mechanisms are there, d33, and whether they predict alike."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from underskin.diagnosis.data.names import EXPLAINED
from underskin.diagnosis.inference.declared_values import declared_d33
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.over_spread import Normals, over_spread, together
from underskin.diagnosis.inference.residuals import whole_prediction
from underskin.diagnosis.inference.unseen import beside
from underskin.diagnosis.reporting.law_level import law_levels
from underskin.diagnosis.reporting.numbers import mixture_quantile, place_of, rounded
from underskin.diagnosis.selection.answers import Answer, Search
from underskin.diagnosis.selection.priors import SHOWS, UNSEEN_ODDS, declared_laws
from underskin.units import Floats

_COUNTS = 0.003  # of the probability, below which an answer is left out of averages
_WORTH_MORE = 0.03  # of the probability, below which what may be there besides an answer is left out
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


def d33(search: Search, problem: FittingProblem, unsure: float = 0.0) -> dict[str, Any] | None:
    """The median and the 95 % interval of d33 over all answers that have one, each with its probability and with what
    may be there besides without showing; None where what no answer explains is more probable than all of them.

    What the declared values of the skin may be off by widens the interval, and not `relative`, which is for comparing
    sensors, dates and spheres. `unsure` is a further relative standard uncertainty.
    """
    by_explanation: dict[int, tuple[float, Explanation]] = {}  # curves' own mechanisms do not change d33
    for probability, entry in (pair for answer in search.answers for pair in _stand_on(search, answer)):
        by_explanation[id(entry)] = (probability + by_explanation.get(id(entry), (0.0, entry))[0], entry)
    each = [pair for pair in by_explanation.values() if pair[0] > _COUNTS]
    total = sum(probability for probability, _ in each)
    if total < 0.5:
        return None
    parts = [_d33_under(search, problem, entry, probability).times(probability) for probability, entry in each]
    mixture = together(parts)
    declared = np.concatenate(
        [np.full(len(part.share), declared_d33(problem, entry)) for part, (_, entry) in zip(parts, each, strict=True)]
    )
    shares = mixture.share / mixture.share.sum()

    def ends(deviation: Floats) -> dict[str, float | None]:
        levels = {"value": 0.5, "low": 0.025, "high": 0.975}
        at = {key: mixture_quantile(level, shares, mixture.mean, deviation) for key, level in levels.items()}
        return {key: rounded(float(np.exp(place))) for key, place in at.items()}

    relative = np.hypot(mixture.deviation, unsure)
    unit = each[0][1].model.parameters[place_of(each[0][1], "d33")].unit
    alone = ends(relative)
    return {
        "name": "d33",
        "unit": unit,
        **ends(np.hypot(relative, declared)),
        "relative": {key: alone[key] for key in ("low", "high")},
    }


def _d33_under(search: Search, problem: FittingProblem, explanation: Explanation, probability: float) -> Normals:
    """ln d33 under an answer, at each level that a law of it may refer to, and with one more mechanism that does not
    show; the shares sum to 1."""
    place = place_of(explanation, "d33")
    best = explanation.best
    spread = over_spread(best.fitter, best.at, place)
    if spread is None:
        index = best.hypothesis.mean_places.index(place)
        deviation = np.sqrt(best.covariance[index, index])
        spread = [Normals(np.ones(1), explanation.point.fit[place : place + 1], np.array([deviation]))]
    several = list(spread)
    if probability > _WORTH_MORE:
        known = {frozenset(one.explanation.names) for one in search.answers if one.explanation is not None}
        others = [name for name in problem.lines.mechanisms.named if {name, *explanation.names} not in known]
        odds = UNSEEN_ODDS / max(search.supported - len(explanation.names), 1)
        for name in others:
            found = None if name in explanation.names else beside(problem, explanation, name, "d33")
            if found is not None:  # what declared facts say is as probable as its absence, and counts as it fits
                several.append(found if name in declared_laws(problem.lines) else found.times(odds * _as_unseen(found)))
    mixture = together(several)
    mixture = mixture.times(1 / float(mixture.share.sum()))
    levels = law_levels(problem, explanation)
    return together([mixture.moved(level).times(1 / len(levels)) for level in levels.tolist()])


def _as_unseen(found: Normals) -> float:
    """The factor that takes from a mechanism's shares what it would show by: no set of the answers holds it."""
    return min(1.0, float(np.exp(SHOWS) / found.share.sum()))


def _stand_on(search: Search, answer: Answer) -> list[tuple[float, Explanation]]:
    """The explanations of an answer, each with its probability: of `none_of_these` all laws that nobody listed which
    show, as they may have the same course and differ by what is d33."""
    if answer.explanation is not None:
        return [(answer.probability, answer.explanation)]
    laws = [entry for entry in search.laws if search.shows(entry)]
    weights = np.array([search.log_weight(entry) for entry in laws])
    shares = np.exp(weights - np.logaddexp.reduce(weights)) if laws else weights
    return [(answer.probability * float(share), entry) for share, entry in zip(shares, laws, strict=True)]


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
