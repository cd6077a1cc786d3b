"""Sets of mechanisms and shared parameters over the campaigns of one skin, and the scatter on one bench.

- `Shared`: the normal approximation of parameters that two fits share, and how well these agree.
- `set_histories`: which mechanisms act in each of several campaigns, one set a campaign. The evidence of a history is
  the product of the evidences of its sets, times the agreement of parameters that neighbours share, times the prior of
  the changes: sets change seldom, and by one mechanism rather than by two. All histories over the sets that are
  relevant in any campaign are summed.
- `benches`: the scatter of gains and positions of one skin, by the other skins on the same bench. A few recordings do
  not determine it. With too little gain scatter intervals are too narrow; with a wrong positioning scatter all d33 are
  biased.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import expit, logit

from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.fit import GAIN
from underskin.diagnosis.inference.gaussian import Gaussian
from underskin.diagnosis.inference.hypothesis import parameter_slices, quadratic_of_prior
from underskin.diagnosis.noise import Plateau
from underskin.diagnosis.selection.answers import P_NOT_IN_MODEL_SPACE, Search
from underskin.diagnosis.selection.priors import log_prior
from underskin.mechanisms.parameter import Parameter
from underskin.recordings.usual_scatter import NO_POSITION_SCATTER
from underskin.units import Floats

_UNIFORM_VARIANCE = 12.0  # the variance of a uniform distribution is its width² over this
_SKIN_PARAMETERS = ("youngs_modulus", "thickness")  # nuisances of FRFs that belong to the skin


@dataclass(frozen=True, eq=False)
class Shared:
    """Mean and covariance of some parameters of a fit, and mean and precision of their priors, in fit coordinates."""

    parameters: tuple[Parameter, ...]
    mean: Floats
    covariance: Floats
    prior_mean: Floats
    prior_precision: Floats  # (parameters,)

    @classmethod
    def of(cls, explanation: Explanation, mechanisms: Sequence[str], *, skin: bool = True) -> "Shared":
        """Of these mechanisms' parameters and, if `skin`, the factors on modulus and thickness."""
        hypothesis = explanation.best.hypothesis
        model = explanation.model.parameters
        slices = parameter_slices(explanation.names, hypothesis.lines)
        indices = [index for name in mechanisms for index in range(slices[name].start, slices[name].stop)]
        if skin:
            names = [parameter.name for parameter in model]
            indices += [names.index(name) for name in _SKIN_PARAMETERS if name in names]
        indices = [index for index in indices if index in hypothesis.mean_indices]
        rows = [hypothesis.mean_indices.index(index) for index in indices]
        moments = np.array([_prior(model[index], float(explanation.point.fit[index])) for index in indices]).reshape(
            -1, 2
        )
        return cls(
            tuple(model[index] for index in indices),
            explanation.point.fit[indices],
            explanation.best.covariance[np.ix_(rows, rows)],
            moments[:, 0],
            moments[:, 1],
        )

    @property
    def precision(self) -> Floats:
        """Precision of the posterior, at least the prior's in every direction: a quadratic may be flatter."""
        prior = np.diag(self.prior_precision)
        values, vectors = np.linalg.eigh(np.linalg.inv(self.covariance) - prior)
        return np.asarray(prior + (vectors * np.maximum(values, 0.0)) @ vectors.T)

    def likelihood(self, prior_precision: Floats) -> Gaussian:
        """The likelihood that turns a normal prior of this precision (parameters,) into the posterior."""
        prior = np.diag(prior_precision)
        return Gaussian(self.precision - prior, self.precision @ self.mean - prior @ self.prior_mean, 0.0)


def _prior(parameter: Parameter, fit: float) -> tuple[float, float]:
    precision, centre = quadratic_of_prior(parameter, fit)
    low, high = parameter.bounds
    return (centre, precision) if precision else ((low + high) / 2, _UNIFORM_VARIANCE / (high - low) ** 2)


def log_agreement(earlier: Shared, later: Shared) -> float:
    """ln ∫ p₁(x) p₂(x)/p(x) dx: the log Bayes factor for equal parameters in two campaigns."""
    if not len(earlier.mean):
        return 0.0
    prior = _least_prior([earlier, later])
    earlier_likelihood, later_likelihood = (shared.likelihood(prior) for shared in (earlier, later))
    joint, *separate = (
        likelihood.log_integral(earlier.prior_mean, prior)
        for likelihood in (earlier_likelihood + later_likelihood, earlier_likelihood, later_likelihood)
    )
    return float(joint - sum(separate))


def _least_prior(parts: Sequence[Shared]) -> Floats:
    """The least precision of the priors of all parts: in heavy tails the quadratics of one prior differ."""
    return np.min([shared.prior_precision for shared in parts], axis=0)


