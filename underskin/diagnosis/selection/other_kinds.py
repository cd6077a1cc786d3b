"""What curves of a block, or of the skin, tell of the skin's FRFs: one material, so one modulus, one adhesion, one law.

By Bayes' rule the evidence of a set of mechanisms on all recordings is that of the curves, times that of the FRFs under
what the curves leave of the parameters that both have. The curves are fitted with the modulus free, once for each
subset of mechanisms that act on both; Laplace's approximation of their posterior, divided by the prior, is the
likelihood (knowledge.py) that the FRFs are fitted under. Mechanisms of the curves alone (a stage that gives, friction
at the platens) are summed over.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from underskin.autodiff import Differentiated
from underskin.diagnosis.data.curve_samples import curve_lines
from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.hypothesis import curvature_of_prior, own_places
from underskin.diagnosis.inference.knowledge import Knowledge
from underskin.diagnosis.selection.priors import least_evidence, log_prior
from underskin.mechanisms.base import Kind, Unsupported
from underskin.mechanisms.models.composed import Model
from underskin.mechanisms.parameter import Parameter
from underskin.mechanisms.registry import Known
from underskin.recordings.campaign import Campaign
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, to_si

_BATCH = 0.02  # by how much the modulus of one elastomer differs from piece to piece (sd of its logarithm)
_EXTRAPOLATED = 0.7  # of what a law takes off a modulus at no strain: laws of one fit differ by that
_INFORMED = 0.8  # of a prior's deviation, above which a posterior's says nothing
_MODULUS_ERROR, _MODULUS = "modulus_error", ("", "youngs_modulus")
_MODULUS_SD = 1.5  # of the logarithm of a modulus that nobody declared

Quantity = tuple[str, str]  # a mechanism, or none, and what is known of it
# Of a prior: mean, variance, and whether it is flat: then the variance is that of a normal one as high
Moments = tuple[float, float, bool]


@dataclass(frozen=True, eq=False)
class OfCurves:
    """What one subset of the mechanisms that act on both kinds leaves to be known.

    `each` set of mechanisms that holds it and none else but the curves' own, with its log prior times evidence; `mean`
    (quantities,) and `covariance` of the `quantities` under the most probable one; `tolerance` is the standard
    deviation by which the logarithm of the modulus may differ from the skin's.
    """

    each: tuple[tuple[Explanation, float], ...]
    quantities: tuple[Quantity, ...]
    mean: Floats
    covariance: Floats
    tolerance: float = _BATCH

    @property
    def best(self) -> Explanation:
        """The most probable set's fit."""
        return max(self.each, key=lambda entry: entry[1])[0]

    @property
    def log_weight(self) -> float:
        """The logarithm of the sum over the curves' own mechanisms."""
        return float(np.logaddexp.reduce([weight for _, weight in self.each]))


class OtherKind:
    """The curves of one kind in a campaign that is diagnosed by recordings of another."""

    def __init__(self, campaign: Campaign, kind: Kind, table: SigmaTable, without: Sequence[str]) -> None:
        """Find the contact points with nothing missing, the modulus free."""
        skin = replace(campaign.skin, youngs_modulus_mpa=None)
        mechanisms = Known({_MODULUS_ERROR, *without})
        free = replace(campaign, skin=skin)
        mechanisms.bind(free, table, kind)
        self.kind = kind
        self.problem = FittingProblem(replace(curve_lines(free, kind), mechanisms=mechanisms), table)
        self.supported = tuple(name for name in mechanisms.named if self._supports(name))
        self.found: dict[frozenset[str], OfCurves] = {}

    def _supports(self, name: str) -> bool:
        try:
            self.problem.hypothesis((name,), placed=False)
        except Unsupported:
            return False
        return True

    @cached_property
    def nothing(self) -> Explanation:
        """The base model's fit."""
        (explanation,) = self.problem.explain([Request(())])
        assert explanation is not None
        return explanation

    def told(self, names: Sequence[str], of_both: Sequence[str]) -> OfCurves:
        """Under a set of mechanisms of those that act on both kinds; the curves' own ones may be there beside."""
        key = frozenset(name for name in names if name in self.supported and name in of_both)
        if key not in self.found:
            alone = [name for name in self.supported if name not in of_both]
            self.found[key] = self._tolerant(self._fitted(key, alone), key, of_both)
        return self.found[key]

    def _tolerant(self, told: OfCurves, names: frozenset[str], of_both: Sequence[str]) -> OfCurves:
        """Where a law extrapolates the modulus to no strain: as unsure as a good part of what it takes off."""
        plain = [name for name in names if not self.problem.lines.mechanisms[name].extrapolates_modulus]
        if len(plain) == len(names):
            return told
        taken_off = float(told.mean[0] - self.told(plain, of_both).mean[0])
        return replace(told, tolerance=float(np.hypot(_BATCH, _EXTRAPOLATED * taken_off)))

    def _fitted(self, both: frozenset[str], alone: Sequence[str]) -> OfCurves:
        sets = [both, *(both | {name} for name in alone)]
        ordered = [tuple(name for name in self.supported if name in one) for one in sets]
        fits = self.problem.explain([Request(names, begin=self.nothing.point) for names in ordered])
        without = fits[0]
        assert without is not None
        shown = without.log_evidence + least_evidence(without)
        each = tuple(  # the set without the curves' own first
            (fit, fit.log_evidence + log_prior(len(one) - len(both), len(alone)))
            for one, fit in zip(sets, fits, strict=True)
            if fit is not None and (fit is without or fit.log_evidence > shown)
        )
        best = max(each, key=lambda entry: entry[1])[0]
        return OfCurves(each, *_posterior(best, both))


