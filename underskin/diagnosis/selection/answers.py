"""Probabilities of sets of mechanisms, and the answers that they leave.

The probability of a set is its prior times its evidence over the sum of all; a set that holds a mechanism which does
not show says no more than the smaller one, which stands for both. Sets with an unlisted law make up `none_of_these`.

Evidence is likelihood at the best fit, times the prior density there, times Occam's factor: the share of the prior's
range that fits. That factor penalises extra parameters, but between sets of equally many mechanisms that fit equally
well it would decide by the widths that were chosen for this catalogue. So among sets of as many mechanisms as the
leading one none is less probable than that by Occam's factor alone, and a set with an unlisted law has at most the
factor of the best set of mechanisms of its size.

Until E is known, a contact that is computed beyond the tables, by a modulus that was declared too small, counts in
every hypothesis: each predicts it, the null hypothesis by continuation of the tables. Contacts that lie within the
tables under answers of some probability are kept; the others are left out and the rest is diagnosed again.
"""

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from underskin.diagnosis.data.names import NONE_OF_THESE, NOTHING_MISSING
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem
from underskin.diagnosis.noise import DISCREPANCY, USUAL
from underskin.diagnosis.selection.other_kinds import CurveLikelihood
from underskin.diagnosis.selection.priors import (
    edge_gain,
    even_laws,
    guess_count,
    log_prior,
    log_prior_of,
    log_prior_of_discrepancy,
    must_gain,
)
from underskin.mechanisms.unlisted.laws import UnlistedLaw

P_NOT_IN_MODEL_SPACE = 0.015  # probability that none of what was compared is right
_EQUAL = 0.01  # nats, within which laws are equally probable: those of one course over two axes
_NEGLIGIBLE = 1e-6  # probability of a set of mechanisms of the curves alone
_ABOVE_NOISE, _LEAST_REMAINDER = 2.0, 3e-3  # times the noise, and of the largest force
_ACCURACY = 0.1  # of Laplace's method [nats]: sets of equal size whose evidences differ by less are ranked by their fit
_LEAST_GAP = 1e-6  # by which a leading set stays in front of its equals [nats]
_STANDS = 0.2  # probability of all answers together by which a contact lies within the tables


@dataclass(frozen=True)
class Answer:
    """A set of mechanisms, maybe none, or `none_of_these`, and its posterior probability."""

    explanation: Explanation | None  # None for none_of_these
    probability: float
    alone: tuple[str, ...] = ()  # further mechanisms, which act on the curves of another kind alone

    @property
    def names(self) -> tuple[str, ...]:
        """As a report names it."""
        if self.explanation is None:
            return (NONE_OF_THESE,)
        return (*self.explanation.names, *self.alone) or (NOTHING_MISSING,)

    @property
    def outcome(self) -> str:
        """`nothing_missing`, `none_of_these`, or "" of sets of mechanisms."""
        return self.names[0] if self.names in ((NOTHING_MISSING,), (NONE_OF_THESE,)) else ""


def leading_first(ranked: Sequence[Answer]) -> list[Answer]:
    """Answers, the most probable first, with the first one of the most probable outcome before all others."""
    by_outcome = defaultdict[str, float](float)
    for answer in ranked:
        by_outcome[answer.outcome] += answer.probability
    most = max(by_outcome, key=lambda outcome: by_outcome[outcome])
    leader = next(answer for answer in ranked if answer.outcome == most)
    return [leader, *(answer for answer in ranked if answer is not leader)]


def fit_and_plausibility(explanation: Explanation) -> float:
    """Log likelihood plus log prior density at the best fit, the latter relative to the priors' peaks."""
    parameters = [parameter for span in explanation.spans.values() for parameter in explanation.model.parameters[span]]
    return -explanation.best.cost - sum(parameter.log_prior(parameter.start) for parameter in parameters)


