"""Probabilities of sets of mechanisms, and the answers that they leave.

Odds between explanations that differ only in the widths of their priors.

The evidence of a set of mechanisms is the product of the likelihood at the best fit, the prior density of the values
there, and Occam's factor: the share of the prior's range that fits. The likelihood is what the recordings say, the
density what is known of materials and rigs. Occam's factor penalises extra parameters, and is needed where the null
hypothesis is compared with a mechanism, or one mechanism with two. Between sets of equally many mechanisms that fit
equally well, however, it would decide by the widths that were chosen for this catalogue.

So among sets of as many mechanisms as the leading one, none is less probable than that by Occam's factor alone: its
odds are at least e^(s − s_leader), at most 1, with s = log L + Σ log(prior/prior at its peak) at the best fit. Where
the evidences of two candidates for the lead differ by less than their accuracy, s decides.

How probable each set of mechanisms that was fitted is, and the answers that follow.

Contacts that lie beyond the tables by the declared values: which of them the answers bring within.

Until E is known, a contact that is computed too wide, or too hard pressed, by a modulus that was declared too small
counts in every hypothesis, each of which predicts it, the null hypothesis by continuation of the tables. Contacts that
lie within the tables by answers that stand are kept; something undescribed counts by what is beneath it. The others are
left out, and the rest is diagnosed again: no answer is found by a continuation alone.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from underskin.diagnosis.data.names import NONE_OF_THESE, NOTHING_MISSING
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.inference.hypothesis import own_places
from underskin.diagnosis.selection.gaussian_processes import Discrepancy
from underskin.diagnosis.selection.other_kinds import CurveLikelihood
from underskin.diagnosis.selection.priors import (
    declared_laws,
    guesses,
    least_evidence,
    log_prior_beneath_of,
    log_prior_of,
    must_gain,
)
from underskin.mechanisms.unlisted.laws import UnlistedLaw
from underskin.units import Floats

_BEHIND = 1e-6  # of an equal: the leader stays the leader
_ACCURACY = 0.1  # of Laplace's method, in nats


def fit_and_plausibility(explanation: Explanation) -> float:
    """s: the log posterior density at the best fit, were each own parameter's prior 1 at its peak."""
    places = own_places(explanation.names, explanation.best.hypothesis.lines)
    own = [entry for place in places.values() for entry in explanation.model.parameters[place]]
    return -explanation.best.cost - sum(entry.log_prior(entry.start) for entry in own)


def without_occam(explanations: Sequence[Explanation], log_weights: Sequence[float], sizes: Sequence[int]) -> Floats:
    """The weights, those of the leader's equals in size raised to what fit and plausibility say of them; `sizes` count
    the mechanisms that are guesses."""
    weights = np.array(log_weights)
    first = _leader(explanations, weights, sizes)
    leader = explanations[first]
    weights[first] = weights.max()
    for number, rival in enumerate(explanations):
        if sizes[number] and sizes[number] == sizes[first] and number != first:
            gap = fit_and_plausibility(rival) - fit_and_plausibility(leader)
            raised = max(weights[number], weights[first] + gap)
            weights[number] = min(raised, weights[first] - _BEHIND)
    return weights


def _leader(explanations: Sequence[Explanation], weights: Floats, sizes: Sequence[int]) -> int:
    """The place of the one of largest weight, or among its equals in weight and size of the best fit."""
    first = int(np.argmax(weights))
    equals = [
        number
        for number in np.flatnonzero(weights > weights[first] - _ACCURACY).tolist()
        if sizes[number] and sizes[number] == sizes[first]
    ]
    return max(equals, key=lambda number: fit_and_plausibility(explanations[number]), default=first)


_OF_LAWS = 0.7  # of "none of these": laws of one form over one axis; the rest are processes of any course
_CONTRADICTED_CURVE_FACTOR = 0.05  # of the probability of a set of mechanisms that leaves structure in a curve
P_NOT_IN_MODEL_SPACE = 0.015  # probability that none of what was compared is right
_EQUAL = 0.01  # nats, within which laws are equally probable


