"""Laws that nobody listed, as rivals of the mechanisms: which are fitted, alone and beside named ones.

A score test (unnamed_screening.py) ranks them on top of nothing, of the best sets of mechanisms, and of what is left of
the best set without one member, for which a law may stand. The few that may matter are fitted like any other set. What
they gain on top of nothing is then tried beside each named mechanism, of FRFs alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.explanation import integrated as integrate
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.curve_law_screening import CurveScreening
from underskin.diagnosis.selection.priors import least_evidence
from underskin.diagnosis.selection.unnamed_screening import Score, Screening
from underskin.mechanisms.registry import CATALOGUE
from underskin.mechanisms.unnamed.grammar import Grammar, combination
from underskin.mechanisms.unnamed.laws import UnnamedLaw

_BENEATH = 1  # sets of mechanisms, the most probable, on top of which laws are tried, and nothing
_FITTED = 8  # laws at most
_BEHIND, _BEHIND_SHARE = (
    12.0,
    0.35,
)  # nats of the best by its score, or that share of what it gains, behind which none is
_MAY_MATTER = 6.0  # nats behind the most probable answer by its score
_ALONE_IN_COMPANY = 2  # laws that are tried beside every mechanism; of curves alone, whatever the mechanisms do
_ALONE = 5  # laws on FRFs that are tried alone where no set of mechanisms comes near
_FAR = 50.0  # nats that a law gains on top of the best set, where that took the wrong mechanisms for the law
_SHOWS_ALONE = 5.0  # nats
_OVER_SLOW = 25.0  # nats
_INTEGRATED, _WITHIN = 4, 6.0


def with_laws(problem: FittingProblem, search: Search) -> list[Explanation]:
    """The explanations that hold a law, fitted, of those that may matter; none of recordings that show too little."""
    nothing = next(entry for entry in search.explanations if not entry.names)
    ranked = sorted((entry for entry in search.explanations if search.shows(entry)), key=search.log_weight)[::-1]
    screening = _screening(problem, nothing, ranked[0])
    if screening is None:
        return []
    best = search.log_weight(ranked[0])
    candidates: list[tuple[float, Explanation, Score]] = []
    for beneath in _beneath(search, nothing, ranked):
        prior = search.log_prior_beneath(beneath)
        candidates += [
            (beneath.log_evidence + prior + score.gain + score.log_share, beneath, score)
            for score in _of_combinations(screening.scores(beneath))
        ]
    candidates.sort(key=lambda entry: -entry[0])
    least = candidates[0][0] - max(_BEHIND, _BEHIND_SHARE * (candidates[0][0] - best))
    chosen = [entry for entry in candidates[:_FITTED] if entry[0] > max(least, best - _MAY_MATTER)]
    alone = [entry for entry in candidates if entry[1] is nothing and entry[2].gain > _SHOWS_ALONE]
    if problem.lines.curves:  # of which many laws bend the force as named mechanisms do
        chosen += [entry for entry in alone[:_ALONE_IN_COMPANY] if entry not in chosen]
    elif candidates[0][0] > best + _FAR:
        chosen += [entry for entry in alone[:_ALONE] if entry not in chosen]
    fitted = _fitted(problem, [(beneath, score) for _, beneath, score in chosen])
    if not problem.lines.curves:
        fitted += _beside_named(problem, search, fitted)
    fitted += _without_company(problem, fitted)
    fitted.sort(key=search.log_weight, reverse=True)
    if problem.lines.curves:  # whose integrals take longer than all else, and move little
        return _beyond_slow_noise(problem, search, fitted)
    close = [entry for entry in fitted if search.log_weight(entry) > search.log_weight(fitted[0]) - _WITHIN]
    some = close[:_INTEGRATED]
    return [*integrate(some), *(entry for entry in fitted if entry not in some)] if some else []


def _beyond_slow_noise(problem: FittingProblem, search: Search, fitted: Sequence[Explanation]) -> list[Explanation]:
    """Of curves: where the air shows noise that neighbouring samples share, a law must bring more, since it bends to
    that."""
    smooth = problem.lines.smooth
    if smooth is None or not smooth.slow.any():
        return list(fitted)
    named = problem.lines.mechanisms.named
    known = {frozenset(entry.names): entry.log_evidence for entry in search.explanations}
    beneath = [known.get(frozenset(name for name in entry.names if name in named), -np.inf) for entry in fitted]
    return [entry for entry, less in zip(fitted, beneath, strict=True) if entry.log_evidence > less + _OVER_SLOW]


def _screening(problem: FittingProblem, nothing: Explanation, best: Explanation) -> Screening | CurveScreening | None:
    """Of recordings of this kind; None where no law follows what they have."""
    if problem.kind == "indentation":
        return CurveScreening(problem, nothing, best)
    if problem.kind != "frf":
        return None
    named = problem.lines.mechanisms.named
    beside = tuple(CATALOGUE.values())
    grammar = Grammar.of(problem.collapsed.campaign, problem.lines.frequency, problem.table, beside, named)
    return Screening(problem, grammar) if grammar.laws else None


def _beneath(search: Search, nothing: Explanation, ranked: Sequence[Explanation]) -> list[Explanation]:
    """On top of which laws are tried."""
    chosen = {nothing.names: nothing}
    named = [entry for entry in ranked if entry.names][:_BENEATH]
    known = {frozenset(entry.names): entry for entry in search.explanations}
    for entry in named:
        chosen[entry.names] = entry
    for entry in named[:1]:
        for name in entry.names:
            smaller = known.get(frozenset(entry.names) - {name})
            if smaller is not None:
                chosen[smaller.names] = smaller
    return list(chosen.values())


def _of_combinations(scores: Sequence[Score]) -> list[Score]:
    """The best of each combination of where, what and form."""
    best: dict[tuple[str, str, str], Score] = {}
    for score in scores:
        key = combination(score.law)
        if key not in best or score.gain + score.log_share > best[key].gain + best[key].log_share:
            best[key] = score
    return list(best.values())


def _fitted(problem: FittingProblem, chosen: Sequence[tuple[Explanation, Score]]) -> list[Explanation]:
    requests = []
    for beneath, score in chosen:
        _admit(problem, score)
        requests.append(Request((*beneath.names, score.law.name), beneath))
    explained = problem.explain(requests) if requests else []
    return [entry for entry in explained if entry is not None]


def _admit(problem: FittingProblem, score: Score) -> None:
    """Let models hold the law, and fits begin where the screening found it."""
    law = score.law
    law.log_share = score.log_share
    law.found = (*law.found, score.guess, *score.others)
    problem.lines.mechanisms.add(law)


def _beside_named(problem: FittingProblem, search: Search, fitted: Sequence[Explanation]) -> list[Explanation]:
    """The best laws that were fitted alone, beside each mechanism, where they may lead."""
    alone = [entry for entry in fitted if len(entry.names) == 1]
    alone = sorted(alone, key=search.log_weight, reverse=True)[:_ALONE_IN_COMPANY]
    known = {frozenset(entry.names) for entry in fitted}
    best = max((search.log_weight(entry) for entry in search.explanations), default=0.0)
    requests: list[Request] = []
    for entry in alone:
        if search.log_weight(entry) < best - _MAY_MATTER:
            continue
        requests += [
            Request((name, *entry.names), entry)
            for name in problem.lines.mechanisms.named
            if name not in search.unsupported and frozenset((name, *entry.names)) not in known
        ]
    explained = problem.explain(requests) if requests else []
    return [entry for entry in explained if entry is not None]


def _without_company(problem: FittingProblem, fitted: Sequence[Explanation]) -> list[Explanation]:
    """Laws without one of their companions, where that was not fitted: whether the companion shows is read from it."""
    known = {frozenset(entry.names) for entry in fitted}
    requests = []
    for entry in fitted:
        companions = [name for name in entry.names if name in problem.lines.mechanisms.named]
        for name in companions:
            rest = tuple(other for other in entry.names if other != name)
            if frozenset(rest) not in known:
                known.add(frozenset(rest))
                requests.append(Request(rest))
    explained = problem.explain(requests) if requests else []
    return [entry for entry in explained if entry is not None]


@dataclass(frozen=True)
class NearestLaw:
    """Of so many laws `tried` the fitted one that gains most on top of the best set of mechanisms, or of nothing; None
    where none gains anything."""

    tried: int
    explanation: Explanation | None


def nearest_law(problem: FittingProblem, search: Search) -> NearestLaw | None:
    """Of recordings that no law that shows describes; None where none could be."""
    nothing = next(entry for entry in search.explanations if not entry.names)
    best = max((entry for entry in search.explanations if search.shows(entry)), key=search.log_weight)
    screening = _screening(problem, nothing, best)
    if screening is None:
        return None
    chosen, tried = [], 0
    for beneath in (nothing, best) if best.names else (nothing,):
        scores = _of_combinations(screening.scores(beneath))
        chosen.append((beneath, max(scores, key=lambda score: score.gain)))
        tried = max(tried, len(scores))
    fitted = [*_fitted(problem, chosen), *search.laws]
    return NearestLaw(tried, max(fitted, key=lambda entry: entry.log_evidence, default=None))


def law_of(problem: FittingProblem, explanation: Explanation) -> UnnamedLaw | None:
    """The law that an explanation holds."""
    for name in explanation.names:
        mechanism = problem.lines.mechanisms[name]
        if isinstance(mechanism, UnnamedLaw):
            return mechanism
    return None


__all__ = ["NearestLaw", "law_of", "least_evidence", "nearest_law", "with_laws"]