def _log_occam(explanation: Explanation) -> float:
    """The logarithm of Occam's factor."""
    return explanation.log_evidence - fit_and_plausibility(explanation)


def without_occam(fits: Sequence[tuple[Explanation, float]]) -> list[float]:
    """The log weights of sets, those of as many guesses as the leading one raised to what fit and plausibility give
    beside it, if that is more; the leading one stays in front."""
    weights = np.array([weight for _, weight in fits])
    sizes = np.array([guess_count(fitted) for fitted, _ in fits])
    highest = weights.max()
    equal = (sizes == sizes[np.argmax(weights)]) & (sizes > 0)
    if not equal.any():
        return weights.tolist()
    merit = np.array([fit_and_plausibility(fitted) for fitted, _ in fits])
    leader = int(np.argmax(np.where(equal & (weights > highest - _ACCURACY), merit, -np.inf)))
    raised = np.minimum(np.maximum(weights, highest + merit - merit[leader]), highest - _LEAST_GAP)
    weights = np.where(equal, raised, weights)
    weights[leader] = highest
    return weights.tolist()


def remainder(explanation: Explanation) -> tuple[float, float] | None:
    """Of curves: the smooth residual over the largest force, and over a sample's noise, which is at least that by
    differences of neighbouring samples; None where it does not stand out."""
    levels, lines = explanation.best.levels, explanation.best.hypothesis.lines
    if lines.smooth is None:
        return None
    noise = max(levels.level, 1.0) * float(np.median(lines.deviation / lines.smooth.scale))
    stands_out = levels.smooth > max(_ABOVE_NOISE * noise, _LEAST_REMAINDER)
    return (levels.smooth, levels.smooth / noise) if stands_out else None