@dataclass(frozen=True)
class Answer:
    """One of the rivals and its posterior probability: a set of mechanisms (maybe none), or `none_of_these`."""

    explanation: Explanation | None  # None for none_of_these
    probability: float
    alone: tuple[str, ...] = ()  # mechanisms that act on curves beside alone

    @property
    def names(self) -> tuple[str, ...]:
        """As a report names it."""
        if self.explanation is None:
            return (NONE_OF_THESE,)
        return (*self.explanation.names, *self.alone) or (NOTHING_MISSING,)

    @property
    def kind(self) -> str:
        """What it is one of: nothing missing, something without a name, or sets of known mechanisms ("")."""
        return self.names[0] if self.names in ((NOTHING_MISSING,), (NONE_OF_THESE,)) else ""


def leading_first(ranked: Sequence[Answer]) -> list[Answer]:
    """Answers, the most probable first, with the first one of the most probable kind before all others."""
    of_kinds: dict[str, float] = {}
    for answer in ranked:
        of_kinds[answer.kind] = of_kinds.get(answer.kind, 0.0) + answer.probability
    most = max(of_kinds, key=lambda kind: of_kinds[kind])
    leader = next(answer for answer in ranked if answer.kind == most)
    return [leader, *(answer for answer in ranked if answer is not leader)]