def _posterior(explanation: Explanation, both: frozenset[str]) -> tuple[tuple[Quantity, ...], Floats, Floats]:
    """Mean and covariance of what both kinds know: the modulus' logarithm, the parameters of mechanisms."""
    hypothesis, fit = explanation.best.hypothesis, explanation.point.fit
    parameters, lines = explanation.model.parameters, hypothesis.lines
    quantities: list[Quantity] = [_MODULUS]
    values, rows = [], []
    modulus = [entry.name for entry in parameters].index("youngs_modulus")
    values.append(fit[modulus] + np.log(to_si("youngs_modulus_mpa", 1.0)))
    rows.append(np.eye(len(fit))[modulus])
    for name, place in own_places(explanation.names, lines).items():
        if name not in both:
            continue
        seeds = {
            entry.name: Differentiated(np.array([entry.from_fit(fit[index])]), _unit(entry, fit, index, len(fit)))
            for index, entry in zip(range(place.start, place.stop), parameters[place], strict=True)
        }
        for key, quantity in lines.mechanisms[name].common(lines.kind, seeds).items():
            quantities.append((name, key))
            values.append(float(quantity.value[0]))
            rows.append(quantity.slopes[:, 0])
    by_fit = np.array(rows)[:, hypothesis.mean_places]
    covariance = by_fit @ explanation.best.covariance @ by_fit.T
    return tuple(quantities), np.array(values), covariance


def _unit(entry: Parameter, fit: Floats, index: int, count: int) -> Floats:
    slopes = np.zeros((count, 1))
    slopes[index] = entry.from_fit(fit[index]) if entry.scale == "log" else 1.0
    return slopes


class Beside:
    """What the curves of all other kinds tell of models of one kind."""

    def __init__(self, kinds: Sequence[OtherKind]) -> None:
        """Of at least one kind."""
        self.kinds = tuple(kinds)
        self._of_both: dict[Kind, tuple[str, ...]] = {}

    def __call__(self, model: Model, lines: Lines) -> Knowledge:
        """Of this model's parameters, in their fit coordinates."""
        for kind in self.kinds if not self._of_both else ():
            self._of_both[kind.kind] = tuple(name for name in kind.supported if _acts_on(name, lines))
        each = [self._of_kind(kind, model, lines) for kind in self.kinds]
        return sum(each[1:], each[0])

    def told(self, kind: OtherKind, names: Sequence[str]) -> OfCurves:
        """What curves of a kind say under a set of mechanisms."""
        return kind.told(names, self._of_both[kind.kind])

    def log_evidence_apart(self, kind: OtherKind) -> float:
        """Of the curves of a kind alone, over the sets of mechanisms that were looked at."""
        both = len(self._of_both[kind.kind])
        return float(
            np.logaddexp.reduce([told.log_weight + log_prior(len(names), both) for names, told in kind.found.items()])
        )

    def alone(self, names: Sequence[str]) -> list[tuple[tuple[str, ...], float]]:
        """The sets of the curves' own mechanisms beside those of an answer, with their probabilities."""
        combined: list[tuple[tuple[str, ...], float]] = [((), 1.0)]
        for kind in self.kinds:
            told = self.told(kind, names)
            own = [
                (tuple(name for name in fit.names if name not in names), float(np.exp(weight - told.log_weight)))
                for fit, weight in told.each
            ]
            combined = [((*one, *other), share * more) for one, share in combined for other, more in own]
        return combined

    def _of_kind(self, kind: OtherKind, model: Model, lines: Lines) -> Knowledge:
        told = self.told(kind, model.names)
        matrix, offset, priors = _in_model(told.quantities, model, lines)
        return _likelihood(told, matrix, offset, priors)


