"""Which mechanisms act in each of several campaigns of one skin, how strong they are, and what they do to d33.

The evidence of a history, one set of mechanisms a campaign, is the product of the evidences of its sets, times the
agreement of parameters that neighbours share, times the prior of the changes: sets change seldom, and by one mechanism
rather than by two. All histories over the sets that are relevant in any campaign are summed.

The same factor on the d33 of all sensors does not tell its cause: d33 itself, or a mechanism that in this design acts
as one factor, such as a glue line that slips by the same share under every sphere (`causes`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from underskin.diagnosis.data.names import RIVAL_SHARE
from underskin.diagnosis.inference.evidence import NEGLIGIBLE_NATS
from underskin.diagnosis.inference.explanation import PRUNE_NATS, Explanation, FittingProblem, Request
from underskin.diagnosis.inference.gaussian import Gaussian
from underskin.diagnosis.inference.hypothesis import quadratic_of_prior
from underskin.diagnosis.inference.residuals import with_hidden_mechanism
from underskin.diagnosis.reporting.facts import DiagnosisResult
from underskin.diagnosis.reporting.numbers import COUNTS
from underskin.diagnosis.selection.answers import P_NOT_IN_MODEL_SPACE, Search
from underskin.diagnosis.selection.priors import log_prior
from underskin.mechanisms.base import Parameter
from underskin.units import Floats

_OF_SKIN = ("youngs_modulus", "thickness")  # parameters of the base model that belong to the skin
_P_CHANGE = 0.15  # probability that a set changes from one campaign to the next by one mechanism
_P_SAME_STRENGTH = 0.9  # probability that a mechanism that remains keeps its strength
_MOST_SETS = 12  # of a campaign
_MOST_HISTORIES = 400  # retained from campaign to campaign
USUAL_CHANGE = 0.2  # sd of the logarithm of d33 between campaigns, where it changes
AGEING = "ageing"
_SPACING = 0.03  # of ln d33: about the distance of nodes over a mechanism's prior

Names = tuple[str, ...]


@dataclass(frozen=True, eq=False)
class SharedParameters:
    """Some parameters of a fit, in fit coordinates (parameters,): the most probable values, the likelihood by the
    recordings, and centre and precision of their priors."""

    parameters: tuple[Parameter, ...]
    mean: Floats
    likelihood: Gaussian
    centre: Floats
    precision: Floats

    @classmethod
    def of(cls, fit: Explanation, mechanisms: Sequence[str], others: Sequence[str] = ()) -> Self:
        """Of these mechanisms' parameters, and of `others` of the model by name."""
        model = fit.model.parameters
        indices = [index for name in mechanisms for index in range(len(model))[fit.spans[name]]]
        indices += [index for name in others for index, parameter in enumerate(model) if parameter.name == name]
        return cls.at(fit, [index for index in indices if index in fit.best.hypothesis.mean_indices])

    @classmethod
    def at(cls, fit: Explanation, indices: Sequence[int]) -> Self:
        """Of the parameters at these indices, which change the mean."""
        parameters, mean = tuple(fit.model.parameters[index] for index in indices), fit.point.fit[[*indices]]
        priors = [_normal_prior(parameter, at) for parameter, at in zip(parameters, mean.tolist(), strict=True)]
        centre, precision = np.array(priors).reshape(-1, 2).T
        likelihood = Gaussian.from_posterior(0.0, mean, fit.best.covariance_of(indices), centre, precision)
        return cls(parameters, mean, likelihood, centre, precision)


def _normal_prior(parameter: Parameter, fit: float) -> tuple[float, float]:
    """Centre and precision; those of the same variance where the prior is uniform."""
    precision, centre = quadratic_of_prior(parameter, fit)
    low, high = parameter.bounds
    return (centre, precision) if precision else ((low + high) / 2, 12 / (high - low) ** 2)


def _common_prior(parts: Sequence[SharedParameters]) -> tuple[Floats, Floats]:
    """Centre and precision of the prior that several fits share: the least precise one, since in heavy tails the
    quadratics of one prior differ."""
    return parts[0].centre, np.min([shared.precision for shared in parts], axis=0)


