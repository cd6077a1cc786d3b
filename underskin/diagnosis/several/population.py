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
from functools import cached_property, partial
from itertools import product

import numpy as np
from scipy.special import expit, logit

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.evidence import NEGLIGIBLE_NATS, Evidence
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.fit import Scatter
from underskin.diagnosis.inference.gaussian import Gaussian
from underskin.diagnosis.inference.hypothesis import curvature_of_prior, parameter_slices
from underskin.diagnosis.noise import Plateau
from underskin.diagnosis.reporting.numbers import QUANTILES_OF_95
from underskin.diagnosis.several.histories import CampaignFits
from underskin.inversion.mixed_model import NO_POSITION_SCATTER, mixture_quantile
from underskin.mechanisms.models import composition
from underskin.mechanisms.models.composed import Model
from underskin.mechanisms.registry import CATALOGUE
from underskin.units import Floats

_NEGLIGIBLE = 1e-5  # of the probability, below which a set with a spread is left out of means and intervals
_P_ANY_DEPARTS = 0.5  # prior probability that any skin of a fleet departs
_MOST_SETS = 200  # with equally many departing skins
STATED = 0.5  # least probability of a stated departure, and of a stated error of the values declared for all skins
REGULAR = ""  # the departure of a skin that does not depart


@dataclass(frozen=True)
class Spread:
    """The prior of τ of one quantity: ln τ is normal about ln `usual` with standard deviation ln `factor`; τ is known
    where the factor is 1."""

    usual: float
    factor: float

    @property
    def nodes(self) -> list[tuple[float, float]]:
        """Values of τ with their log weights, to 2.7 standard deviations."""
        if self.factor == 1:
            return [(self.usual, 0.0)]
        deviations = np.linspace(-2.7, 2.7, 12).tolist()
        return [(self.usual * self.factor**deviation, -0.5 * deviation**2) for deviation in deviations]


@dataclass(frozen=True)
class Quantity:
    """A quantity that skins of a batch share, and the standard deviations of its logarithm: of the batch's mean about
    the declared value, of a regular skin in its own fit, of a departing skin, and from skin to skin."""

    departure: str
    name: str
    unit: str
    declared: float
    about_batch: float
    far: float
    spread: Spread


def _far(error: str) -> float:
    return curvature_of_prior(CATALOGUE[error].parameters_stated[0])[0] ** -0.5


D33, LOG_D33_PC_PER_N = composition.D33.name, composition.D33.start
# Pieces of one cure and of one poled film differ by some percent; a mould sets the thickness. An amplifier's other
# range changes d33 by half; E and h depart as the priors of the mechanisms have it.
QUANTITIES = (
    Quantity("modulus_error", "youngs_modulus", "MPa", 0.02, 0.1, _far("modulus_error"), Spread(0.03, 2.0)),
    Quantity("thickness_error", "thickness", "mm", 0.01, 0.01, _far("thickness_error"), Spread(0.01, 1.0)),
    Quantity(D33, "d33", "pC/N", 1.5, 1.5, 0.4, Spread(0.03, 2.0)),
)
DEPARTURES = tuple(quantity.departure for quantity in QUANTITIES)
ERRORS = tuple(departure for departure in DEPARTURES if departure != D33)
FAR_SDS = 2.0  # deviations from the batch beyond which a regular fit is no approximation, and other values are tried


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


@dataclass(frozen=True, eq=False)
class Populations:
    """`mean` and `spread` τ of the batch (quantities,); `of_skins`: median and ends of the 95 % interval (3, skins,
    quantities); `batches`: the probability of each prior of μ; `joint`: the probability of the departures of all skins
    together, by their names."""

    mean: Floats
    spread: Floats
    of_skins: Floats
    batches: Floats
    joint: Mapping[tuple[str, ...], float]

    @cached_property
    def departures(self) -> list[dict[str, float]]:
        """Their probabilities by name, for each skin."""
        of_skins: list[dict[str, float]] = [{REGULAR: 0.0} for _ in next(iter(self.joint))]
        for names, share in self.joint.items():
            for of_skin, name in zip(of_skins, names, strict=True):
                of_skin[name] = of_skin.get(name, 0.0) + share
        return of_skins

    @cached_property
    def stated(self) -> tuple[str, ...]:
        """The departure of each skin: the most probable one of skins that more probably depart than not."""
        return tuple(
            REGULAR
            if of_skin[REGULAR] >= 1 - STATED
            else max((departure for departure in of_skin if departure != REGULAR), key=of_skin.__getitem__)
            for of_skin in self.departures
        )