def _acts_on(name: str, lines: Lines) -> bool:
    mechanism = lines.mechanisms.named.get(name)
    known = mechanism is not None and lines.kind in mechanism.kinds
    return known and mechanism is not None and mechanism.unsupported(lines.campaign, lines.kind) is None


def _in_model(quantities: Sequence[Quantity], model: Model, lines: Lines) -> tuple[Floats, Floats, list[Moments]]:
    """The quantities as matrix · x + offset of the model's fit coordinates, and the mean and variance of what is known
    of each without any recording; a row of zeros where the model has no such quantity."""
    places = own_places(model.names, lines)
    names = [entry.name for entry in model.parameters]
    matrix, offset = np.zeros((len(quantities), len(names))), np.zeros(len(quantities))
    priors: list[Moments] = []
    for row, (mechanism, key) in enumerate(quantities):
        if (mechanism, key) == _MODULUS:
            declared = lines.campaign.skin.youngs_modulus_mpa
            matrix[row, names.index("youngs_modulus")] = 1.0
            if _MODULUS_ERROR in places:
                matrix[row, places[_MODULUS_ERROR].start] = 1.0
            offset[row] = np.log(to_si("youngs_modulus_mpa", 1.0 if declared is None else declared))
            priors.append((np.nan, _MODULUS_SD**2, False))
            continue
        own = places.get(mechanism, slice(0, 0))
        found = [index for index in range(own.start, own.stop) if names[index] == key]
        if found:
            matrix[row, found[0]] = 1.0
            priors.append(_moments(model.parameters[found[0]]))
        else:
            priors.append((0.0, 0.0, False))
    return matrix, offset, priors


def _moments(entry: Parameter) -> Moments:
    precision, centre = curvature_of_prior(entry)
    low, high = entry.bounds
    return (
        ((low + high) / 2, (high - low) ** 2 / (2 * np.pi), True) if not precision else (centre, 1 / precision, False)
    )


def _likelihood(told: OfCurves, matrix: Floats, offset: Floats, priors: Sequence[Moments]) -> Knowledge:
    """ln L(x), so that ∫ L(q) p(q) dq over the quantities' prior is the curves' evidence; normal."""
    centre, variance, flat = (np.array(column) for column in zip(*priors, strict=True))
    centre = np.where(np.isnan(centre), told.mean, centre)
    flat = flat.astype(bool)
    known = matrix.any(axis=1) & (np.diag(told.covariance) < _INFORMED**2 * variance)
    if not known.any():
        return Knowledge(np.zeros((matrix.shape[1],) * 2), np.zeros(matrix.shape[1]), told.log_weight)
    after = np.linalg.inv(told.covariance[np.ix_(known, known)])
    centre, variance, flat = centre[known], variance[known], flat[known]
    before = np.diag(np.where(flat, 0.0, 1 / variance))
    precision = _definite(after - before)
    mean = np.linalg.solve(precision, after @ told.mean[known] - before @ centre)
    # The evidence is the integral of the likelihood over the prior, a flat one as a normal one of the same height
    prior = np.diag(variance)
    away = mean - centre
    volume = np.linalg.slogdet(np.eye(len(mean)) + precision @ prior)[1]
    height = told.log_weight + 0.5 * volume
    height += 0.5 * away @ np.linalg.solve(np.linalg.inv(precision) + prior, np.where(flat, 0.0, away))
    matrix, offset = matrix[known], offset[known]
    batch = np.diag([told.tolerance**2 if told.quantities[row] == _MODULUS else 0.0 for row in np.flatnonzero(known)])
    loose = np.eye(len(mean)) + precision @ batch
    height -= 0.5 * np.linalg.slogdet(loose)[1]
    tolerant: Floats = np.linalg.solve(loose, precision).astype(np.float64)
    return Knowledge.of(matrix, offset, mean, tolerant, float(height))


def _definite(precision: Floats) -> Floats:
    values, vectors = np.linalg.eigh(precision)
    return np.asarray((vectors * np.maximum(values, 1e-9)) @ vectors.T)
