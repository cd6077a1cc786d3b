"""A quantity of skins of one make as a population: partial pooling, and which skin departs.

x_i ~ N(θ_i, s_i²) is what skin i alone says, θ_i ~ N(μ, τ²) its true value; μ has a flat prior, τ one that is flat up
to a usual spread and falls off beyond. Sums over a grid of τ; given τ all is normal. A skin departs where what it says
is better explained by N(μ, τ² + D²), D far larger than the spread, with μ and τ from the others alone.
"""

from dataclasses import dataclass, replace

import numpy as np

from underskin.units import Floats

_SPREADS = np.geomspace(2e-3, 1.0, 60)
_USUAL = 0.1  # of a logarithm: the spread beyond which τ is less and less probable
STATED = 0.5  # probability of a departure that is stated
_DEPARTS = 0.05  # prior probability that a skin departs
_FAR, _LEAST_FAR = 5.0, 0.2  # D in spreads of the others, and at least


@dataclass(frozen=True, eq=False)
class Population:
    """Mean and spread with standard deviation of the mean; of each skin its pooled value with standard deviation, and
    the probability that it departs, (skins,)."""

    mean: float
    mean_deviation: float
    spread: float
    value: Floats
    deviation: Floats
    departs: Floats


def population(x: Floats, s: Floats) -> Population:
    """Of what at least two skins say, x with standard deviations s (skins,)."""
    weights, means, deviations = _mean_by_spread(x, s)
    mean = float(weights @ means)
    variance = float(weights @ (deviations**2 + (means - mean) ** 2))
    spread = float(np.sqrt(weights @ _SPREADS**2))
    share = _SPREADS[:, None] ** 2 / (_SPREADS[:, None] ** 2 + s**2)  # of a skin's own value in the pooled one
    pooled = means[:, None] + share * (x - means[:, None])
    value = weights @ pooled
    within = share * s**2 + (1 - share) ** 2 * deviations[:, None] ** 2
    deviation = np.sqrt(weights @ (within + (pooled - value) ** 2))
    departs = np.array([_departs(x, s, skin) for skin in range(len(x))])
    return Population(mean, float(np.sqrt(variance)), spread, value, deviation, departs)


def without_departing(x: Floats, s: Floats) -> Population:
    """The same where those that depart tell nothing of the others, nor the others of them."""
    every = population(x, s)
    kept = every.departs <= STATED
    if kept.all() or kept.sum() < 2:
        return every
    others = population(x[kept], s[kept])
    value, deviation = x.copy(), s.copy()
    value[kept], deviation[kept] = others.value, others.deviation
    return replace(others, value=value, deviation=deviation, departs=every.departs)


def _mean_by_spread(x: Floats, s: Floats) -> tuple[Floats, Floats, Floats]:
    """The posterior of each τ of the grid, and given it mean and deviation of μ."""
    precision = 1 / (_SPREADS[:, None] ** 2 + s**2)
    total = precision.sum(axis=1)
    means = precision @ x / total
    chi2 = (precision * (x - means[:, None]) ** 2).sum(axis=1)
    log_weight = 0.5 * np.log(precision).sum(axis=1) - 0.5 * np.log(total) - 0.5 * chi2
    log_weight -= np.log1p((_SPREADS / _USUAL) ** 2)
    log_weight += np.log(_SPREADS)  # the grid is even in the logarithm
    weights = np.exp(log_weight - np.logaddexp.reduce(log_weight))
    return weights, means, total**-0.5


def _departs(x: Floats, s: Floats, skin: int) -> float:
    others = np.arange(len(x)) != skin
    if others.sum() < 2:
        return 0.0
    weights, means, deviations = _mean_by_spread(x[others], s[others])
    far = np.maximum(_FAR * _SPREADS, _LEAST_FAR)

    def density(further: Floats) -> float:
        variance = deviations**2 + _SPREADS**2 + s[skin] ** 2 + further**2
        return float(weights @ (np.exp(-0.5 * (x[skin] - means) ** 2 / variance) / np.sqrt(variance)))

    departing, regular = _DEPARTS * density(far), (1 - _DEPARTS) * density(np.zeros_like(far))
    return departing / max(departing + regular, 1e-300)