@dataclass(frozen=True)
class Search:
    """What was tried: explanations, processes on top of some of them, and what the campaign does not support.

    `contradicted`: sets under which the residual keeps structure, or its noise is no noise (see cross_validation.py);
    their probability, or of curves most of it, is that of `none_of_these`. `imitating`: the odds of an unlisted law
    that looks like a set on these recordings, or does not show; `none_of_these` has them beside the leading set.
    """

    explanations: tuple[Explanation, ...]
    discrepancies: tuple[tuple[Explanation, Discrepancy], ...]
    unsupported: dict[str, str]
    contradicted: frozenset[tuple[str, ...]] = frozenset()
    imitating: Mapping[tuple[str, ...], float] = field(default_factory=dict)
    laws: tuple[Explanation, ...] = ()  # sets with one law that nobody listed
    tried: int = 0  # sets, of which the explanations are those that were not left out early
    beside: CurveLikelihood | None = None  # curves of other kinds

    @property
    def supported(self) -> int:
        """How many mechanisms the campaign supports."""
        lines = self.explanations[0].best.hypothesis.lines
        return len(lines.mechanisms.named) - len(self.unsupported)

    def log_weight(self, explanation: Explanation) -> float:
        """Prior times evidence; a law that nobody listed gains nothing by a narrower prior than mechanisms have."""
        weight = explanation.log_evidence + self.log_prior(explanation)
        if not self._holds_law(explanation):
            return weight
        rival = self._rival_of_size.get(len(explanation.names))
        occam = explanation.log_evidence - fit_and_plausibility(explanation)
        return weight if rival is None else weight - max(0.0, occam - rival)

    @cached_property
    def _rival_of_size(self) -> dict[int, float]:
        """Occam's factor of the best set of mechanisms of each size, in nats."""
        best: dict[int, Explanation] = {}
        for entry in self.explanations:
            size = len(entry.names)
            if size not in best or entry.log_evidence > best[size].log_evidence:
                best[size] = entry
        return {size: entry.log_evidence - fit_and_plausibility(entry) for size, entry in best.items()}

    @staticmethod
    def _holds_law(explanation: Explanation) -> bool:
        known = explanation.best.hypothesis.lines.mechanisms
        return any(name not in known.named for name in explanation.names)

    def log_prior(self, explanation: Explanation) -> float:
        """The logarithm of its prior; a law that nobody listed has its share of that of something undescribed."""
        known = explanation.best.hypothesis.lines.mechanisms
        laws = [known[name] for name in explanation.names if name not in known.named]
        if not laws:
            return log_prior_of(explanation, self.supported)
        prior = log_prior_beneath_of(explanation, self.supported, laws=1)
        return prior + math.log(_OF_LAWS) + sum(law.log_share for law in laws if isinstance(law, UnlistedLaw))

    def log_prior_beneath(self, explanation: Explanation) -> float:
        """The logarithm of the prior of a law that nobody listed on top of a set."""
        return log_prior_beneath_of(explanation, self.supported) + math.log(_OF_LAWS)

    def is_supported(self, explanation: Explanation) -> bool:
        """Whether each mechanism of a set shows: without it, evidence is lost. A set that holds one that does not says
        no more than the smaller one, which stands for both."""
        evidence = {frozenset(entry.names): entry.log_evidence for entry in (*self.explanations, *self.laws)}
        whole = frozenset(explanation.names)
        return all(
            explanation.log_evidence > evidence.get(whole - {name}, -math.inf) + must_gain(explanation, name)
            for name in whole
        )

    def fit_behind(self, answer: Answer) -> Explanation:
        """The explanation that an answer stands on: for `none_of_these` the best law that nobody listed, or else the
        one beneath its best process."""
        if answer.explanation is not None:
            return answer.explanation
        if self.law is not None:
            return self.law
        beneath = [pair for pair in self.discrepancies if self.is_supported(pair[0])]
        return max(beneath, key=lambda pair: self._log_weight_beneath(*pair))[0]

    def _log_weight_beneath(self, explanation: Explanation, process: Discrepancy) -> float:
        prior = log_prior_beneath_of(explanation, self.supported) + math.log(1 - _OF_LAWS)
        return process.log_evidence + prior

    @cached_property
    def processes_showing(self) -> list[tuple[Explanation, float]]:
        """The set beneath each process that shows, and the logarithm of its prior times evidence."""
        return [
            (entry, self._log_weight_beneath(entry, process))
            for entry, process in self.discrepancies
            if process.log_evidence > entry.log_evidence + least_evidence(entry)
        ]

    @cached_property
    def law(self) -> Explanation | None:
        """The most probable set with a law that nobody listed, each member of which shows.

        Of equals that over the order of the recordings, which times and load cycles follow.
        """
        showing = [entry for entry in self.laws if self.is_supported(entry)]
        best = max(map(self.log_weight, showing), default=0.0)
        equal = [entry for entry in showing if self.log_weight(entry) > best - _EQUAL]
        return max(equal, key=lambda entry: (self._follows_order(entry), self.log_weight(entry)), default=None)

    @staticmethod
    def _follows_order(explanation: Explanation) -> bool:
        known = explanation.best.hypothesis.lines.mechanisms
        laws = [known[name] for name in explanation.names]
        return any(isinstance(law, UnlistedLaw) and law.description.axis == "order" for law in laws)

    @cached_property
    def answers(self) -> list[Answer]:
        """The rivals, the leading one first and then the most probable; their probabilities sum to 1.

        Of nothing, all sets of known mechanisms, and what has no name, the most probable leads, and of sets the most
        probable one: what many sets share is no reason to say that no known mechanism describes it.

        `none_of_these` is always one of them, with its evidence where a process shows, and at least with the share that
        stays for what neither laws nor processes here can be.
        """
        kept = [entry for entry in self.explanations if self.is_supported(entry)]
        sizes = [guesses(entry) for entry in kept]
        weights = without_occam(kept, [self.log_weight(entry) for entry in kept], sizes).tolist()
        for entry, weight in self._possible_beside(kept, weights):
            kept.append(entry)
            weights.append(weight)
        showing = [weight for _, weight in self.processes_showing]
        showing += [self.log_weight(entry) for entry in self.laws if self.is_supported(entry)]
        weights.append(float(np.logaddexp.reduce(showing)) if showing else -math.inf)
        probabilities = (1 - P_NOT_IN_MODEL_SPACE) * np.exp(np.array(weights) - np.logaddexp.reduce(weights))
        probabilities[-1] += P_NOT_IN_MODEL_SPACE
        left = [self._contradiction_factor(entry) for entry in kept]
        probabilities[-1] += ((1 - np.array(left)) * probabilities[:-1]).sum()
        probabilities = self._beside_unlisted(kept, probabilities * [*left, 1.0])
        rivals: list[Explanation | None] = [*kept, None]
        answers = [
            Answer(rivals[number], float(probabilities[number])) for number, share in enumerate([*left, 1.0]) if share
        ]
        if self.beside is not None:
            answers = [one for answer in answers for one in self._with_own_of_curves(answer, self.beside)]
        return leading_first(sorted(answers, key=lambda answer: -answer.probability))

    @staticmethod
    def _with_own_of_curves(answer: Answer, beside: CurveLikelihood) -> list[Answer]:
        """An answer with each set of mechanisms that act on the curves alone."""
        if answer.explanation is None:
            return [answer]
        each = beside.alone(answer.explanation.names)
        return [Answer(answer.explanation, answer.probability * share, alone) for alone, share in each if share > 1e-6]

    @property
    def weighed(self) -> list[tuple[Explanation, float]]:
        """The sets that show, and those beneath the processes that show, with the logarithm of prior times evidence."""
        showing = [(entry, self.log_weight(entry)) for entry in self.explanations if self.is_supported(entry)]
        return [*showing, *self.processes_showing]

    @property
    def log_total(self) -> float:
        """The logarithm of the sum over all answers of prior times evidence."""
        return float(np.logaddexp.reduce([weight for _, weight in self.weighed]))

    def _possible_beside(
        self, kept: Sequence[Explanation], weights: Sequence[float]
    ) -> list[tuple[Explanation, float]]:
        """Of indentations: the sets with one mechanism more than one of these that gain evidence, but less than shows.

        So little is no evidence, as laws of contact idealise, but no reason against the mechanism either: beside the
        smaller set each has the weight of its prior.
        """
        if self.explanations[0].best.hypothesis.lines.kind != "indentation":
            return []
        evidence = {frozenset(entry.names): entry.log_evidence for entry in self.explanations}
        own = {frozenset(entry.names): (entry, weight) for entry, weight in zip(kept, weights, strict=True)}
        declared = declared_laws(kept[0].best.hypothesis.lines)
        possible = []
        for entry in self.explanations:
            whole = frozenset(entry.names)
            smaller = [whole - {name} for name in whole - declared if whole - {name} in own]
            if whole in own or not smaller or any(evidence[less] >= entry.log_evidence for less in smaller):
                continue
            each = [
                weight + self.log_prior(entry) - self.log_prior(less) for less, weight in map(own.__getitem__, smaller)
            ]
            possible.append((entry, max(each)))
        return possible

    def _contradiction_factor(self, explanation: Explanation) -> float:
        """The share that stays of a probability: all, unless the residual contradicts the explanation; of curves a
        little even then, since laws of contact idealise and fits may miss."""
        if explanation.names not in self.contradicted:
            return 1.0
        return _CONTRADICTED_CURVE_FACTOR if explanation.names and explanation.best.hypothesis.lines.curves else 0.0

    def _beside_unlisted(self, kept: Sequence[Explanation], probabilities: Floats) -> Floats:
        """With at least the unlisted laws that the leading set imitates among `none_of_these`, the last: some of them
        were fitted."""
        rivals = [*kept, None]
        order = np.argsort(-probabilities, kind="stable").tolist()
        ranked = leading_first([Answer(rivals[number], float(probabilities[number])) for number in order])
        if ranked[0].explanation is None:
            return probabilities
        leader = next(number for number, entry in enumerate(kept) if entry is ranked[0].explanation)
        beside = probabilities.copy()
        beside[-1] = max(beside[-1], self.imitating.get(kept[leader].names, 0.0) * probabilities[leader])
        return np.asarray(beside / beside.sum())


_STANDS = 0.2  # probability of all answers together by which a contact lies within


def inside_tables_under_posterior(problem: FittingProblem, result: Search) -> frozenset[str]:
    """The ids of the recordings whose contacts lie within the tables by answers that stand."""
    entries = problem.lines.campaign.recordings
    within = np.zeros(len(entries))
    for answer in result.answers:
        best = result.fit_behind(answer).best
        outside = np.unique(best.hypothesis.lines.recording[~best.prediction.inside])
        within[np.isin(np.arange(len(entries)), outside, invert=True)] += answer.probability
    return frozenset(entries[number].id for number in np.flatnonzero(within > _STANDS).tolist())