def log_odds_of_departure(skins: int) -> float:
    """The prior log odds that one of `skins` departs."""
    return float(np.log(np.expm1(-np.log1p(-_P_ANY_DEPARTS) / skins)))


def populations(skins: Sequence[Sequence[State]], batches: Sequence[Batch], spreads: Sequence[Spread]) -> Populations:
    """From the states of each skin, the regular one first, the priors of μ, and those of τ (quantities,)."""
    return _Fleet(skins, batches, spreads).populations()


class _Fleet:
    def __init__(self, skins: Sequence[Sequence[State]], batches: Sequence[Batch], spreads: Sequence[Spread]) -> None:
        self.skins, self.batches = skins, batches
        nodes = np.array(list(product(*(spread.nodes for spread in spreads))))
        self.spreads, shares = nodes[..., 0], nodes[..., 1].sum(axis=1)  # (spreads, quantities), (spreads,)
        self.log_shares = shares - np.logaddexp.reduce(shares)
        # Likelihoods of μ by each skin in each state, (spreads,) each
        self.likelihoods = [
            [state.likelihood.of_mean(self.spreads**2 + state.variance) for state in states] for states in skins
        ]

    def _of_mean(self, states: Sequence[int], without: int | None = None) -> Gaussian:
        """The likelihood of μ by the skins in these states, leaving out one."""
        pairs = enumerate(zip(self.likelihoods, states, strict=True))
        first, *others = (of_skin[state] for number, (of_skin, state) in pairs if number != without)
        return sum(others, first)

    def _log_weights(self, states: Sequence[int]) -> Floats:
        """Log weights of each prior of μ and each spread (batches, spreads)."""
        odds, likelihood = log_odds_of_departure(len(self.skins)), self._of_mean(states)
        departs = zip(self.skins, states, strict=True)
        prior = sum(odds - np.log(len(skin_states) - 1) for skin_states, state in departs if state)
        integrals = [batch.log_prior + likelihood.log_integral(batch.centre, batch.precision) for batch in self.batches]
        return np.array(integrals) + self.log_shares + prior

    def _log_weights_by_states(self) -> dict[tuple[int, ...], Floats]:
        """The relevant states of all skins, with their log weights."""
        none = (0,) * len(self.skins)
        current = {none: self._log_weights(none)}
        all_weights, best = dict(current), -np.inf
        for _ in range((len(self.skins) - 1) // 2):
            longer = {
                (*states[:number], other, *states[number + 1 :])
                for states in current
                for number, skin_states in enumerate(self.skins)
                if not states[number]
                for other in range(1, len(skin_states))
            }
            weights = {states: self._log_weights(states) for states in sorted(longer)}
            totals = {states: float(np.logaddexp.reduce(values, axis=None)) for states, values in weights.items()}
            best = max(best, float(np.logaddexp.reduce(all_weights[none], axis=None)), *totals.values())
            ranked = sorted(totals, key=lambda states: -totals[states])[:_MOST_SETS]
            current = {states: weights[states] for states in ranked if totals[states] > best - NEGLIGIBLE_NATS}
            all_weights |= current
        return all_weights

    def populations(self) -> Populations:
        """Sums over all relevant states, priors of μ and spreads."""
        log_weights = self._log_weights_by_states()
        log_share = np.array(list(log_weights.values()))  # (sets, batches, spreads)
        share = np.exp(log_share - np.logaddexp.reduce(log_share, axis=None))
        weights, mean, spread, centres, deviations = [], [], [], [], []
        for states, of_batches in zip(log_weights, share, strict=True):
            for batch, of_spreads in zip(self.batches, of_batches, strict=True):
                nodes = np.flatnonzero(of_spreads > _NEGLIGIBLE)
                if len(nodes):
                    weights.append(of_spreads[nodes])
                    spread.append(self.spreads[nodes])
                    mean.append(self._of_mean(states).posterior(batch.centre, batch.precision)[0][nodes])
                    by_skin = [self._of_skin(number, states, batch) for number in range(len(self.skins))]
                    centres.append(np.array([at[nodes] for at, _ in by_skin]))  # (skins, spreads, quantities)
                    deviations.append(np.array([sd[nodes] for _, sd in by_skin]))
        weight = np.concatenate(weights) / sum(part.sum() for part in weights)
        centre, deviation = (np.concatenate(parts, axis=1).swapaxes(1, 2) for parts in (centres, deviations))
        of_skins = [mixture_quantile(weight, centre, deviation, level) for level in QUANTILES_OF_95]
        joint = {
            tuple(skin_states[state].departure for skin_states, state in zip(self.skins, states, strict=True)): of_set
            for states, of_set in zip(log_weights, share.sum(axis=(1, 2)).tolist(), strict=True)
        }
        return Populations(
            weight @ np.concatenate(mean),
            np.sqrt(weight @ np.concatenate(spread) ** 2),
            np.array(of_skins),
            share.sum(axis=(0, 2)),
            joint,
        )

    def _of_skin(self, number: int, states: Sequence[int], batch: Batch) -> tuple[Floats, Floats]:
        """Mean and standard deviation of one skin's quantities (spreads, quantities)."""
        state = self.skins[number][states[number]]
        of_mean = self._of_mean(states, number) + Gaussian.of(batch.centre, np.diag(batch.precision), 0.0)
        by_others = of_mean.of_mean(self.spreads**2 + state.variance)
        flat = np.zeros(self.spreads.shape[1])
        mean, covariance = (by_others + state.likelihood).posterior(flat, flat)
        return mean, np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))