def log_agreement(earlier: SharedParameters, later: SharedParameters) -> float:
    """ln ∫ p₁(x) p₂(x)/p(x) dx: the log Bayes factor for equal parameters in two campaigns."""
    first, second, prior = earlier.likelihood, later.likelihood, _common_prior([earlier, later])
    joint, *separate = (likelihood.log_integral(*prior) for likelihood in (first + second, first, second))
    return float(joint - sum(separate))


def keeps_strength(before: Explanation, after: Explanation, mechanism: str) -> bool:
    """Whether a mechanism of two fits more probably kept its strength than not."""
    agreement = log_agreement(*(SharedParameters.of(fit, [mechanism]) for fit in (before, after)))
    return bool(np.log(_P_SAME_STRENGTH) + agreement > np.log(1 - _P_SAME_STRENGTH))


def parameter_values(parameters: Sequence[Parameter], fit: Floats) -> dict[str, float]:
    """Parameters at these fit coordinates, in their units, by name."""
    values: dict[str | None, float] = {None: 1.0}
    values |= {
        parameter.name: parameter.from_fit(float(coordinate))
        for parameter, coordinate in zip(parameters, fit, strict=True)
    }
    return {parameter.name: values[parameter.name] * values[parameter.relative_to] for parameter in parameters}


@dataclass(frozen=True)
class CampaignFits:
    """One campaign: its fits, and the sets of mechanisms that it supports."""

    problem: FittingProblem
    search: Search

    @classmethod
    def of(cls, result: DiagnosisResult) -> Self:
        """Of a campaign with a result of its own, or else with one together with others."""
        search = result.search or result.few
        assert result.problem is not None
        assert search is not None
        return cls(result.problem, search)

    @cached_property
    def _by_set(self) -> dict[frozenset[str], Explanation | None]:
        return {frozenset(fit.names): fit for fit in self.search.explanations}

    @property
    def required_sets(self) -> list[frozenset[str]]:
        """The supported sets near the best one."""
        ranked = sorted(filter(self.search.is_supported, self.search.explanations), key=self.search.log_weight)[::-1]
        least = self.search.log_weight(ranked[0]) - NEGLIGIBLE_NATS
        return [frozenset(fit.names) for fit in ranked[:_MOST_SETS] if self.search.log_weight(fit) > least]

    @property
    def p_unlisted(self) -> float:
        """The probability that something unlisted acts in this campaign, beyond `P_NOT_IN_MODEL_SPACE`, which is the
        same in all campaigns."""
        share = sum(answer.probability for answer in self.search.answers if answer.explanation is None)
        return max(share - P_NOT_IN_MODEL_SPACE, 0.0) / (1 - P_NOT_IN_MODEL_SPACE)

    def supported(self, names: frozenset[str]) -> frozenset[str]:
        """Those of the mechanisms that this campaign can show."""
        return names.difference(self.search.unsupported)

    def explained(self, names: frozenset[str]) -> Explanation | None:
        """The explanation of a set, reduced to the mechanisms that this campaign supports; None where it cannot be
        fitted."""
        supported = self.supported(names)
        if self._by_set.get(supported) is None:
            catalogue = self.problem.lines.mechanisms.named
            fit = self.problem.explain(Request(tuple(name for name in catalogue if name in supported)))
            self._by_set[supported] = fit
        return self._by_set[supported]

    def fit(self, names: Names) -> Explanation:
        """The explanation of a set that can be fitted."""
        fit = self.explained(frozenset(names))
        assert fit is not None
        return fit

    def moving_fit(self, names: Names) -> Explanation:
        """The same without the mechanisms that move no prediction, such as the spread of the sensors, which does not
        change a sensor's d33."""
        mechanisms = self.problem.lines.mechanisms
        return self.fit(tuple(name for name in names if mechanisms[name].moves_predictions))


def p_described(fits: Sequence[CampaignFits]) -> float:
    """The probability that known physics describes all campaigns."""
    return (1 - P_NOT_IN_MODEL_SPACE) * float(np.prod([1 - campaign.p_unlisted for campaign in fits]))


@dataclass(frozen=True)
class SetHistory:
    """A set for each campaign, and its posterior probability."""

    sets: tuple[Names, ...]
    probability: float

    @property
    def mechanisms(self) -> list[str]:
        """Those of all campaigns, in order of occurrence."""
        return list(dict.fromkeys(name for names in self.sets for name in names))


