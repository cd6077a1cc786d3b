"""Quantities of skins of one make as populations: what the skins say together, which of them departs, and in what.

A skin's logarithms q (of E, thickness and d33) are normal about the make's μ: q_i ~ N(μ, diag τ²). One that departs has
a far larger deviation D in one quantity. What a skin's recordings say of q in each of these states is a normal
likelihood. Given the states and τ all is normal; sums run over a grid of τ and over all sets of departing skins that
matter, grown by one skin at a time. Fewer than half of the skins depart: the make is what most are.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from underskin.diagnosis.inference.knowledge import Knowledge
from underskin.diagnosis.reporting.numbers import mixture_quantile
from underskin.diagnosis.several.likelihoods import log_integral, of_mean, posterior
from underskin.units import Floats, Indices

_SOME_DEPARTS = 0.5  # prior probability that any skin of a fleet departs: as likely as not
_NODES, _STRIDES = 12, 2.7  # of the grid of ln τ, and to how many of its standard deviations it reaches
_BEHIND = 12.0  # nats behind the best set of departing skins, beyond which one counts no longer
_MOST_SETS = 200  # with equally many departing skins
_COUNTS = 1e-5  # of the probability, below which a set with a spread is left out of means and intervals
_LEVELS = (0.5, 0.025, 0.975)

STATED = 0.5  # probability from which on it is stated that a skin departs, and that what is declared of all is wrong
REGULAR = ""  # the departure of a skin that does not depart


@dataclass(frozen=True, eq=False)
class State:
    """What a skin says if it departs so: the name of the departure, the likelihood of the quantities, and the variances
    of the departure (quantities,)."""

    departs: str
    likelihood: Knowledge
    further: Floats


@dataclass(frozen=True, eq=False)
class Make:
    """A prior of μ: the logarithm of its probability, centre and precision (quantities,)."""

    log_prior: float
    centre: Floats
    precision: Floats


@dataclass(frozen=True)
class Spread:
    """The prior of τ of one quantity: ln τ is normal about that of `usual` with the standard deviation ln `factor`; a
    factor of 1 is a known τ."""

    usual: float
    factor: float

    @property
    def nodes(self) -> list[tuple[float, float]]:
        """Values of τ with the logarithms of their weights."""
        if self.factor == 1:
            return [(self.usual, 0.0)]
        deviations = np.linspace(-_STRIDES, _STRIDES, _NODES).tolist()
        return [(self.usual * self.factor**one, -0.5 * one**2) for one in deviations]


@dataclass(frozen=True, eq=False)
class Populations:
    """`mean` and `spread` τ of the make (quantities,), of each skin median and ends of the 95 % interval
    (3, skins, quantities), its departures' probabilities by name, and the probability of each prior of μ. `together`:
    that of the departures of all skins at once, by their names."""

    mean: Floats
    spread: Floats
    of_skins: Floats
    departs: tuple[dict[str, float], ...]
    makes: Floats
    together: Mapping[tuple[str, ...], float]

    @property
    def stated(self) -> tuple[str, ...]:
        """The departure of each skin: the likeliest of those that more probably departs than not."""
        return tuple(
            REGULAR if own[REGULAR] >= 1 - STATED else max((one for one in own if one != REGULAR), key=own.__getitem__)
            for own in self.departs
        )


def log_odds_of_departure(skins: int) -> float:
    """The prior log odds that one of so many skins departs."""
    return float(np.log(np.expm1(-np.log1p(-_SOME_DEPARTS) / skins)))


def populations(skins: Sequence[Sequence[State]], makes: Sequence[Make], spreads: Sequence[Spread]) -> Populations:
    """Of the states of each skin, the regular one first, the priors of μ, and those of τ (quantities,)."""
    assert all(own and own[0].departs == REGULAR for own in skins)
    return _Fleet(skins, makes, spreads).populations


@dataclass(frozen=True, eq=False)
class _Part:
    """Of the posterior: the states of all skins, one prior of μ, the spreads that matter (spreads,), and their
    probabilities."""

    states: tuple[int, ...]
    make: Make
    kept: Indices
    weights: Floats


class _Fleet:
    def __init__(self, skins: Sequence[Sequence[State]], makes: Sequence[Make], spreads: Sequence[Spread]) -> None:
        self.skins, self.makes = skins, makes
        nodes = list(product(*(one.nodes for one in spreads)))
        self.spreads = np.array([[value for value, _ in node] for node in nodes])  # (spreads, quantities)
        shares = np.array([sum(share for _, share in node) for node in nodes])
        self.log_shares = shares - np.logaddexp.reduce(shares)
        # What each skin in each state says of μ, (spreads,) each
        self.said = [[of_mean(one.likelihood, self.spreads**2 + one.further) for one in own] for own in skins]

    def together(self, states: Sequence[int], without: int | None = None) -> Knowledge:
        """What the skins in these states say of μ, but for one."""
        each = [own[state] for number, (own, state) in enumerate(zip(self.said, states, strict=True))
                if number != without]  # fmt: skip
        return sum(each[1:], each[0])

    def log_weights(self, states: Sequence[int]) -> Floats:
        """Of each prior of μ and each spread (makes, spreads)."""
        odds = log_odds_of_departure(len(self.skins))
        prior = sum(odds - np.log(len(own) - 1) for own, state in zip(self.skins, states, strict=True) if state)
        said = self.together(states)
        each = [one.log_prior + log_integral(said, one.centre, one.precision) for one in self.makes]
        return np.asarray(np.array(each) + self.log_shares + prior)

    @cached_property
    def found(self) -> dict[tuple[int, ...], Floats]:
        """The states of all skins that matter, with their log weights."""
        level = {none: self.log_weights(none) for none in [(0,) * len(self.skins)]}
        found = dict(level)
        for _ in range((len(self.skins) - 1) // 2):
            longer = {
                (*states[:number], other, *states[number + 1 :])
                for states in level
                for number, own in enumerate(self.skins)
                if not states[number]
                for other in range(1, len(own))
            }
            weights = {states: self.log_weights(states) for states in sorted(longer)}
            totals = {states: float(np.logaddexp.reduce(own, axis=None)) for states, own in weights.items()}
            best = max(float(np.logaddexp.reduce(own, axis=None)) for own in (*found.values(), *weights.values()))
            kept = sorted(totals, key=lambda states: -totals[states])[:_MOST_SETS]
            level = {states: weights[states] for states in kept if totals[states] > best - _BEHIND}
            found |= level
        return found

    @cached_property
    def populations(self) -> Populations:
        log_weights = np.array(list(self.found.values()))  # (sets, makes, spreads)
        share = np.exp(log_weights - np.logaddexp.reduce(log_weights, axis=None))
        of_sets = share.sum(axis=(1, 2))
        departs = tuple(
            {
                state.departs: float(of_sets[[states[number] == place for states in self.found]].sum())
                for place, state in enumerate(own)
            }
            for number, own in enumerate(self.skins)
        )
        parts = [
            _Part(states, make, kept, own[kept])
            for states, of_makes in zip(self.found, share, strict=True)
            for make, own in zip(self.makes, of_makes, strict=True)
            if len(kept := np.flatnonzero(own > _COUNTS))
        ]
        weights = np.concatenate([part.weights for part in parts])
        weights /= weights.sum()
        mean = np.concatenate([self._mean(part) for part in parts])
        spread = np.concatenate([self.spreads[part.kept] for part in parts])
        of_skins = np.array([self._of_skin(number, parts, weights) for number in range(len(self.skins))])
        return Populations(
            weights @ mean,
            np.sqrt(weights @ spread**2),
            of_skins.transpose(1, 0, 2),
            departs,
            share.sum(axis=(0, 2)),
            {
                tuple(own[state].departs for own, state in zip(self.skins, states, strict=True)): float(one)
                for states, one in zip(self.found, of_sets, strict=True)
            },
        )

    def _mean(self, part: _Part) -> Floats:
        return posterior(self.together(part.states), part.make.centre, part.make.precision)[0][part.kept]

    def _of_skin(self, number: int, parts: Sequence[_Part], weights: Floats) -> Floats:
        """Median and ends of the 95 % interval of its quantities (3, quantities)."""
        middles, deviations = [], []
        for part in parts:
            state = self.skins[number][part.states[number]]
            sisters = self.together(part.states, number)
            mean, covariance = (one[part.kept] for one in posterior(sisters, part.make.centre, part.make.precision))
            own = self.spreads[part.kept] ** 2 + state.further
            before = np.linalg.inv(covariance + own[:, None] * np.eye(own.shape[1]))
            after = np.linalg.inv(before + state.likelihood.precision)
            towards = state.likelihood.linear + np.einsum("spq,sq->sp", before, mean)
            middles.append(np.einsum("spq,sq->sp", after, towards))
            deviations.append(np.sqrt(np.diagonal(after, axis1=1, axis2=2)))
        middle, deviation = np.concatenate(middles), np.concatenate(deviations)
        columns = list(zip(middle.T, deviation.T, strict=True))
        return np.array([[mixture_quantile(level, weights, *column) for column in columns] for level in _LEVELS])