def combined(parts: Sequence[Shared]) -> tuple[Floats, Floats]:
    """Mean and standard deviations of parameters that several fits share: their precisions add, with the prior counted
    once."""
    prior = _least_prior(parts)
    likelihoods = [shared.likelihood(prior) for shared in parts]
    mean, covariance = sum(likelihoods[1:], likelihoods[0]).posterior(parts[0].prior_mean, prior)
    low, high = (np.array([parameter.bounds[end] for parameter in parts[0].parameters]) for end in (0, 1))
    return np.clip(mean, low, high), np.sqrt(np.diag(covariance))


def values(parameters: Sequence[Parameter], fit: Floats) -> dict[str, float]:
    """Parameters at these fit coordinates, in their units, by name."""
    by_name = {
        parameter.name: parameter.from_fit(float(coordinate))
        for parameter, coordinate in zip(parameters, fit, strict=True)
    }
    return {
        parameter.name: by_name[parameter.name]
        * (1.0 if parameter.relative_to is None else by_name[parameter.relative_to])
        for parameter in parameters
    }


P_CHANGE = 0.15  # probability that a set changes from one campaign to the next by one mechanism
_BEHIND_BEST, _MOST_SETS = 12.0, 12  # nats behind a campaign's best, and how many of its sets
_PRUNE_NATS = 30.0  # nats behind the best set of a campaign beyond which a set is in no history
_SAME_STRENGTH = 0.9  # probability that a mechanism that remains keeps its strength
_MOST_HISTORIES = 400  # retained from campaign to campaign

Names = tuple[str, ...]


@dataclass(frozen=True)
class Candidate:
    """One campaign: its fits, and the sets of mechanisms that it supports."""

    problem: FittingProblem
    search: Search

    @cached_property
    def explanations_by_set(self) -> dict[frozenset[str], Explanation]:
        """The explanations of the sets fitted so far."""
        return {frozenset(explanation.names): explanation for explanation in self.search.explanations}

    @property
    def required_sets(self) -> list[frozenset[str]]:
        """The supported sets near the best one."""
        supported = sorted(
            (explanation for explanation in self.search.explanations if self.search.is_supported(explanation)),
            key=self.search.log_weight,
        )[::-1]
        least = self.search.log_weight(supported[0]) - _BEHIND_BEST
        return [
            frozenset(explanation.names)
            for explanation in supported[:_MOST_SETS]
            if self.search.log_weight(explanation) > least
        ]

    @property
    def unlisted_probability(self) -> float:
        """The probability that something unlisted acts in this campaign, beyond `P_NOT_IN_MODEL_SPACE`, which is the
        same in all campaigns."""
        share = sum(answer.probability for answer in self.search.answers if answer.explanation is None)
        return max(share - P_NOT_IN_MODEL_SPACE, 0.0) / (1 - P_NOT_IN_MODEL_SPACE)

    def supported(self, names: frozenset[str]) -> frozenset[str]:
        """Those of the mechanisms that this campaign can show."""
        return frozenset(name for name in names if name not in self.search.unsupported)

    def explained(self, names: frozenset[str]) -> Explanation | None:
        """The explanation of a set, reduced to the mechanisms that this campaign supports."""
        supported = self.supported(names)
        if supported not in self.explanations_by_set:
            catalogue = self.problem.lines.mechanisms.named
            (explanation,) = self.problem.explain([Request(tuple(name for name in catalogue if name in supported))])
            if explanation is None:
                return None
            self.explanations_by_set[supported] = explanation
        return self.explanations_by_set[supported]


@dataclass(frozen=True)
class SetHistory:
    """A set for each campaign, and its posterior probability."""

    sets: tuple[Names, ...]
    probability: float


@dataclass(frozen=True)
class SetHistories:
    """The most probable histories, and the posterior probability of each mechanism in each campaign."""

    best: tuple[SetHistory, ...]
    present: Mapping[str, Floats]  # (campaigns,)