@dataclass(frozen=True)
class Bench:
    """The prior of the gain scatter's logarithm, and the probability of positioning scatter."""

    gain: Plateau
    p_position_scatter: float


_FROM_SKIN_TO_SKIN = 0.2  # deviation of the logarithm of the gain scatter on one bench
_LEAST_PROBABILITY = 0.02  # of positioning scatter, and of none


def benches(candidates: Sequence[CampaignFits]) -> list[Bench]:
    """The scatters of each skin by those of the other skins on the same bench, of which there must be at least one.

    A few recordings do not determine them: with too little gain scatter intervals are too narrow, and with a wrong
    positioning scatter all d33 are biased.
    """
    leaders = [candidate.search.fit_behind(candidate.search.answers[0]) for candidate in candidates]
    log_gains = np.array([leader.point.covariance[Scatter.GAIN] for leader in leaders])
    recordings = np.array([leader.best.hypothesis.lines.recordings for leader in leaders])
    precision = 1 / (_FROM_SKIN_TO_SKIN**2 + 0.5 / np.maximum(recordings - 1, 1))
    ends = (_LEAST_PROBABILITY, 1 - _LEAST_PROBABILITY)
    usual = logit(1 - NO_POSITION_SCATTER)
    log_odds = logit(np.clip([leader.p_position_scatter for leader in leaders], *ends)) - usual
    priors = []
    for number in range(len(candidates)):
        others = np.arange(len(candidates)) != number
        total = precision[others].sum()
        mean, sd = precision[others] @ log_gains[others] / total, np.hypot(_FROM_SKIN_TO_SKIN, total**-0.5)
        p_position_scatter = np.clip(expit(usual + log_odds[others].sum()), *ends)
        priors.append(Bench(Plateau.normal(float(mean), float(sd)), float(p_position_scatter)))
    return priors


