"""Courses of parameters over the campaigns of one skin.

What two fits say together of parameters that they share, by their normal approximations.

Which mechanisms act in each of several campaigns of one skin: a course through the sets, one set a campaign.

The evidence of a course is the product of the evidences of its sets, times how well the parameters that neighbours
share agree, times the prior of the changes. Sets change seldom, by one mechanism rather than by two. All courses over
the sets that any campaign asks for are summed.

The scatter of gains and positions of skins of one make, which are recorded on one bench: what a skin's sisters say.

A few recordings determine neither, nor many whether positions scatter at all. Where gain scatter is underestimated
intervals are too narrow; where positions scatter and none is assumed, or the reverse, all d33 are off to one side.
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

_UNIFORM_VARIANCE = 12.0  # a uniform prior's variance is the square of its width over this
_SKINS_OWN = ("youngs_modulus", "thickness")  # nuisances of FRFs that are of the skin


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
        """Of these mechanisms' parameters and, with `skin`, the factors on its modulus and thickness."""
        hypothesis = explanation.best.hypothesis
        model = explanation.model.parameters
        own = parameter_slices(explanation.names, hypothesis.lines)
        places = [place for name in mechanisms for place in range(own[name].start, own[name].stop)]
        if skin:
            names = [entry.name for entry in model]
            places += [names.index(name) for name in _SKINS_OWN if name in names]
        places = [place for place in places if place in hypothesis.mean_indices]
        rows = [hypothesis.mean_indices.index(place) for place in places]
        moments = np.array([_prior(model[place], float(explanation.point.fit[place])) for place in places]).reshape(
            -1, 2
        )
        return cls(
            tuple(model[place] for place in places),
            explanation.point.fit[places],
            explanation.best.covariance[np.ix_(rows, rows)],
            moments[:, 0],
            moments[:, 1],
        )

    @property
    def precision(self) -> Floats:
        """That of the posterior, at least the prior's in every direction: a quadratic may be flatter."""
        prior = np.diag(self.prior_precision)
        values, vectors = np.linalg.eigh(np.linalg.inv(self.covariance) - prior)
        return np.asarray(prior + (vectors * np.maximum(values, 0.0)) @ vectors.T)

    def likelihood(self, prior_precision: Floats) -> Gaussian:
        """That by which a normal prior of this precision (parameters,) becomes the posterior."""
        prior = np.diag(prior_precision)
        return Gaussian(self.precision - prior, self.precision @ self.mean - prior @ self.prior_mean, 0.0)


def _prior(entry: Parameter, fit: float) -> tuple[float, float]:
    precision, centre = quadratic_of_prior(entry, fit)
    low, high = entry.bounds
    return (centre, precision) if precision else ((low + high) / 2, _UNIFORM_VARIANCE / (high - low) ** 2)


def log_agreement(one: Shared, two: Shared) -> float:
    """ln ∫ p₁(x) p₂(x)/p(x) dx: how much more probable two campaigns are if parameters are the same in both."""
    if not len(one.mean):
        return 0.0
    prior = _least_prior([one, two])
    first, second = (shared.likelihood(prior) for shared in (one, two))
    both, *each = (likelihood.log_integral(one.prior_mean, prior) for likelihood in (first + second, first, second))
    return float(both - sum(each))


def _least_prior(each: Sequence[Shared]) -> Floats:
    """The precision of the prior that is in all: in heavy tails the quadratics of one prior differ."""
    return np.min([shared.prior_precision for shared in each], axis=0)


def combined(each: Sequence[Shared]) -> tuple[Floats, Floats]:
    """Mean and standard deviations of parameters that several fits share: their precisions add, the prior's once."""
    prior = _least_prior(each)
    likelihoods = [shared.likelihood(prior) for shared in each]
    mean, covariance = sum(likelihoods[1:], likelihoods[0]).posterior(each[0].prior_mean, prior)
    low, high = (np.array([parameter.bounds[end] for parameter in each[0].parameters]) for end in (0, 1))
    return np.clip(mean, low, high), np.sqrt(np.diag(covariance))