def set_histories(candidates: Sequence[Candidate], supported: int) -> SetHistories:
    """Of campaigns in the order of their dates; `supported` is the number of mechanisms."""
    sets = list(
        dict.fromkeys(names for candidate in candidates for names in (frozenset[str](), *candidate.required_sets))
    )
    log_evidence = np.full((len(candidates), len(sets)), -np.inf)
    for number, candidate in enumerate(candidates):
        for index, names in enumerate(sets):
            explanation = candidate.explained(names)
            if explanation is not None:
                log_evidence[number, index] = explanation.log_evidence
    best = np.maximum.reduce(log_evidence, axis=1)[:, None]
    log_evidence = np.where(log_evidence > best - _PRUNE_NATS, log_evidence - best, -np.inf)
    order = candidates[0].problem.lines.mechanisms.named
    log_priors = [log_prior(len(names), supported) for names in sets]
    paths: list[tuple[float, tuple[int, ...]]] = [
        (float(log_evidence[0, index] + log_priors[index]), (index,)) for index in range(len(sets))
    ]
    for number in range(1, len(candidates)):
        longer = [
            (
                weight + _step(candidates, number, sets, path[-1], index, supported) + log_evidence[number, index],
                (*path, index),
            )
            for weight, path in paths
            for index in range(len(sets))
            if np.isfinite(weight) and np.isfinite(log_evidence[number, index])
        ]
        paths = sorted(longer, reverse=True)[:_MOST_HISTORIES]
    weights = np.array([weight for weight, _ in paths])
    shares = np.exp(weights - np.logaddexp.reduce(weights))

    def named(path: tuple[int, ...]) -> tuple[Names, ...]:
        supported_sets = [candidate.supported(sets[index]) for candidate, index in zip(candidates, path, strict=True)]
        return tuple(tuple(name for name in order if name in names) for names in supported_sets)

    histories = tuple(
        SetHistory(named(path), float(share))
        for (_, path), share in sorted(zip(paths, shares, strict=True), key=lambda pair: -pair[1])
    )
    present: dict[str, Floats] = {}
    for history in histories:
        for number, names_of_campaign in enumerate(history.sets):
            for name in names_of_campaign:
                present.setdefault(name, np.zeros(len(candidates)))[number] += history.probability
    return SetHistories(histories, present)


def _step(
    candidates: Sequence[Candidate], number: int, sets: Sequence[frozenset[str]], here: int, there: int, supported: int
) -> float:
    """Log prior of the change, plus the log agreement of shared parameters."""
    of_change = log_change(len(sets[here] ^ sets[there]), supported)
    before, after = candidates[number - 1].explained(sets[here]), candidates[number].explained(sets[there])
    if before is None or after is None:
        return -np.inf
    common = [name for name in before.names if name in after.names]
    agreement = log_agreement(Shared.of(before, common), Shared.of(after, common))
    return of_change + float(np.logaddexp(np.log(_SAME_STRENGTH) + agreement, np.log(1 - _SAME_STRENGTH)))


def log_change(mechanisms: int, supported: int, share: float = P_CHANGE) -> float:
    """Log prior probability that a set differs from another by so many mechanisms; by one with probability `share`."""
    return mechanisms * float(np.log(share / max(supported, 1))) if mechanisms else float(np.log(1 - share))


def same_strength(earlier: Shared, later: Shared) -> bool:
    """Whether a mechanism more probably kept its strength than not."""
    return bool(np.log(_SAME_STRENGTH) + log_agreement(earlier, later) > np.log(1 - _SAME_STRENGTH))


_FROM_SKIN_TO_SKIN = 0.2  # deviation of the logarithm of the gain scatter on one bench
_LEAST_PROBABILITY = 0.02  # least probability of positioning scatter, and of none


@dataclass(frozen=True)
class Bench:
    """The prior of the gain scatter's logarithm, and the probability of positioning scatter."""

    gain: Plateau
    p_position_scatter: float


def benches(candidates: Sequence[Candidate]) -> list[Bench]:
    """Of each skin, by the other skins, of which there must be at least one."""
    leaders = [candidate.search.fit_behind(candidate.search.answers[0]) for candidate in candidates]
    log_gains = np.array([leader.point.covariance[GAIN] for leader in leaders])
    recordings = np.array([leader.best.hypothesis.lines.recordings for leader in leaders])
    precision = 1 / (_FROM_SKIN_TO_SKIN**2 + 0.5 / np.maximum(recordings - 1, 1))
    usual = logit(1 - NO_POSITION_SCATTER)
    log_odds = (
        logit(np.clip([leader.p_position_scatter for leader in leaders], _LEAST_PROBABILITY, 1 - _LEAST_PROBABILITY))
        - usual
    )
    priors = []
    for number in range(len(candidates)):
        other_specimens = np.arange(len(candidates)) != number
        weights = np.where(other_specimens, precision, 0.0)
        deviation = float(np.hypot(_FROM_SKIN_TO_SKIN, weights.sum() ** -0.5))
        p_position_scatter = float(
            np.clip(expit(usual + log_odds[other_specimens].sum()), _LEAST_PROBABILITY, 1 - _LEAST_PROBABILITY)
        )
        priors.append(Bench(Plateau.normal(float(weights @ log_gains / weights.sum()), deviation), p_position_scatter))
    return priors
