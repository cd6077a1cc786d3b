"""What two fits say together of parameters that they share, by their normal approximations."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.inference.hypothesis import own_places, quadratic_of_prior
from underskin.mechanisms.parameter import Parameter
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
        own = own_places(explanation.names, hypothesis.lines)
        places = [place for name in mechanisms for place in range(own[name].start, own[name].stop)]
        if skin:
            names = [entry.name for entry in model]
            places += [names.index(name) for name in _SKINS_OWN if name in names]
        places = [place for place in places if place in hypothesis.mean_places]
        rows = [hypothesis.mean_places.index(place) for place in places]
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


def _prior(entry: Parameter, fit: float) -> tuple[float, float]:
    precision, centre = quadratic_of_prior(entry, fit)
    low, high = entry.bounds
    return (centre, precision) if precision else ((low + high) / 2, _UNIFORM_VARIANCE / (high - low) ** 2)


def log_agreement(one: Shared, two: Shared) -> float:
    """ln ∫ p₁(x) p₂(x)/p(x) dx: how much more probable two campaigns are if parameters are the same in both."""
    if not len(one.mean):
        return 0.0
    prior = _least_prior([one, two])
    first, second = one.precision, two.precision
    both = first + second - prior
    towards = first @ one.mean + second @ two.mean - prior @ one.prior_mean
    squares = one.mean @ first @ one.mean + two.mean @ second @ two.mean - one.prior_mean @ prior @ one.prior_mean
    volumes = sum(
        sign * np.linalg.slogdet(part)[1] for sign, part in ((1, first), (1, second), (-1, prior), (-1, both))
    )
    return float(0.5 * volumes - 0.5 * (squares - towards @ np.linalg.solve(both, towards)))


def _least_prior(each: Sequence[Shared]) -> Floats:
    """The precision of the prior that is in all: in heavy tails the quadratics of one prior differ."""
    return np.diag(np.min([one.prior_precision for one in each], axis=0))


def combined(each: Sequence[Shared]) -> tuple[Floats, Floats]:
    """Mean and standard deviations of parameters that several fits share: their precisions add, the prior's once."""
    prior = _least_prior(each)
    precisions = [one.precision for one in each]
    covariance = np.linalg.inv(sum(precisions[1:], precisions[0]) - (len(each) - 1) * prior)
    towards = sum((precision @ one.mean for precision, one in zip(precisions, each, strict=True)), np.zeros(len(prior)))
    mean = covariance @ (towards - (len(each) - 1) * prior @ each[0].prior_mean)
    low, high = (np.array([entry.bounds[end] for entry in each[0].parameters]) for end in (0, 1))
    return np.clip(mean, low, high), np.sqrt(np.diag(covariance))


def values(parameters: Sequence[Parameter], fit: Floats) -> dict[str, float]:
    """Of parameters at these fit coordinates, in their units, by name."""
    found = {entry.name: entry.from_fit(float(at)) for entry, at in zip(parameters, fit, strict=True)}
    return {
        entry.name: found[entry.name] * (1.0 if entry.relative_to is None else found[entry.relative_to])
        for entry in parameters
    }
