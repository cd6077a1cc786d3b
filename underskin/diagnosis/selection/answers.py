"""Probabilities of sets of mechanisms, and the answers that they leave.

How probable each set of mechanisms that was fitted is, and the answers that follow.

Contacts that lie beyond the tables by the declared values: which of them the answers bring within.

Until E is known, a contact that is computed too wide, or too hard pressed, by a modulus that was declared too small
counts in every hypothesis, each of which predicts it, the null hypothesis by continuation of the tables. Contacts that
lie within the tables by answers that stand are kept; something undescribed counts by what is beneath it. The others are
left out, and the rest is diagnosed again: no answer is found by a continuation alone.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from underskin.diagnosis.data.names import NONE_OF_THESE, NOTHING_MISSING
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.selection.other_kinds import CurveLikelihood
from underskin.diagnosis.selection.priors import (
    log_prior_beneath_of,
    log_prior_of,
    must_gain,
)
from underskin.mechanisms.unlisted.laws import UnlistedLaw

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
    """What was tried: explanations, and what the campaign does not support."""

    explanations: tuple[Explanation, ...]
    unsupported: dict[str, str]
    other_tip: float = 0.0  # odds that tips have another shape than declared, beside the leading set
    laws: tuple[Explanation, ...] = ()  # sets with one law that nobody listed
    tried: int = 0  # sets, of which the explanations are those that were not left out early
    beside: CurveLikelihood | None = None  # curves of other kinds

    @property
    def supported(self) -> int:
        """How many mechanisms the campaign supports."""
        lines = self.explanations[0].best.hypothesis.lines
        return len(lines.mechanisms.named) - len(self.unsupported)

    def log_weight(self, explanation: Explanation) -> float:
        """Prior times evidence."""
        return explanation.log_evidence + self.log_prior(explanation)

    def log_prior(self, explanation: Explanation) -> float:
        """The logarithm of its prior; a law that nobody listed has its share of that of something undescribed."""
        known = explanation.best.hypothesis.lines.mechanisms
        laws = [known[name] for name in explanation.names if name not in known.named]
        if not laws:
            return log_prior_of(explanation, self.supported)
        prior = log_prior_beneath_of(explanation, self.supported, laws=1)
        return prior + sum(law.log_share for law in laws if isinstance(law, UnlistedLaw))

    def log_prior_beneath(self, explanation: Explanation) -> float:
        """The logarithm of the prior of a law that nobody listed on top of a set."""
        return log_prior_beneath_of(explanation, self.supported)

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
        """The explanation that an answer stands on: for `none_of_these` the best unlisted law, or else the best set of
        mechanisms."""
        if answer.explanation is not None:
            return answer.explanation
        if self.law is not None:
            return self.law
        return max(filter(self.is_supported, self.explanations), key=self.log_weight)

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

        `none_of_these` is always one of them, with its evidence where a law shows, and at least with the share that
        stays for what no law here can be.
        """
        supported = [entry for entry in self.explanations if self.is_supported(entry)]
        laws = [self.log_weight(entry) for entry in self.laws if self.is_supported(entry)]
        weights = np.array([*map(self.log_weight, supported), np.logaddexp.reduce(laws) if laws else -np.inf])
        probabilities = (1 - P_NOT_IN_MODEL_SPACE) * np.exp(weights - np.logaddexp.reduce(weights))
        probabilities[-1] += P_NOT_IN_MODEL_SPACE
        if self.other_tip:
            probabilities[-1] = max(probabilities[-1], self.other_tip * probabilities[:-1].max())
            probabilities /= probabilities.sum()
        answers = list(map(Answer, [*supported, None], probabilities.tolist()))
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
        """The sets that show, with the logarithm of prior times evidence."""
        return [(entry, self.log_weight(entry)) for entry in self.explanations if self.is_supported(entry)]

    @property
    def log_total(self) -> float:
        """The logarithm of the sum over all answers of prior times evidence."""
        return float(np.logaddexp.reduce([weight for _, weight in self.weighed]))


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