def values(parameters: Sequence[Parameter], fit: Floats) -> dict[str, float]:
    """Of parameters at these fit coordinates, in their units, by name."""
    found = {entry.name: entry.from_fit(float(at)) for entry, at in zip(parameters, fit, strict=True)}
    return {
        entry.name: found[entry.name] * (1.0 if entry.relative_to is None else found[entry.relative_to])
        for entry in parameters
    }


CHANGES = 0.15  # probability that a set changes from one campaign to the next by one mechanism
_BEHIND, _MOST_SETS = 12.0, 12  # nats behind a campaign's best, and how many of its sets
_HOPELESS = 30.0  # nats behind which a set in a campaign is on no course
_SAME_STRENGTH = 0.9  # probability that a mechanism that stays has the strength that it had
_MOST_COURSES = 400  # kept from campaign to campaign

Names = tuple[str, ...]


@dataclass(frozen=True)
class Candidate:
    """One campaign: its fits, and the sets of mechanisms that it supports."""

    problem: FittingProblem
    search: Search

    @cached_property
    def known(self) -> dict[frozenset[str], Explanation]:
        """The sets that were fitted."""
        return {frozenset(entry.names): entry for entry in self.search.explanations}

    @property
    def required_sets(self) -> list[frozenset[str]]:
        """The sets that may matter."""
        showing = sorted(
            (entry for entry in self.search.explanations if self.search.is_supported(entry)), key=self.search.log_weight
        )[::-1]
        least = self.search.log_weight(showing[0]) - _BEHIND
        return [frozenset(entry.names) for entry in showing[:_MOST_SETS] if self.search.log_weight(entry) > least]

    @property
    def undescribed(self) -> float:
        """The probability that what is missing in this campaign has no name, beyond what stays for what nobody thought
        of, which is the same in all campaigns."""
        share = sum(answer.probability for answer in self.search.answers if answer.explanation is None)
        return max(share - P_NOT_IN_MODEL_SPACE, 0.0) / (1 - P_NOT_IN_MODEL_SPACE)

    def supported(self, names: frozenset[str]) -> frozenset[str]:
        """Those of the mechanisms that this campaign can show."""
        return frozenset(name for name in names if name not in self.search.unsupported)

    def explained(self, names: frozenset[str]) -> Explanation | None:
        """A set, as far as this campaign supports its mechanisms."""
        own = self.supported(names)
        if own not in self.known:
            catalogue = self.problem.lines.mechanisms.named
            (found,) = self.problem.explain([Request(tuple(name for name in catalogue if name in own))])
            if found is None:
                return None
            self.known[own] = found
        return self.known[own]


@dataclass(frozen=True)
class Course:
    """A set for each campaign, and its posterior probability."""

    sets: tuple[Names, ...]
    probability: float


@dataclass(frozen=True)
class Courses:
    """The most probable courses, and the posterior that each mechanism acts in each campaign."""

    best: tuple[Course, ...]
    present: Mapping[str, Floats]  # (campaigns,)


