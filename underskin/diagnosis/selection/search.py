"""Which sets of mechanisms are fitted; `answers` makes their probabilities.

Nothing and every single are fitted. Sets of two and three guesses grow from the best, one mechanism at a time; in any
case all pairs are tried of curves, and of laws of declared values, material, contact and increment: two may cancel.
So may the laws that are no guesses, contact with the layer itself and its moving edge: every single is fitted beside
both. A fit that
begins at one mechanism's best parameters may end where the other one does not show, since two laws that bend a curve
alike can share that in many ways. So where the best set of curves leaves more than noise, their pairs are fitted again
from starts over the parameters of both.

Several kinds of recordings in one campaign are explained together, unless they contradict each other. That curves and
FRFs are of one material is a hypothesis: its rival, that each kind has a modulus and strengths of its own, has the
evidence of the kinds apart, with the same priors of what is missing, and a small prior, since another elastomer beside
the skin's is rarer than a modulus that was declared wrong.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from underskin.diagnosis.data.dataset import lines
from underskin.diagnosis.inference.evidence import NEGLIGIBLE_NATS
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.fit import Fitter, Scatter
from underskin.diagnosis.selection.answers import Search
from underskin.diagnosis.selection.other_kinds import CurveLikelihood, OtherKind, free_modulus_problem
from underskin.diagnosis.selection.priors import LARGEST, even_laws, least_evidence
from underskin.mechanisms.base import Kind, Stage, Unsupported
from underskin.mechanisms.laws.adhesion import Adhesion
from underskin.mechanisms.laws.layered_contact import LayeredContact
from underskin.mechanisms.laws.moving_contact_edge import MovingContactEdge
from underskin.mechanisms.registry import ActiveCatalogue
from underskin.recordings.campaign import Campaign
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats

_SMOOTH_ERROR = 15.0  # nats of a smooth error: noise alone has 8 to 12, since the prior expects one
_ROUGHER = np.geomspace(1.0, 12.0, 12)  # times the level of the noise
_DESCRIBES_LINES = 10.0  # nats of evidence over the base model from which a law's prediction is subtracted
_PARENTS, _LARGEST_OF_ONE_KIND = 3, 3
_PAIRED = (Stage.DECLARED, Stage.MATERIAL, Stage.CONTACT, Stage.LOAD_INCREMENT)  # of which two may cancel


def search(
    problem: FittingProblem, fitted: Sequence[Explanation] = (), required_sets: Sequence[frozenset[str]] = ()
) -> Search:
    """Fit nothing, every single, the `required_sets` of other kinds of recordings, then what grows from the best; sets
    that are `fitted` already are taken over."""
    sets = _Sets(problem, _unsupported(problem), required_sets, {frozenset(one.names): one for one in fitted})
    nothing, singles = Request(()), [Request((name,)) for name in sets.names]
    sets.explain([nothing])
    if problem.lines.curves:  # whose contact points the null hypothesis finds once for all
        singles = [replace(request, nuisances=sets.explanations[frozenset()].point) for request in singles]
    sets.explain(singles)
    together = [names for names in (*required_sets, sets.contact) if len(names) > 1]
    sets.explain([Request(sets.ordered(names), never_pruned=True) for names in together])
    for size in range(2, (LARGEST if required_sets or sets.contact else _LARGEST_OF_ONE_KIND) + 1):
        sets.grow(size)
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
    """The sets that were fitted so far, and those that were `tried`."""

    problem: FittingProblem
    unsupported: dict[str, str]
    required: Sequence[frozenset[str]]
    explanations: dict[frozenset[str], Explanation] = field(default_factory=dict)
    tried: set[frozenset[str]] = field(default_factory=set)

    @property
    def names(self) -> list[str]:
        """The mechanisms that the recordings support."""
        return [name for name in self.problem.lines.mechanisms.named if name not in self.unsupported]

    @property
    def contact(self) -> frozenset[str]:
        """Contact with the layer itself and its moving edge, where the recordings support both; else empty."""
        laws = frozenset({LayeredContact.name, MovingContactEdge.name})
        return laws if laws <= even_laws(laws, self.problem.lines) and laws <= {*self.names} else frozenset()

    @property
    def search(self) -> Search:
        """All of them as rivals."""
        return Search(tuple(self.explanations.values()), self.unsupported, tried=len(self.tried))

    def ordered(self, names: frozenset[str]) -> tuple[str, ...]:
        """In the order of the catalogue."""
        return tuple(name for name in self.problem.lines.mechanisms.named if name in names)

    def explain(self, requests: Sequence[Request], *, however_far: bool = False) -> None:
        """Add the explanations of sets that have none yet, from the first parent beside which the new mechanism shows;
        those far behind the best too if `however_far`."""
        self.tried |= {frozenset(request.names) for request in requests}
        costs = [] if however_far else [fitted.best.cost for fitted in self.explanations.values()]
        best = min(costs, default=np.inf)
        for request in requests:
            names = frozenset(request.names)
            explanation = None if names in self.explanations else self.problem.explain(request, best)
            if explanation is not None:
                self.explanations[names] = explanation
                best = best if however_far else min(best, explanation.best.cost)

    def grow(self, size: int) -> None:
        """Add sets of so many mechanisms: the best with one less, each with one more, and pairs that may cancel."""
        mechanisms, curves = self.problem.lines.mechanisms, self.problem.lines.curves
        if curves and size == 2:
            pairs = self._pairs(self.names)
            self.explain(pairs)
            self._refit_from_prior(pairs)
            self._refit_smaller()
            return
        requests = [
            Request(self.ordered(frozenset({*parent.names, name})), parent)
            for parent in self._parents(size)
            for name in self.names
            if name not in parent.names
        ]
        if size == 2:
            requests += self._pairs([name for name in self.names if mechanisms[name].stage in _PAIRED])
        self.explain(requests)
        if size == 3 and self.contact:
            best = max(self.explanations.values(), key=self.search.log_weight)
            parent = self.explanations.get(self.contact)
            beside = [
                Request(self.ordered(self.contact | {name}), parent)
                for name in self.names
                if name not in self.contact and (name in best.names or mechanisms[name].stage in _PAIRED)
            ]
            self.explain(beside, however_far=True)
        if curves:
            self._refit_smaller()

    def _pairs(self, names: Sequence[str]) -> list[Request]:
        """Every pair, from the better of its two."""
        requests = []
        for pair in itertools.combinations(names, 2):
            singles = [self.explanations[key] for name in pair if (key := frozenset([name])) in self.explanations]
            requests.append(Request(pair, max(singles, key=lambda single: single.log_evidence, default=None)))
        return requests

    def _parents(self, size: int) -> list[Explanation]:
        """The explanations, one mechanism smaller, from which sets of this size grow: the best of all, and the best of
        the required ones, some of which are larger."""
        weight = self.search.log_weight
        ranked = sorted(self.explanations.values(), key=weight, reverse=True)
        smaller = [fitted for fitted in ranked if len(fitted.names) == size - 1]
        if size == 2:
            return [fitted for fitted in smaller[:_PARENTS] if weight(fitted) > weight(ranked[0]) - NEGLIGIBLE_NATS]
        if size > _LARGEST_OF_ONE_KIND and not self.required:  # guesses, beside the laws that are none
            smaller = [fitted for fitted in smaller if self.contact <= frozenset(fitted.names)]
        best = next(fitted for fitted in ranked if len(fitted.names) < size)
        required = [fitted for fitted in smaller if frozenset(fitted.names) in self.required][:1]
        return [fitted for fitted in smaller if fitted is best or fitted in required]

    def _refit_from_prior(self, pairs: Sequence[Request]) -> None:
        """Fit pairs of curves from starts over the parameters of both, where the best set leaves something for that to
        matter; a fit that is better takes the place of the one from a single."""
        best = min(self.explanations.values(), key=lambda fitted: fitted.best.cost)
        if smooth_error_gain(best) < _SMOOTH_ERROR:
            return
        self._improve(
            [Request(pair.names, nuisances=None if Adhesion.name in pair.names else best.point) for pair in pairs]
        )

    def _refit_smaller(self) -> None:
        """Fit the sets with one mechanism less than the best one from its values: a law that hardly acts may have led
        the others out of a lesser minimum."""
        best = max(self.explanations.values(), key=self.search.log_weight)
        smaller = [frozenset(best.names) - {name} for name in best.names if len(best.names) > 1]
        self._improve([Request(self.ordered(names), larger=best) for names in smaller])

    def _improve(self, requests: Sequence[Request]) -> None:
        """Fits that are better take the place of those before."""
        best = min(fitted.best.cost for fitted in self.explanations.values())
        for request in requests:
            names = frozenset(request.names)
            smaller = [self.explanations[part] for name in names if (part := names - {name}) in self.explanations]
            rival = min(
                (self.explanations.get(names), *smaller), key=lambda fitted: fitted.best.cost if fitted else np.inf
            )
            self.tried.add(names)
            fitted = self.problem.explain(replace(request, rival=rival), best)
            if fitted is not None:
                self.explanations[names] = fitted


def smooth_error_gain(explanation: Explanation) -> float:
    """Nats that a smooth error brings an explanation of curves over the least one and rougher noise."""
    fitter = Fitter(explanation.best.hypothesis)
    at = fitter.evaluate(fitter.at(explanation.point), slopes=False)
    points = at.points[np.zeros(len(_ROUGHER), dtype=np.intp)]
    covariance = points.covariance.copy()
    covariance[:, Scatter.LEVEL] += np.log(_ROUGHER)
    covariance[:, Scatter.SMOOTH] = explanation.best.hypothesis.covariance[Scatter.SMOOTH].low
    without = fitter.evaluate(replace(points, covariance=covariance), slopes=False)
    return float(without.cost.min() - at.cost[0])


def frf_problem(
    campaign: Campaign, uneven: Mapping[str, Floats], table: SigmaTable, mechanisms: ActiveCatalogue
) -> tuple[FittingProblem, list[Explanation]]:
    """The lines of a campaign's FRFs with their noise, ready to be explained, and what was fitted to them.

    On the flank of a resonance an FRF bends between two lines, and noise that is estimated from the roughness of the
    lines comes out several times too large there. So the single mechanisms that act along frequency are fitted first;
    where one of them describes the lines far better than the base model, the roughness is that of its residual. All
    hypotheses are then compared under this noise.
    """
    measured = replace(lines(campaign, uneven), mechanisms=mechanisms)
    mechanisms.bind(measured.campaign, table, "frf")
    problem = FittingProblem(measured, table)
    unsupported = _unsupported(problem)
    names = [name for name, mechanism in mechanisms.named.items() if name not in unsupported and mechanism.needs_lines]
    fits = problem.explain_all([Request(()), *(Request((name,)) for name in names)])
    null, *singles = fitted = [fit for fit in fits if fit is not None]
    moving_mean = [
        single
        for single in singles
        if not any(parameter.acts_on == "line_variance" for parameter in single.model.parameters)
    ]
    best = max(moving_mean, key=lambda single: single.log_evidence, default=null)
    if best.log_evidence <= null.log_evidence + _DESCRIBES_LINES:
        return problem, fitted
    refined = lines(campaign, uneven, (problem.lines, best.best.prediction.value))
    return FittingProblem(replace(refined, mechanisms=mechanisms), table), []


_OF_THE_OTHERS = 2  # answers of the recordings alone whose sets are tried together with those of the curves
_DETERMINED = 0.05  # standard deviation of the logarithm of a modulus that is determined well enough for d33
_DIFFERENT_MATERIAL = 3e-3  # prior of kinds that are not of one material


@dataclass(frozen=True)
class KindsTogether:
    """The recordings of the kind that gives the verdict, with what the other kinds say.

    `search` on the `problem` that stands; `apart` is the search on these recordings alone, None where there is no
    other kind; `contradictory` is the probability that the kinds are not of one material.
    """

    problem: FittingProblem
    search: Search
    other_kinds: CurveLikelihood | None = None
    apart: Search | None = None
    contradictory: float = 0.0

    @property
    def apart_is_likelier(self) -> bool:
        """Whether the kinds contradict each other, so that each is explained alone."""
        return self.contradictory > 0.5

    def shows_on_curves(self, name: str, names: Sequence[str]) -> bool:
        """Whether a mechanism of a set shows on the recordings of another kind."""
        curves = self.search.other_kinds
        if curves is None:
            return False
        others = [other for other in names if other != name]
        both = [(curves.posterior(kind, names), curves.posterior(kind, others)) for kind in curves.kinds]
        return any(fit.log_weight > smaller.log_weight + least_evidence(fit.best) for fit, smaller in both)

    def determining_modulus(self, names: Sequence[str]) -> frozenset[Kind]:
        """The other kinds that determine the modulus, under a set of mechanisms, as well as d33 needs it."""
        curves = self.other_kinds
        if curves is None:
            return frozenset()
        kinds = ((kind.kind, curves.posterior(kind, names)) for kind in curves.kinds)
        return frozenset(kind for kind, posterior in kinds if posterior.modulus_deviation < _DETERMINED)


def searched_alone(campaigns: Mapping[Kind, Campaign], table: SigmaTable, without: Sequence[str]) -> list[OtherKind]:
    """The curves of other kinds than the one that gives the verdict, each searched as if it were alone; `without` are
    the mechanisms that are left out."""
    kinds = []
    for kind, campaign in campaigns.items():
        problem = free_modulus_problem(campaign, kind, table, without)
        alone = search(problem)
        kinds.append(OtherKind(kind, problem, alone.explanations, alone.unsupported))
    return kinds


def joined(problem: FittingProblem, kinds: Sequence[OtherKind], fitted: Sequence[Explanation] = ()) -> KindsTogether:
    """The recordings of the `problem`, of which some sets may be `fitted` already, together with the curves of other
    kinds or alone, whichever is more probable: both under the same noise."""
    apart = search(problem, fitted)
    if not kinds:
        return KindsTogether(problem, apart)
    curves = CurveLikelihood(kinds, apart.explanations)
    best = [
        frozenset(answer.explanation.names)
        for answer in apart.answers[:_OF_THE_OTHERS]
        if answer.explanation is not None
    ]
    joint = FittingProblem(problem.lines, problem.table, curves)
    together = search(joint, required_sets=curves.required_sets(problem.lines, best))
    log_apart = _log_apart(apart, curves) + np.log(_DIFFERENT_MATERIAL)
    log_together = together.log_total + np.log1p(-_DIFFERENT_MATERIAL)
    contradictory = float(np.exp(log_apart - np.logaddexp(log_apart, log_together)))
    alone = KindsTogether(problem, apart, curves, apart, contradictory)
    if alone.apart_is_likelier:
        return alone
    return KindsTogether(joint, replace(together, other_kinds=curves), curves, apart, contradictory)


def _log_apart(apart: Search, curves: CurveLikelihood) -> float:
    """The logarithm of the sum over what recordings alone say, times what curves say with parameters of their own."""
    return float(
        np.logaddexp.reduce(
            [
                weight + sum(curves.log_evidence_apart(kind, fitted.names, apart.supported) for kind in curves.kinds)
                for fitted, weight in apart.weighed
            ]
        )
    )
