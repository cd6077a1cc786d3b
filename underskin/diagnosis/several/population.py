"""Skins of one batch as members of a population: its mean and spread, and which skins depart from it, in what.

A skin's logarithms q (of E, thickness and d33) are normal about the batch's μ: q_i ~ N(μ, diag τ²). One that departs
has a far larger deviation D in one quantity. The likelihood of q by a skin's recordings in each of these states is
Gaussian. Given the states and τ all is normal; sums run over a grid of τ and over all relevant sets of departing skins,
enlarged by one skin at a time. Fewer than half of the skins depart: the batch is what most are.

The likelihood of one skin's q (`FleetSkin`) comes from fits under each set of mechanisms with all three free: E and
thickness about the batch's, as skins of one batch differ; and either of them unrestricted, in case the declared value
is wrong for this skin. It is Laplace's approximation of each fit with the priors removed. The logarithms of E and
thickness are relative to the declared ones, so that skins that are declared to differ can be of one batch.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.evidence import Evidence
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.gaussian import Gaussian
from underskin.diagnosis.inference.hypothesis import curvature_of_prior, parameter_slices
from underskin.diagnosis.reporting.numbers import mixture_quantile
from underskin.diagnosis.several.course import Bench, Candidate
from underskin.mechanisms.models.composed import Model
from underskin.mechanisms.registry import CATALOGUE
from underskin.units import Floats, Indices

_P_ANY_DEPARTS = 0.5  # prior probability that any skin of a fleet departs
_NODES, _STRIDES = 12, 2.7  # of the grid of ln τ, and its half-width in standard deviations
_PRUNE_NATS = 12.0  # nats behind the best set of departing skins beyond which a set is dropped
_MOST_SETS = 200  # with equally many departing skins
_NEGLIGIBLE = 1e-5  # of the probability, below which a set with a spread is left out of means and intervals
_LEVELS = (0.5, 0.025, 0.975)

STATED = 0.5  # least probability of a stated departure, and of a stated error of the values declared for all skins
REGULAR = ""  # the departure of a skin that does not depart


@dataclass(frozen=True, eq=False)
class State:
    """A skin's state: the name of the departure, the likelihood of the quantities, and the variances of the departure
    (quantities,).
    """

    departure: str
    likelihood: Gaussian
    variance: Floats


@dataclass(frozen=True, eq=False)
class Batch:
    """A prior of μ: log probability, centre and precision (quantities,)."""

    log_prior: float
    centre: Floats
    precision: Floats


@dataclass(frozen=True)
class Spread:
    """The prior of τ of one quantity: ln τ is normal about ln `usual` with standard deviation ln `factor`; τ is known
    where the factor is 1."""

    usual: float
    factor: float

    @property
    def nodes(self) -> list[tuple[float, float]]:
        """Values of τ with their log weights."""
        if self.factor == 1:
            return [(self.usual, 0.0)]
        deviations = np.linspace(-_STRIDES, _STRIDES, _NODES).tolist()
        return [(self.usual * self.factor**deviation, -0.5 * deviation**2) for deviation in deviations]


@dataclass(frozen=True, eq=False)
class Populations:
    """`mean` and `spread` τ of the batch (quantities,); `of_skins`: median and ends of the 95 % interval (3, skins,
    quantities); `departures`: their probabilities by name, for each skin; `batches`: the probability of each prior of
    μ; `joint`: the probability of the departures of all skins together, by their names."""

    mean: Floats
    spread: Floats
    of_skins: Floats
    departures: tuple[dict[str, float], ...]
    batches: Floats
    joint: Mapping[tuple[str, ...], float]

    @property
    def stated(self) -> tuple[str, ...]:
        """The departure of each skin: the most probable one of skins that more probably depart than not."""
        return tuple(
            REGULAR
            if probabilities[REGULAR] >= 1 - STATED
            else max((departure for departure in probabilities if departure != REGULAR), key=probabilities.__getitem__)
            for probabilities in self.departures
        )


def log_odds_of_departure(skins: int) -> float:
    """The prior log odds that one of `skins` departs."""
    return float(np.log(np.expm1(-np.log1p(-_P_ANY_DEPARTS) / skins)))


def populations(skins: Sequence[Sequence[State]], batches: Sequence[Batch], spreads: Sequence[Spread]) -> Populations:
    """From the states of each skin, the regular one first, the priors of μ, and those of τ (quantities,)."""
    assert all(states and states[0].departure == REGULAR for states in skins)
    return _Fleet(skins, batches, spreads).populations


@dataclass(frozen=True, eq=False)
class _Part:
    """A part of the posterior: the states of all skins, one prior of μ, the relevant spreads (spreads,), and their
    probabilities.
    """

    states: tuple[int, ...]
    batch: Batch
    spread_indices: Indices
    weights: Floats


class _Fleet:
    def __init__(self, skins: Sequence[Sequence[State]], batches: Sequence[Batch], spreads: Sequence[Spread]) -> None:
        self.skins, self.batches = skins, batches
        nodes = list(product(*(spread.nodes for spread in spreads)))
        self.spreads = np.array([[value for value, _ in node] for node in nodes])  # (spreads, quantities)
        shares = np.array([sum(share for _, share in node) for node in nodes])
        self.log_shares = shares - np.logaddexp.reduce(shares)
        # Likelihoods of μ by each skin in each state, (spreads,) each
        self.likelihoods = [
            [state.likelihood.of_mean(self.spreads**2 + state.variance) for state in states] for states in skins
        ]

    def mean_likelihood(self, states: Sequence[int], without: int | None = None) -> Gaussian:
        """The likelihood of μ by the skins in these states, leaving out one."""
        likelihoods = [
            of_skin[state]
            for number, (of_skin, state) in enumerate(zip(self.likelihoods, states, strict=True))
            if number != without
        ]
        return sum(likelihoods[1:], likelihoods[0])

    def log_weights(self, states: Sequence[int]) -> Floats:
        """Log weights of each prior of μ and each spread (batches, spreads)."""
        odds = log_odds_of_departure(len(self.skins))
        prior = sum(
            odds - np.log(len(skin_states) - 1) for skin_states, state in zip(self.skins, states, strict=True) if state
        )
        likelihood = self.mean_likelihood(states)
        log_integrals = [
            batch.log_prior + likelihood.log_integral(batch.centre, batch.precision) for batch in self.batches
        ]
        return np.asarray(np.array(log_integrals) + self.log_shares + prior)

    @cached_property
    def log_weights_by_states(self) -> dict[tuple[int, ...], Floats]:
        """The relevant states of all skins, with their log weights."""
        current = {none: self.log_weights(none) for none in [(0,) * len(self.skins)]}
        all_weights = dict(current)
        for _ in range((len(self.skins) - 1) // 2):
            longer = {
                (*states[:number], other, *states[number + 1 :])
                for states in current
                for number, skin_states in enumerate(self.skins)
                if not states[number]
                for other in range(1, len(skin_states))
            }
            weights = {states: self.log_weights(states) for states in sorted(longer)}
            totals = {states: float(np.logaddexp.reduce(values, axis=None)) for states, values in weights.items()}
            best = max(
                float(np.logaddexp.reduce(values, axis=None)) for values in (*all_weights.values(), *weights.values())
            )
            ranked = sorted(totals, key=lambda states: -totals[states])[:_MOST_SETS]
            current = {states: weights[states] for states in ranked if totals[states] > best - _PRUNE_NATS}
            all_weights |= current
        return all_weights

    @cached_property
    def populations(self) -> Populations:
        log_weights = np.array(list(self.log_weights_by_states.values()))  # (sets, batches, spreads)
        share = np.exp(log_weights - np.logaddexp.reduce(log_weights, axis=None))
        of_sets = share.sum(axis=(1, 2))
        departs = tuple(
            {
                state.departure: float(
                    of_sets[[states[number] == index for states in self.log_weights_by_states]].sum()
                )
                for index, state in enumerate(skin_states)
            }
            for number, skin_states in enumerate(self.skins)
        )
        parts = [
            _Part(states, batch, spread_indices, of_batch[spread_indices])
            for states, of_batches in zip(self.log_weights_by_states, share, strict=True)
            for batch, of_batch in zip(self.batches, of_batches, strict=True)
            if len(spread_indices := np.flatnonzero(of_batch > _NEGLIGIBLE))
        ]
        weights = np.concatenate([part.weights for part in parts])
        weights /= weights.sum()
        mean = np.concatenate([self._mean(part) for part in parts])
        spread = np.concatenate([self.spreads[part.spread_indices] for part in parts])
        of_skins = np.array([self._of_skin(number, parts, weights) for number in range(len(self.skins))])
        return Populations(
            weights @ mean,
            np.sqrt(weights @ spread**2),
            of_skins.transpose(1, 0, 2),
            departs,
            share.sum(axis=(0, 2)),
            {
                tuple(
                    skin_states[state].departure for skin_states, state in zip(self.skins, states, strict=True)
                ): float(share_of_set)
                for states, share_of_set in zip(self.log_weights_by_states, of_sets, strict=True)
            },
        )

    def _mean(self, part: _Part) -> Floats:
        return self.mean_likelihood(part.states).posterior(part.batch.centre, part.batch.precision)[0][
            part.spread_indices
        ]

    def _of_skin(self, number: int, parts: Sequence[_Part], weights: Floats) -> Floats:
        """Median and ends of the 95 % interval of its quantities (3, quantities)."""
        middles, deviations = [], []
        for part in parts:
            state = self.skins[number][part.states[number]]
            other_specimens = self.mean_likelihood(part.states, number)
            mean, covariance = (
                moment[part.spread_indices]
                for moment in other_specimens.posterior(part.batch.centre, part.batch.precision)
            )
            variance = self.spreads[part.spread_indices] ** 2 + state.variance
            before = np.linalg.inv(covariance + variance[:, None] * np.eye(variance.shape[1]))
            after = np.linalg.inv(before + state.likelihood.precision)
            towards = state.likelihood.linear + np.einsum("spq,sq->sp", before, mean)
            middles.append(np.einsum("spq,sq->sp", after, towards))
            deviations.append(np.sqrt(np.diagonal(after, axis1=1, axis2=2)))
        middle, deviation = np.concatenate(middles), np.concatenate(deviations)
        columns = list(zip(middle.T, deviation.T, strict=True))
        return np.array([[mixture_quantile(level, weights, *column) for column in columns] for level in _LEVELS])


MODULUS, THICKNESS, D33 = "modulus_error", "thickness_error", "d33"
ERRORS = (MODULUS, THICKNESS)
QUANTITIES = {MODULUS: "youngs_modulus", THICKNESS: "thickness", D33: "d33"}  # by departure
_ABOUT_BATCH = (0.1, 0.01)  # deviations of ln E and ln h of regular skins about the batch's
_FAR_IN_D33 = 0.4  # an amplifier's other range
FAR = (*(curvature_of_prior(CATALOGUE[name].parameters_stated[0])[0] ** -0.5 for name in ERRORS), _FAR_IN_D33)
# Deviations of ln E, ln h and ln d33 of departing skins, those of E and h from the priors of the mechanisms
D33_PRIOR = (float(np.log(15.0)), 1.5)
_BEYOND = 2.0  # deviations from the batch beyond which a regular fit is no approximation

Likelihoods = dict[tuple[frozenset[str], str], Gaussian]  # by set and departure


class FleetSkin:
    """One skin of a fleet, fitted under sets of mechanisms, the first of them empty."""

    def __init__(
        self,
        candidate: Candidate,
        sets: Sequence[frozenset[str]],
        bench: Bench,
        centre: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """Fit all sets; `bench` has the priors of the scatters, `centre` is ln of the batch's E and thickness over the
        declared ones."""
        self.candidate = candidate
        self._centre = centre
        skin = candidate.problem.lines.campaign.skin
        assert skin.youngs_modulus_mpa is not None  # FRFs have no model without them
        assert skin.thickness_mm is not None
        self.declared: Floats = np.log([skin.youngs_modulus_mpa, skin.thickness_mm, 1.0])  # (quantities,)
        tried = set(candidate.problem.lines.mechanisms.named) - set(candidate.search.unsupported)
        self.errors = tuple(name for name in ERRORS if name in tried)
        self.departures = (*self.errors, D33)
        self._fitted = self._fits(tuple(dict.fromkeys(candidate.supported(names) for names in sets)), bench)

    def log_evidence(self, names: frozenset[str], skins: int) -> float:
        """Of a set, over the regular state and all departures, as one of `skins`."""
        supported = self.candidate.supported(names)
        odds = log_odds_of_departure(skins) - float(np.log(len(self.departures)))
        weights = [
            self._log_integral(self._fitted[supported, departure], departure) + odds * (departure != REGULAR)
            for departure in (REGULAR, *self.departures)
            if (supported, departure) in self._fitted
        ]
        return float(np.logaddexp.reduce(weights)) if weights else -np.inf

    def departing(self, error: str) -> tuple[float, float] | None:
        """With a wrong declared value and no mechanism: mean and variance of the log of its error."""
        likelihood = self._fitted.get((frozenset(), error))
        if likelihood is None:
            return None
        row = ERRORS.index(error)
        mean, covariance = likelihood.posterior(*self._prior(error))
        return float(mean[row]), float(covariance[row, row])

    def states(self, log_shares: Mapping[frozenset[str], float]) -> list[State]:
        """The states under sets of mechanisms of these prior log probabilities, the regular one first."""
        states = []
        for departure in (REGULAR, *self.departures):
            components = [
                (share, self._fitted[supported, departure])
                for names, share in log_shares.items()
                if np.isfinite(share) and ((supported := self.candidate.supported(names)), departure) in self._fitted
            ]
            if components:
                states.append(
                    State(
                        departure,
                        Gaussian.mixture(components, *self._prior(departure)),
                        self._departure_variance(departure),
                    )
                )
        return states

    def _departure_variance(self, departure: str) -> Floats:
        return np.array([far**2 * (departure == name) for name, far in zip(QUANTITIES, FAR, strict=True)])

    def _prior(self, departure: str) -> tuple[Floats, Floats]:
        """Prior centre and precision of the quantities."""
        centre = np.array([*self._centre, D33_PRIOR[0]])
        return centre, 1 / (np.array([*_ABOUT_BATCH, D33_PRIOR[1]]) ** 2 + self._departure_variance(departure))

    def _log_integral(self, likelihood: Gaussian, departure: str) -> float:
        return likelihood.log_integral(*self._prior(departure)).item()

    def _fits(self, sets: Sequence[frozenset[str]], bench: Bench) -> Likelihoods:
        """Likelihoods of the sets and departures that can be fitted."""
        likelihoods: Likelihoods = {}
        lines, table = self.candidate.problem.lines, self.candidate.problem.table
        for departure in (REGULAR, *self.errors):
            held = tuple(name for name in self.errors if name != departure)

            def about_batch(model: Model, lines: Lines, held: Sequence[str] = held) -> Gaussian:
                return self._about_batch(model, lines, held)

            problem = FittingProblem(lines, table, about_batch, bench.gain)
            for names, fit in zip(sets, _explained(problem, [{*names, *self.errors} for names in sets]), strict=True):
                if fit is not None:
                    components = [
                        (_log_share(fit, evidence, bench), self._likelihood(fit, evidence, held))
                        for _, evidence in fit.fits
                    ]
                    likelihoods[names, departure] = Gaussian.mixture(components, *self._prior(departure))
        for names in sets:
            self._replace_far_regular(likelihoods, names)
            if (names, REGULAR) in likelihoods:
                likelihoods[names, D33] = likelihoods[names, REGULAR]
        return likelihoods

    def _replace_far_regular(self, likelihoods: Likelihoods, names: frozenset[str]) -> None:
        """Replace the regular fit, which is held near the batch, by a departing one where the skin is far from the
        batch.

        There its quadratic is no approximation: its likelihood would grow without limit.
        """
        others = [name for name in self.errors if (names, name) in likelihoods]
        if (names, REGULAR) not in likelihoods or not others:
            return
        centre, precision = self._prior(REGULAR)
        mean, _ = likelihoods[names, REGULAR].posterior(centre, precision)
        if (np.abs(mean - centre) * np.sqrt(precision))[: len(ERRORS)].max() > _BEYOND:
            nearest = max(others, key=lambda name: self._log_integral(likelihoods[names, name], name))
            likelihoods[names, REGULAR] = likelihoods[names, nearest]

    def _about_batch(self, model: Model, lines: Lines, held: Sequence[str]) -> Gaussian:
        """The likelihood that `held` E and thickness are near the batch's, times that by recordings of other kinds."""
        other_kinds = self.candidate.problem.other_kinds
        slices = parameter_slices(model.names, lines)
        rows = [ERRORS.index(name) for name in held]
        matrix = np.eye(len(model.parameters))[[slices[name].start for name in held]]
        centre, precision = np.array(self._centre)[rows], np.diag(np.array(_ABOUT_BATCH)[rows] ** -2.0)
        about = Gaussian.of(centre, precision, 0.0).over(matrix, np.zeros(len(rows)))
        from_others = None if other_kinds is None else other_kinds(model, lines)
        return about if from_others is None else from_others + about

    def _likelihood(self, fit: Explanation, best: Evidence, held: Sequence[str]) -> Gaussian:
        """The likelihood of the quantities by one fit: the posterior divided by the priors, of errors and usual
        ones."""
        slices = parameter_slices(fit.names, best.hypothesis.lines)
        names = [parameter.name for parameter in fit.model.parameters]
        matrix = np.zeros((len(QUANTITIES), len(names)))
        centre, variance, log_evidence = np.zeros(len(QUANTITIES)), np.zeros(len(QUANTITIES)), best.log_evidence
        for row, (error, quantity) in enumerate(QUANTITIES.items()):
            of_error = [slices[error].start] if error in self.errors else []
            for index in (names.index(quantity), *of_error):
                matrix[row, index] = 1.0
                precision, middle = curvature_of_prior(fit.model.parameters[index])
                if index in of_error and error in held:
                    about, batch_precision = self._centre[row], _ABOUT_BATCH[row] ** -2
                    both = 1 / precision + 1 / batch_precision
                    log_evidence += 0.5 * (np.log(both * batch_precision) + (about - middle) ** 2 / both)
                    precision, middle = (
                        precision + batch_precision,
                        (precision * middle + batch_precision * about) / (precision + batch_precision),
                    )
                centre[row] += middle
                variance[row] += 1 / precision
        by_fit = matrix[:, best.hypothesis.mean_indices]
        mean = matrix @ best.point.fit
        return Gaussian.from_posterior(log_evidence, mean, by_fit @ best.covariance @ by_fit.T, centre, 1 / variance)


def _log_share(fit: Explanation, evidence: Evidence, bench: Bench) -> float:
    """Log prior of a fit with or without positioning scatter, where there are both."""
    if len(fit.fits) == 1:
        return 0.0
    return float(
        np.log(bench.p_position_scatter if evidence.hypothesis.has_position_scatter else 1 - bench.p_position_scatter)
    )


def _explained(problem: FittingProblem, sets: Sequence[set[str]]) -> list[Explanation | None]:
    """Explanations of the sets, None where one is far less probable than the others; the first is not compared."""
    catalogue = problem.lines.mechanisms.named
    requests = [Request(tuple(name for name in catalogue if name in names)) for names in sets]
    return [*problem.explain(requests[:1]), *problem.explain(requests[1:])]