def set_histories(fits: Sequence[CampaignFits]) -> list[SetHistory]:
    """The histories of two campaigns or more in the order of their dates, the most probable first."""
    supported = min(campaign.search.supported for campaign in fits)
    sets = list(dict.fromkeys(names for campaign in fits for names in (frozenset[str](), *campaign.required_sets)))
    explanations = [[campaign.explained(names) for names in sets] for campaign in fits]
    log_evidence = np.array([[-np.inf if fit is None else fit.log_evidence for fit in row] for row in explanations])
    log_evidence -= log_evidence.max(axis=1, keepdims=True)
    log_evidence[log_evidence <= -PRUNE_NATS] = -np.inf
    weights = log_evidence[0] + [log_prior(len(names), supported) for names in sets]
    paths: list[tuple[float, tuple[int, ...]]] = [(weight, (index,)) for index, weight in enumerate(weights.tolist())]
    for before, after, here in zip(explanations[:-1], explanations[1:], log_evidence[1:].tolist(), strict=True):
        possible = [index for index, log_evidence_of_set in enumerate(here) if np.isfinite(log_evidence_of_set)]
        paths = [path for path in paths if np.isfinite(path[0])]
        change = {
            (first, second): _log_transition(before[first], after[second], len(sets[first] ^ sets[second]), supported)
            for first in {path[-1] for _, path in paths}
            for second in possible
        }
        longer = [
            (weight + change[path[-1], index] + here[index], (*path, index))
            for weight, path in paths
            for index in possible
        ]
        paths = sorted(longer, reverse=True)[:_MOST_HISTORIES]
    total = np.logaddexp.reduce([weight for weight, _ in paths])
    order = fits[0].problem.lines.mechanisms.named

    def named(path: tuple[int, ...]) -> tuple[Names, ...]:
        of_campaigns = (campaign.supported(sets[index]) for campaign, index in zip(fits, path, strict=True))
        return tuple(tuple(name for name in order if name in names) for names in of_campaigns)

    return [SetHistory(named(path), float(np.exp(weight - total))) for weight, path in paths]


def _log_transition(before: Explanation | None, after: Explanation | None, mechanisms: int, supported: int) -> float:
    """Log prior of the change of a set by so many mechanisms, plus the log agreement of shared parameters."""
    assert before is not None
    assert after is not None
    common = [name for name in before.names if name in after.names]
    agreement = log_agreement(*(SharedParameters.of(fit, common, _OF_SKIN) for fit in (before, after)))
    same = float(np.logaddexp(np.log(_P_SAME_STRENGTH) + agreement, np.log(1 - _P_SAME_STRENGTH)))
    return log_change(mechanisms, supported) + same


def log_change(mechanisms: int, supported: int, share: float = _P_CHANGE) -> float:
    """Log prior probability that a set differs from another by so many mechanisms; by one with probability `share`."""
    return mechanisms * float(np.log(share / max(supported, 1))) if mechanisms else float(np.log(1 - share))


@dataclass(frozen=True, eq=False)
class Period:
    """The `campaigns` (indices) in which a mechanism acts with one strength, the probability that it acts in each of
    them, and mean and standard deviation of its parameters by all of them, in fit coordinates.

    `begins`: it acts in all campaigns that can show it from one on, and not in those before.
    """

    mechanism: str
    campaigns: tuple[int, ...]
    begins: bool
    probability: float
    parameters: tuple[Parameter, ...]
    mean: Floats
    deviation: Floats


def periods(fits: Sequence[CampaignFits], histories: Sequence[SetHistory]) -> list[Period]:
    """Of the mechanisms of the most probable history."""
    leader = histories[0]
    acting = [campaign.fit(names) for campaign, names in zip(fits, leader.sets, strict=True)]
    found = []
    for mechanism in leader.mechanisms:
        groups: list[list[int]] = []
        for index in (index for index, names in enumerate(leader.sets) if mechanism in names):
            if groups and keeps_strength(acting[groups[-1][-1]], acting[index], mechanism):
                groups[-1].append(index)
            else:
                groups.append([index])
        for group in groups:
            present = [
                sum(history.probability for history in histories if mechanism in history.sets[index]) for index in group
            ]
            able = [index for index, campaign in enumerate(fits) if mechanism not in campaign.search.unsupported]
            begins = min(able) < group[0] and group == [index for index in able if index >= group[0]]
            shared = [SharedParameters.of(acting[index], [mechanism]) for index in group]
            parameters = shared[0].parameters
            found.append(Period(mechanism, tuple(group), begins, min(present), parameters, *_combined(shared)))
    return found