def courses(candidates: Sequence[Candidate], supported: int) -> Courses:
    """Of campaigns in the order of their dates; `supported` mechanisms."""
    sets = list(dict.fromkeys(one for candidate in candidates for one in (frozenset[str](), *candidate.required_sets)))
    log_evidence = np.full((len(candidates), len(sets)), -np.inf)
    for number, candidate in enumerate(candidates):
        for place, names in enumerate(sets):
            found = candidate.explained(names)
            if found is not None:
                log_evidence[number, place] = found.log_evidence
    best = np.maximum.reduce(log_evidence, axis=1)[:, None]
    log_evidence = np.where(log_evidence > best - _HOPELESS, log_evidence - best, -np.inf)
    order = candidates[0].problem.lines.mechanisms.named
    begun = [log_prior(len(one), supported) for one in sets]
    paths: list[tuple[float, tuple[int, ...]]] = [
        (float(log_evidence[0, place] + begun[place]), (place,)) for place in range(len(sets))
    ]
    for number in range(1, len(candidates)):
        longer = [
            (
                weight + _step(candidates, number, sets, path[-1], place, supported) + log_evidence[number, place],
                (*path, place),
            )
            for weight, path in paths
            for place in range(len(sets))
            if np.isfinite(weight) and np.isfinite(log_evidence[number, place])
        ]
        paths = sorted(longer, reverse=True)[:_MOST_COURSES]
    weights = np.array([weight for weight, _ in paths])
    shares = np.exp(weights - np.logaddexp.reduce(weights))

    def named(path: tuple[int, ...]) -> tuple[Names, ...]:
        own = [one.supported(sets[place]) for one, place in zip(candidates, path, strict=True)]
        return tuple(tuple(name for name in order if name in names) for names in own)

    found_courses = tuple(
        Course(named(path), float(share))
        for (_, path), share in sorted(zip(paths, shares, strict=True), key=lambda entry: -entry[1])
    )
    present: dict[str, Floats] = {}
    for course in found_courses:
        for number, own in enumerate(course.sets):
            for name in own:
                present.setdefault(name, np.zeros(len(candidates)))[number] += course.probability
    return Courses(found_courses, present)


def _step(
    candidates: Sequence[Candidate], number: int, sets: Sequence[frozenset[str]], here: int, there: int, supported: int
) -> float:
    """ln of the prior of the change, and of how well what stays agrees."""
    of_change = log_change(len(sets[here] ^ sets[there]), supported)
    before, after = candidates[number - 1].explained(sets[here]), candidates[number].explained(sets[there])
    if before is None or after is None:
        return -np.inf
    common = [name for name in before.names if name in after.names]
    agreement = log_agreement(Shared.of(before, common), Shared.of(after, common))
    return of_change + float(np.logaddexp(np.log(_SAME_STRENGTH) + agreement, np.log(1 - _SAME_STRENGTH)))


def log_change(mechanisms: int, supported: int, share: float = CHANGES) -> float:
    """ln of the prior probability that a set differs from another by so many mechanisms; one with this `share`."""
    return mechanisms * float(np.log(share / max(supported, 1))) if mechanisms else float(np.log(1 - share))


def same_strength(one: Shared, two: Shared) -> bool:
    """Whether it is more probable that a mechanism kept its strength than that it has another."""
    return bool(np.log(_SAME_STRENGTH) + log_agreement(one, two) > np.log(1 - _SAME_STRENGTH))


_FROM_SKIN_TO_SKIN = 0.2  # deviation of the logarithm of the gain scatter on one bench
_UNSURE = 0.02  # the least probability that positions do, or do not, scatter


@dataclass(frozen=True)
class Bench:
    """The prior of the gain scatter's logarithm, and the probability that positions scatter."""

    gain: Plateau
    has_position_scatter: float


def benches(candidates: Sequence[Candidate]) -> list[Bench]:
    """Of each skin, by what its sisters say, one at least."""
    leaders = [one.search.fit_behind(one.search.answers[0]) for one in candidates]
    said = np.array([one.point.covariance[GAIN] for one in leaders])
    recordings = np.array([one.best.hypothesis.lines.recordings for one in leaders])
    precision = 1 / (_FROM_SKIN_TO_SKIN**2 + 0.5 / np.maximum(recordings - 1, 1))
    usual = logit(1 - NO_POSITION_SCATTER)
    gained = logit(np.clip([one.has_position_scatter for one in leaders], _UNSURE, 1 - _UNSURE)) - usual
    found = []
    for number in range(len(candidates)):
        other_specimens = np.arange(len(candidates)) != number
        own = np.where(other_specimens, precision, 0.0)
        deviation = float(np.hypot(_FROM_SKIN_TO_SKIN, own.sum() ** -0.5))
        has_position_scatter = float(np.clip(expit(usual + gained[other_specimens].sum()), _UNSURE, 1 - _UNSURE))
        found.append(Bench(Plateau.normal(float(own @ said / own.sum()), deviation), has_position_scatter))
    return found
