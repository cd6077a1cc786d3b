"""The search over sets of mechanisms.

Sets of mechanisms fitted again from sets with one mechanism more.

A fit may be stuck where it would ask for a companion that is not there: beside that, the parameters of all find their
places, and keep them without it.

Which sets of mechanisms are fitted to curves beyond each mechanism alone, and from where.

A fit that begins at one mechanism's best parameters may end where another one's cannot be told: two that bend a curve
alike share the bend between them in many ways. So where the best set leaves more than noise, pairs are fitted again
from starts over the parameters of both.

Which sets of mechanisms are fitted; how probable each is, answers.py works out.

Priors over sets are fixed (priors.py). Singles are all fitted; pairs and triples grow greedily from the best, but all
pairs are fitted of curves, and of laws of declared values, material, contact and increment. The best are then fitted
again without each of their mechanisms; from what fits better for it, sets grow once more.

A second estimate of the lines' noise, without the course along frequency that a law describes.

On the flank of a resonance an FRF bends between two lines, and noise that is estimated from the roughness of the lines
(noise.py) comes out too large there, several times so where the flank moves with the preload. The level that all
lines share then falls, the others seem too noisy, and a law that adds variance (`mains_pickup`) is credited with the
difference. So the single mechanisms that act along frequency are fitted first; where one of them describes the lines,
the roughness is that of its residual. A smooth prediction removes no noise. All mechanisms are then compared under this
one estimate, though it was made beside one of them.

Several kinds of recordings in one campaign: explained together, unless they contradict each other.

That curves and FRFs are of one material is a hypothesis like any other: its rival, that each kind has a modulus and
strengths of its own, has the evidence of the kinds apart, with the same priors of what is missing, and a small prior:
another elastomer beside the skin's is rarer than a modulus that was declared wrong.
"""

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from underskin.diagnosis.data.dataset import lines
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.explanation import integrated as integrate
from underskin.diagnosis.inference.fit import LEVEL, SMOOTH, Fitter
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.other_kinds import CurveLikelihood, OtherKind, free_modulus_problem
from underskin.diagnosis.selection.priors import LARGEST, least_evidence
from underskin.mechanisms.base import Kind, Stage, Unsupported
from underskin.mechanisms.registry import ActiveCatalogue
from underskin.recordings.campaign import Campaign
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

_LEADING = 8.0  # nats behind the best within which sets are fitted again with one mechanism less
_STUCK = 1.0  # nats that a fit begun elsewhere must gain

Explanations = dict[frozenset[str], Explanation]  # by the names of their mechanisms


def was_stuck(before: Explanation | None, found: Explanation) -> bool:
    """Whether a set fits better as it is found now than before, where it was fitted at all."""
    return before is None or found.best.cost < before.best.cost - _STUCK