def _combined(parts: Sequence[SharedParameters]) -> tuple[Floats, Floats]:
    """Mean and standard deviations of parameters that several fits share: their precisions add, with the prior counted
    once."""
    first, *others = (shared.likelihood for shared in parts)
    mean, covariance = sum(others, first).posterior(*_common_prior(parts))
    low, high = np.array([parameter.bounds for parameter in parts[0].parameters]).reshape(-1, 2).T
    return np.clip(mean, low, high), np.sqrt(np.diag(covariance))


def sets_of_campaign(
    campaign: CampaignFits, histories: Sequence[SetHistory], number: int
) -> list[tuple[float, Explanation, float]]:
    """The sets that move a campaign's predictions: the probability of each over all histories, its fit, and the
    standard deviation of ln d33 by the strengths of its mechanisms."""
    mechanisms, shares = campaign.problem.lines.mechanisms, dict[Names, float]()
    for history in histories:
        moving = tuple(name for name in history.sets[number] if mechanisms[name].moves_predictions)
        shares[moving] = shares.get(moving, 0.0) + history.probability
    alone = _d33_variance(campaign.fit(()), ())
    fits = [(share, campaign.fit(names)) for names, share in shares.items() if share > COUNTS]
    return [(share, fit, float(np.sqrt(max(_d33_variance(fit, ()) - alone, 0.0)))) for share, fit in fits]


def d33_uncertainties(fits: Sequence[CampaignFits], leader: SetHistory) -> list[float]:
    """Of each campaign the uncertainty of ln d33 since the previous one by the mechanisms' strengths; a mechanism with
    the same strength in both cancels. 0 for the first."""
    moving = [campaign.moving_fit(names) for campaign, names in zip(fits, leader.sets, strict=True)]
    uncertainties = [0.0]
    for number in range(1, len(fits)):
        pair = moving[number - 1 : number + 1]
        same = [name for name in pair[0].names if name in pair[1].names and keeps_strength(pair[0], pair[1], name)]
        variances = [
            max(_d33_variance(fit, same) - _d33_variance(campaign.fit(()), ()), 0.0)
            for fit, campaign in zip(pair, fits[number - 1 : number + 1], strict=True)
        ]
        uncertainties.append(float(np.sqrt(sum(variances))))
    return uncertainties


def _d33_variance(fit: Explanation, known: Sequence[str]) -> float:
    """The variance of ln d33 where the parameters of some mechanisms are `known`."""
    rows = fit.best.hypothesis.mean_indices
    fixed = {index for name in known for index in range(len(fit.model.parameters))[fit.spans[name]]}
    free = [row for row, index in enumerate(rows) if index not in fixed]
    precision = np.linalg.inv(fit.best.covariance)[np.ix_(free, free)]
    d33 = free.index(rows.index(fit.index("d33")))
    return float(np.linalg.inv(precision)[d33, d33])


def causes(campaign: CampaignFits, names: Names, size: float, deviation: float) -> Names:
    """The mechanisms that, added to a campaign's own `names`, would change ln d33 of all sensors by `size`: ageing,
    which is d33 itself and only decreases it, then the most probable first."""
    fit = campaign.moving_fit(names)
    before = float(fit.point.fit[fit.index("d33")]) - size
    weights = {AGEING: float(np.exp(log_normal(size, USUAL_CHANGE**2)))} if size < 0 else {}
    for name in campaign.problem.lines.mechanisms.named:
        if name not in (*names, AGEING):
            hidden = with_hidden_mechanism(campaign.problem, fit, name, "d33")
            if hidden is not None:
                density = np.exp(log_normal(hidden.mean - before, deviation**2 + _SPACING**2))
                weights[name] = float(hidden.share @ density)
    most = max(weights.values(), default=0.0)
    likely = {name: weight for name, weight in weights.items() if weight > RIVAL_SHARE * most}
    return tuple(sorted(likely, key=lambda name: (name != AGEING, -likely[name])))


def log_normal(offset: Floats | float, variance: float) -> Floats:
    """ln of a normal density, up to its constant."""
    return np.asarray(-0.5 * (np.square(offset) / variance + np.log(variance)))