class FleetSkin:
    """One skin of a fleet, fitted under sets of mechanisms, the first of them empty."""

    def __init__(
        self,
        candidate: CampaignFits,
        bench: Bench,
        sets: Sequence[frozenset[str]],
        centre: tuple[float, float],
    ) -> None:
        """Fit all sets; `bench` has the priors of the scatters, `centre` is ln of the batch's E and thickness over the
        declared ones."""
        self.candidate = candidate
        self._centre, self._bench = np.array([*centre, LOG_D33_PC_PER_N]), bench
        skin = candidate.problem.lines.campaign.skin
        assert skin.youngs_modulus_mpa is not None  # FRFs have no model without them
        assert skin.thickness_mm is not None
        self.declared: Floats = np.log([skin.youngs_modulus_mpa, skin.thickness_mm, 1.0])  # (quantities,)
        tried = set(candidate.problem.lines.mechanisms.named) - set(candidate.search.unsupported)
        self.errors = tuple(name for name in ERRORS if name in tried)
        self._states = (REGULAR, *self.errors, D33)
        self._fitted: dict[tuple[frozenset[str], str], Gaussian] = {}  # by set and departure
        self._fit(list(dict.fromkeys(candidate.supported(names) for names in sets)))

    def log_evidence(self, names: frozenset[str], skins: int) -> float:
        """Of a set, over the regular state and all departures, as one of `skins`."""
        supported = self.candidate.supported(names)
        odds = log_odds_of_departure(skins) - float(np.log(len(self.errors) + 1))
        weights = [
            self._log_integral(self._fitted[supported, departure], departure) + odds * (departure != REGULAR)
            for departure in self._states
            if (supported, departure) in self._fitted
        ]
        return float(np.logaddexp.reduce(weights)) if weights else -np.inf

    def departing(self, error: str) -> tuple[float, float] | None:
        """With a wrong declared value and no mechanism: mean and variance of the log of its error."""
        likelihood = self._fitted.get((frozenset(), error))
        if likelihood is None:
            return None
        row = DEPARTURES.index(error)
        mean, covariance = likelihood.posterior(*self._prior(error))
        return float(mean[row]), float(covariance[row, row])

    def states(self, log_shares: Mapping[frozenset[str], float]) -> list[State]:
        """The states under sets of mechanisms of these prior log probabilities, the regular one first."""
        states = []
        for departure in self._states:
            components = [
                (share, self._fitted[supported, departure])
                for names, share in log_shares.items()
                if np.isfinite(share) and ((supported := self.candidate.supported(names)), departure) in self._fitted
            ]
            if components:
                likelihood = Gaussian.mixture(components, *self._prior(departure))
                states.append(State(departure, likelihood, _departure_variance(departure)))
        return states

    def _prior(self, departure: str) -> tuple[Floats, Floats]:
        """Prior centre and precision of the quantities."""
        about_batch = np.array([quantity.about_batch for quantity in QUANTITIES])
        return self._centre, 1 / (about_batch**2 + _departure_variance(departure))

    def _log_integral(self, likelihood: Gaussian, departure: str) -> float:
        return likelihood.log_integral(*self._prior(departure)).item()

    def _fit(self, sets: Sequence[frozenset[str]]) -> None:
        """Find the likelihoods of the sets and departures that can be fitted."""
        alone = self.candidate.problem
        for departure in (REGULAR, *self.errors):
            held = tuple(name for name in self.errors if name != departure)
            problem = FittingProblem(alone.lines, alone.table, partial(self._about_batch, held), self._bench.gain)
            for names, fit in zip(sets, _explained(problem, [{*names, *self.errors} for names in sets]), strict=True):
                if fit is not None:
                    components = [
                        (self._log_share(fit, evidence), self._likelihood(fit, evidence, held))
                        for _, evidence in fit.fits
                    ]
                    self._fitted[names, departure] = Gaussian.mixture(components, *self._prior(departure))
        for names in sets:
            if (names, REGULAR) in self._fitted:
                self._fitted[names, REGULAR] = self._fitted[names, D33] = self._regular(names)

    def _regular(self, names: frozenset[str]) -> Gaussian:
        """The regular fit, which is held near the batch; where the skin is far from the batch, a departing one.

        There the quadratic of the regular fit is no approximation: its likelihood would grow without limit.
        """
        regular = self._fitted[names, REGULAR]
        others = [name for name in self.errors if (names, name) in self._fitted]
        centre, precision = self._prior(REGULAR)
        mean, _ = regular.posterior(centre, precision)
        if not others or (np.abs(mean - centre) * np.sqrt(precision))[: len(ERRORS)].max() <= FAR_SDS:
            return regular
        return self._fitted[names, max(others, key=lambda name: self._log_integral(self._fitted[names, name], name))]

    def _about_batch(self, held: Sequence[str], model: Model, lines: Lines) -> Gaussian:
        """The likelihood that `held` E and thickness are near the batch's, times that by recordings of other kinds."""
        other_kinds = self.candidate.problem.other_kinds
        slices = parameter_slices(model.names, lines)
        matrix = np.eye(len(model.parameters))[[slices[name].start for name in held]]
        about = self._near_batch([DEPARTURES.index(name) for name in held]).over(matrix, np.zeros(len(held)))
        from_others = None if other_kinds is None else other_kinds(model, lines)
        return about if from_others is None else from_others + about

    def _near_batch(self, rows: Sequence[int]) -> Gaussian:
        """The likelihood that these quantities are near the batch's."""
        precision = np.diag([QUANTITIES[row].about_batch ** -2.0 for row in rows])
        return Gaussian.of(self._centre[list(rows)], precision, 0.0)

    def _likelihood(self, fit: Explanation, best: Evidence, held: Sequence[str]) -> Gaussian:
        """The likelihood of the quantities by one fit: the posterior divided by the priors, of errors and usual
        ones."""
        slices = fit.spans
        names = [parameter.name for parameter in fit.model.parameters]
        matrix = np.zeros((len(QUANTITIES), len(names)))
        centre, variance, log_evidence = np.zeros(len(QUANTITIES)), np.zeros(len(QUANTITIES)), best.log_evidence
        for row, quantity in enumerate(QUANTITIES):
            of_error = [slices[quantity.departure].start] if quantity.departure in self.errors else []
            for index in (names.index(quantity.name), *of_error):
                matrix[row, index] = 1.0
                precision, middle = (np.array([part]) for part in curvature_of_prior(fit.model.parameters[index]))
                prior_variance = 1 / precision
                if index in of_error and quantity.departure in held:
                    about = self._near_batch([row])
                    log_evidence -= about.log_integral(middle, precision).item()
                    middle, prior_variance = about.posterior(middle, precision)
                centre[row] += middle.item()
                variance[row] += prior_variance.item()
        by_fit = matrix[:, best.hypothesis.mean_indices]
        mean = matrix @ best.point.fit
        return Gaussian.from_posterior(log_evidence, mean, by_fit @ best.covariance @ by_fit.T, centre, 1 / variance)

    def _log_share(self, fit: Explanation, evidence: Evidence) -> float:
        """Log prior of a fit with or without positioning scatter, where there are both."""
        share = self._bench.p_position_scatter
        share = share if evidence.hypothesis.has_position_scatter else 1 - share
        return float(np.log(share)) if len(fit.fits) > 1 else 0.0


def _departure_variance(departure: str) -> Floats:
    return np.array([quantity.far**2 * (departure == quantity.departure) for quantity in QUANTITIES])


def _explained(problem: FittingProblem, sets: Sequence[set[str]]) -> list[Explanation | None]:
    """Explanations of the sets, None where one is far less probable than the others; the first is not compared."""
    catalogue = problem.lines.mechanisms.named
    requests = [Request(tuple(name for name in catalogue if name in names)) for names in sets]
    return [*problem.explain_all(requests[:1]), *problem.explain_all(requests[1:])]