def refitted_from_larger(
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


_LEFT = 15.0  # nats of a smooth error: noise alone has 8 to 12, since the prior expects one
_ROUGHER = np.geomspace(1.0, 12.0, 12)  # times the level of the noise


def refitted_from_prior(problem: FittingProblem, explanations: Explanations, pairs: Sequence[Request]) -> Explanations:
    """The pairs that fit better from starts over the parameters of both than from one of the two alone, where the best
    set leaves something for that to matter."""
    best = min(explanations.values(), key=lambda entry: entry.best.cost)
    if smooth_error_gain(best) < _LEFT:
        return {}
    known = problem.lines.mechanisms
    requests = [
        Request(pair.names, begin=None if any(known[name].moves_contact_points for name in pair.names) else best.point)
        for pair in pairs
    ]
    better: Explanations = {}
    for request, found in zip(requests, problem.explain(requests, best.best.cost), strict=True):
        if found is not None and was_stuck(explanations.get(frozenset(request.names)), found):
            better[frozenset(request.names)] = found
    return better


def smooth_error_gain(explanation: Explanation) -> float:
    """Nats that a smooth error brings an explanation of curves over the least one and rougher noise: what it leaves."""
    fitter = Fitter([explanation.best.hypothesis])
    at = fitter.evaluate(fitter.at(explanation.point), slopes=False)
    points = at.points[np.zeros(len(_ROUGHER), dtype=np.intp)]
    covariance = points.covariance.copy()
    covariance[:, LEVEL] += np.log(_ROUGHER)
    covariance[:, SMOOTH] = explanation.best.hypothesis.covariance[SMOOTH].low
    without = fitter.evaluate(replace(points, covariance=covariance), slopes=False)
    return float(without.cost.min() - at.cost[0])


_PARENTS, _LARGEST = 3, 3
_BEST = 3  # sets whose evidence is integrated anyhow
_WITHIN = 6.0  # nats behind the best within which evidence is worth integrating: that moves it by less than 2
_OF_CONTACTS = (Stage.DECLARED, Stage.MATERIAL, Stage.CONTACT)  # that change contacts' stiffness
_PAIRED = (*_OF_CONTACTS, Stage.LOAD_INCREMENT)  # of which two may cancel, so that neither shows alone
_BEHIND = 12.0  # nats behind the best beyond which a single is no parent


def search(
    problem: FittingProblem, known: Sequence[Explanation] = (), required_sets: Sequence[frozenset[str]] = ()
) -> Search:
    """Fit nothing, every single, the `required_sets` of other kinds of recordings, then what grows from the best.

    What is `known` of them is taken over.
    """
    explained = {frozenset(entry.names): entry for entry in known}
    sets = _Sets(problem, explained, _unsupported(problem), required_sets)
    catalogue = problem.lines.mechanisms.named
    nothing, singles = Request(()), [Request((name,)) for name in sets.names]
    if problem.lines.curves:  # whose contact points the null hypothesis finds once for all
        sets.explain([nothing])
        singles = [replace(request, begin=sets.explanations[frozenset()].point) for request in singles]
    sets.explain([nothing, *singles])
    beside = [
        Request(tuple(name for name in catalogue if name in one), kept=True) for one in required_sets if len(one) > 1
    ]
    sets.explain(beside)
    largest = LARGEST if required_sets else _LARGEST
    sets.grow(largest)
    if sets.refit_smaller() and not problem.lines.curves:  # of which all pairs were fitted
        sets.grow(largest)
    sets.integrate(_BEST)
    return sets.search


def _unsupported(problem: FittingProblem) -> dict[str, str]:
    """The mechanisms that the recordings do not support, and what these lack."""
    unsupported: dict[str, str] = {}
    for name in problem.lines.mechanisms.named:
        try:
            problem.hypothesis((name,), has_position_scatter=False)
        except Unsupported as refusal:
            unsupported[name] = refusal.reason
    return unsupported


@dataclass
class _Sets:
    """The sets that were fitted so far, those that were `tried`, and those whose evidence is `integrated` over their
    loose parameters; other kinds of recordings `required_sets` some."""

    problem: FittingProblem
    explanations: Explanations
    unsupported: dict[str, str]
    required_sets: Sequence[frozenset[str]] = ()
    tried: set[frozenset[str]] = field(default_factory=set)
    integrated: set[frozenset[str]] = field(default_factory=set)

    @property
    def names(self) -> list[str]:
        """The mechanisms that the recordings support."""
        return [name for name in self.problem.lines.mechanisms.named if name not in self.unsupported]

    @property
    def search(self) -> Search:
        """All of them as rivals."""
        return Search(tuple(self.explanations.values()), self.unsupported, tried=len(self.tried))

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
                self.explanations |= refitted_from_prior(self.problem, self.explanations, requests)
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
        parents = _parents(self.search, size, self.required_sets)
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
        refitted = refitted_from_larger(self.problem, self.explanations, self.search.log_weight)
        self.explanations |= refitted
        self.integrated -= set(refitted)
        return bool(refitted)


def _parents(result: Search, size: int, required_sets: Sequence[frozenset[str]]) -> list[Explanation]:
    """The explanations, one mechanism smaller, from which sets of this size grow: the best of all, and of those that
    were asked for, some of which are larger."""
    ranked = sorted(result.explanations, key=result.log_weight, reverse=True)
    best = result.log_weight(ranked[0])
    if size > 2:
        own = next(entry for entry in ranked if len(entry.names) < size)
        asked = next(
            (one for one in ranked if len(one.names) == size - 1 and frozenset(one.names) in required_sets), own
        )
        return [one for one in ([own] if asked is own else [own, asked]) if len(one.names) == size - 1]
    smaller = [entry for entry in ranked if len(entry.names) == size - 1][:_PARENTS]
    return [entry for entry in smaller if result.log_weight(entry) > best - _BEHIND]


_SPEAKS = 10.0  # nats of evidence over the base model from which a law's course is taken off
_CHANGED = 0.03  # change of the noise of some line, relative, below which it stays as it was


def frf_problem(
    campaign: Campaign, uneven: Mapping[str, Floats], table: SigmaTable, mechanisms: ActiveCatalogue
) -> tuple[FittingProblem, list[Explanation]]:
    """The lines of a campaign's FRFs with their noise, ready to be explained; and the explanations that are known."""
    measured = replace(lines(campaign, uneven), mechanisms=mechanisms)
    mechanisms.bind(measured.campaign, table, "frf")
    problem = FittingProblem(measured, table)
    nothing, *singles = known = _along_frequency(problem)
    fixed = [one for one in singles if not any(entry.acts_on == "line_variance" for entry in one.model.parameters)]
    best = max(fixed, key=lambda entry: entry.log_evidence, default=nothing)
    if best.log_evidence <= nothing.log_evidence + _SPEAKS:
        return problem, known
    refined = lines(campaign, uneven, (problem.lines, best.best.prediction.value))
    refined = replace(refined, mechanisms=mechanisms)
    change = np.abs(refined.deviation / problem.lines.deviation - 1).max()
    return (FittingProblem(refined, table), []) if change > _CHANGED else (problem, known)


def _along_frequency(problem: FittingProblem) -> list[Explanation]:
    """Nothing, and the single mechanisms that act on lines apart."""
    requests = [Request(())]
    for name, mechanism in problem.lines.mechanisms.named.items():
        if "frf" not in mechanism.kinds or not mechanism.needs_lines:
            continue
        try:
            problem.hypothesis((name,), has_position_scatter=False)
        except Unsupported:
            continue
        requests.append(Request((name,)))
    return [entry for entry in problem.explain(requests) if entry is not None]


_ALSO = 2  # answers of recordings alone whose sets are tried together with those of the curves
_TOLD = 0.05  # standard deviation of the logarithm of a modulus that is told
_APART = 3e-3  # prior of kinds that are not of one material

# Recordings explained beside the curves of other kinds, with sets that are to be among those tried; or alone
Fitted = Callable[[CurveLikelihood | None, Sequence[frozenset[str]]], tuple[FittingProblem, Search]]


@dataclass(frozen=True)
class KindsTogether:
    """The recordings of the kind that gives the verdict, with what the others tell.

    `search` on the `problem` that stands; `apart` is the search on these recordings alone, None where there is no
    other kind; `contradictory` is the probability that the kinds are not of one material.
    """

    problem: FittingProblem
    search: Search
    beside: CurveLikelihood | None = None
    apart: Search | None = None
    contradictory: float = 0.0

    @property
    def apart_is_likelier(self) -> bool:
        """Whether the kinds contradict each other, so that each is explained alone."""
        return self.contradictory > 0.5

    def shows_on_curves(self, name: str, names: Sequence[str]) -> bool:
        """Whether a mechanism of a set shows on the recordings of another kind."""
        beside = self.search.other_kinds
        if beside is None:
            return False
        others = [other for other in names if other != name]
        both = [(beside.posterior(kind, names), beside.posterior(kind, others)) for kind in beside.kinds]
        return any(whole.log_weight > smaller.log_weight + least_evidence(whole.best) for whole, smaller in both)


class OtherKinds:
    """The curves of other kinds than the one that gives the verdict."""

    def __init__(self, campaigns: Mapping[Kind, Campaign], table: SigmaTable, without: Sequence[str]) -> None:
        """By kind; mechanisms `without` which all is to be explained."""
        self._campaigns, self._table, self._without = campaigns, table, without

    @cached_property
    def _kinds(self) -> list[OtherKind]:
        """Each searched as if it were alone."""
        found = []
        for kind, campaign in self._campaigns.items():
            problem = free_modulus_problem(campaign, kind, self._table, self._without)
            found.append(OtherKind(kind, problem, search(problem).explanations))
        return found

    def joined(self, fitted: Fitted) -> KindsTogether:
        """With the recordings that `fitted` explains, beside these or alone."""
        if not self._campaigns:
            return KindsTogether(*fitted(None, ()))
        alone, apart = fitted(None, ())
        beside = CurveLikelihood(self._kinds, apart.explanations)
        best = [frozenset(one.explanation.names) for one in apart.answers[:_ALSO] if one.explanation is not None]
        problem, together = fitted(beside, beside.required_sets(alone.lines, best))
        log_apart = _log_apart(apart, beside) + np.log(_APART)
        log_together = together.log_total + np.log1p(-_APART)
        contradictory = float(np.exp(log_apart - np.logaddexp(log_apart, log_together)))
        explained_alone = KindsTogether(alone, apart, beside, apart, contradictory)
        if explained_alone.apart_is_likelier:
            return explained_alone
        return KindsTogether(problem, replace(together, other_kinds=beside), beside, apart, contradictory)


def telling_modulus(joined: KindsTogether | None, names: Sequence[str]) -> frozenset[Kind]:
    """The other kinds that tell the modulus, under a set of mechanisms, as well as it must be known for d33."""
    if joined is None or joined.beside is None:
        return frozenset()
    beside = joined.beside
    return frozenset(kind.kind for kind in beside.kinds if beside.posterior(kind, names).modulus_deviation < _TOLD)


def _log_apart(apart: Search, beside: CurveLikelihood) -> float:
    """The logarithm of the sum over what recordings alone say, times what curves say with parameters of their own."""
    return float(
        np.logaddexp.reduce(
            [
                weight + sum(beside.log_evidence_apart(kind, entry.names, apart.supported) for kind in beside.kinds)
                for entry, weight in apart.weighed
            ]
        )
    )