@dataclass(frozen=True)
class Search:
    """Everything that was fitted, and the mechanisms that the campaign does not support, with what it lacks."""

    explanations: tuple[Explanation, ...]
    unsupported: dict[str, str]
    laws: tuple[Explanation, ...] = ()  # sets with one unlisted law
    tried: int = 0  # sets, of which the explanations are those that were not pruned
    other_kinds: CurveLikelihood | None = None
    unlisted_odds: float = 0.0  # least odds of what is unlisted beside the leading set

    @property
    def null(self) -> Explanation:
        """The null hypothesis."""
        return next(fitted for fitted in self.explanations if not fitted.names)

    @property
    def supported(self) -> int:
        """How many mechanisms the campaign supports."""
        lines = self.explanations[0].best.hypothesis.lines
        return len(lines.mechanisms.named) - len(self.unsupported)

    def log_prior(self, explanation: Explanation) -> float:
        """The logarithm of its prior; an unlisted law has its share of that of something unlisted."""
        mechanisms = explanation.best.hypothesis.lines.mechanisms
        laws = [mechanisms[name] for name in explanation.names if name not in mechanisms.named]
        if not laws:
            return log_prior_of(explanation, self.supported)
        prior = log_prior_of_discrepancy(explanation, self.supported, laws=1)
        return prior + sum(law.log_share for law in laws if isinstance(law, UnlistedLaw))

    def log_prior_beneath(self, explanation: Explanation) -> float:
        """The logarithm of the prior of an unlisted law on top of a set."""
        return log_prior_of_discrepancy(explanation, self.supported)

    def log_weight(self, explanation: Explanation) -> float:
        """The logarithm of prior times evidence; a set with an unlisted law has at most the Occam factor of the best
        set of mechanisms of its size."""
        weight = explanation.log_evidence + self.log_prior(explanation)
        mechanisms = explanation.best.hypothesis.lines.mechanisms
        largest = self._log_occam_by_size.get(len(explanation.names))
        if largest is None or all(name in mechanisms.named for name in explanation.names):
            return weight
        return weight - max(0.0, _log_occam(explanation) - largest)

    @cached_property
    def _log_occam_by_size(self) -> dict[int, float]:
        """The logarithm of Occam's factor of the best set of mechanisms of each size."""
        best: dict[int, Explanation] = {}
        for fitted in sorted(self.explanations, key=lambda fitted: fitted.log_evidence):
            best[len(fitted.names)] = fitted
        return {size: _log_occam(fitted) for size, fitted in best.items()}

    @cached_property
    def _fits(self) -> dict[frozenset[str], Explanation]:
        return {frozenset(fitted.names): fitted for fitted in (*self.explanations, *self.laws)}

    def is_supported(self, explanation: Explanation) -> bool:
        """Whether each mechanism of a set shows: without it, or all that are no guesses, evidence is lost."""
        return not self._unsupported_parts(explanation)

    def _unsupported_parts(self, explanation: Explanation) -> list[frozenset[str]]:
        """The mechanisms of a set, and those that are no guesses together, without which no evidence is lost."""
        names = frozenset(explanation.names)
        even = names & even_laws(names, explanation.best.hypothesis.lines)
        parts = [frozenset([name]) for name in names] + [even] * bool(even)  # any of these may need another
        unsupported = []
        for part in parts:
            smaller = self._fits.get(names - part)
            if smaller is None:
                continue
            gain = explanation.log_evidence - smaller.log_evidence
            if not part & even:  # the edge of both sets has the same prior
                gain += self._edge_gain(explanation) - self._edge_gain(smaller)
            if not gain > max(must_gain(explanation, name) for name in part):
                unsupported.append(part)
        return unsupported

    def _edge_gain(self, explanation: Explanation) -> float:
        supported = max(self.supported, 1)  # no set has an edge where nothing is supported
        return edge_gain(explanation, log_prior(1, supported) - log_prior(0, supported))

    def _standing(self, fits: Sequence[Explanation]) -> list[tuple[Explanation, float, float]]:
        """The sets that show, with the logarithms of prior times evidence, and of the sum of this over the sets that it
        stands for.

        A law that is no guess is integrated over where it does not show: for a set that holds such a law beside what
        shows, the likeliest set without it stands.
        """
        beside = {frozenset(fitted.names): -math.inf for fitted in fits if self.is_supported(fitted)}
        for fitted in fits:
            names = frozenset(fitted.names)
            even = even_laws(names, fitted.best.hypothesis.lines)
            if names in beside or not all(part <= even for part in self._unsupported_parts(fitted)):
                continue
            smaller = [part for part in beside if part < names and names - part <= even]
            if smaller:
                stands = max(smaller, key=lambda part: self._fits[part].log_evidence)
                beside[stands] = float(np.logaddexp(beside[stands], self.log_weight(fitted)))
        return [
            (fitted, self.log_weight(fitted), beside[names])
            for fitted in fits
            if (names := frozenset(fitted.names)) in beside
        ]

    @cached_property
    def _named(self) -> list[tuple[Explanation, float, float]]:
        return self._standing(self.explanations)

    @property
    def weighed(self) -> list[tuple[Explanation, float]]:
        """The sets of mechanisms that show, with the logarithm of prior times evidence, of those that each stands for
        too."""
        return [(fitted, float(np.logaddexp(weight, others))) for fitted, weight, others in self._named]

    @property
    def log_total(self) -> float:
        """The logarithm of the sum over these sets of prior times evidence."""
        return float(np.logaddexp.reduce([weight for _, weight in self.weighed]))

    @cached_property
    def weighed_laws(self) -> list[tuple[Explanation, float]]:
        """The sets with an unlisted law that show, the same way."""
        return [(fitted, float(np.logaddexp(weight, others))) for fitted, weight, others in self._standing(self.laws)]

    @cached_property
    def law(self) -> Explanation | None:
        """The most probable set with an unlisted law; of equals that over the order of the recordings, which times and
        load cycles follow."""
        best = max((weight for _, weight in self.weighed_laws), default=0.0)
        equal = [pair for pair in self.weighed_laws if pair[1] > best - _EQUAL]
        return max(equal, key=lambda pair: (self._follows_order(pair[0]), pair[1]), default=(None, 0.0))[0]

    @staticmethod
    def _follows_order(explanation: Explanation) -> bool:
        mechanisms = explanation.best.hypothesis.lines.mechanisms
        members = [mechanisms[name] for name in explanation.names]
        return any(isinstance(law, UnlistedLaw) and law.description.axis == "order" for law in members)

    def fit_behind(self, answer: Answer) -> Explanation:
        """The explanation that an answer stands on: for `none_of_these` the best unlisted law, or else the best set of
        mechanisms."""
        if answer.explanation is not None:
            return answer.explanation
        return self.law if self.law is not None else max(self.weighed, key=lambda pair: pair[1])[0]

    @cached_property
    def answers(self) -> list[Answer]:
        """The rivals, the leading one first and then the most probable; their probabilities sum to 1.

        Of nothing, all sets of known mechanisms, and none of these, the most probable leads, and of sets the most
        probable one: what many sets share is no reason to say that no known mechanism describes it.
        """
        named, unlisted = list(self.weighed), list(self.weighed_laws)
        unlisted += [(fitted, weight + self._log_odds_of_discrepancy(fitted)) for fitted, weight in self.weighed]
        log_unlisted = np.logaddexp.reduce([weight for _, weight in unlisted]) if unlisted else -np.inf
        if named:
            raised = without_occam([(fitted, weight) for fitted, weight, _ in self._named])
            named = [
                (fitted, float(np.logaddexp(weight, others)))
                for (fitted, _, others), weight in zip(self._named, raised, strict=True)
            ]
        weights = np.array([*(weight for _, weight in named), log_unlisted])
        probabilities = (1 - P_NOT_IN_MODEL_SPACE) * np.exp(weights - np.logaddexp.reduce(weights))
        probabilities[-1] += P_NOT_IN_MODEL_SPACE
        probabilities[-1] = max(probabilities[-1], self.unlisted_odds * probabilities[:-1].max(initial=0.0))
        probabilities /= probabilities.sum()
        answers = list(map(Answer, [*(fitted for fitted, _ in named), None], probabilities.tolist()))
        answers = [part for answer in answers for part in self._by_curves_alone(answer)]
        return leading_first(sorted(answers, key=lambda answer: -answer.probability))

    def _log_odds_of_discrepancy(self, fitted: Explanation) -> float:
        """Log odds that the smooth error beside a set is of a law that is missing, and not the idealisation of its own;
        −∞ of FRFs."""
        if fitted.best.hypothesis.lines.smooth is None:
            return -math.inf
        log_size = math.log(fitted.best.levels.smooth)
        beneath = self.log_prior_beneath(fitted) - self.log_prior(fitted)
        return beneath + float(DISCREPANCY.log_density(log_size) - USUAL.log_density(log_size))

    def _by_curves_alone(self, answer: Answer) -> list[Answer]:
        """An answer with each set of mechanisms that act on the curves of another kind alone."""
        if answer.explanation is None or self.other_kinds is None:
            return [answer]
        return [
            Answer(answer.explanation, answer.probability * share, names)
            for names, share in self.other_kinds.curve_only_sets(answer.explanation.names)
            if share > _NEGLIGIBLE
        ]


def inside_tables_under_posterior(problem: FittingProblem, search: Search) -> frozenset[str]:
    """The ids of the recordings whose contacts lie within the tables under answers of some probability."""
    recordings = problem.lines.campaign.recordings
    within = np.zeros(len(recordings))
    for answer in search.answers:
        best = search.fit_behind(answer).best
        outside = np.unique(best.hypothesis.lines.recording[~best.prediction.inside])
        within[np.isin(np.arange(len(recordings)), outside, invert=True)] += answer.probability
    return frozenset(recordings[index].id for index in np.flatnonzero(within > _STANDS).tolist())
