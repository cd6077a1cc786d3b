"""What curves of a block, or of the skin, tell of the skin's FRFs: one material, so one modulus, one adhesion, one law.

By Bayes' rule the evidence of a set of mechanisms on all recordings is that of the curves, times that of the FRFs under
what the curves leave of the parameters that both have. Laplace's approximation of the curves' posterior
(curve_knowledge.py), divided by the prior, is the likelihood (knowledge.py) that the FRFs are fitted under.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.explanation import Explanation
from underskin.diagnosis.inference.hypothesis import own_places, quadratic_of_prior
from underskin.diagnosis.inference.knowledge import Knowledge
from underskin.diagnosis.selection.curve_knowledge import MODULUS, MODULUS_ERROR, OfCurves, OtherKind, Quantity
from underskin.diagnosis.selection.priors import LARGEST, log_prior
from underskin.diagnosis.selection.unknown_thickness import THICKNESS, THICKNESS_ERROR, UNKNOWN_THICKNESS
from underskin.mechanisms.base import Kind
from underskin.mechanisms.models.composed import Model
from underskin.mechanisms.parameter import Parameter
from underskin.units import Floats, to_si

_INFORMED = 0.8  # of a prior's deviation, above which a posterior's says nothing
_ASKED_FOR, _BEHIND = 3, 12.0  # sets of a kind of curves, and how far behind the best one in nats
_MODULUS_SD = 1.5  # of the logarithm of a modulus that nobody declared
_LEAST_CORRELATION = 1e-11  # eigenvalue of correlations: less is rounding

# Of a prior as a normal one: mean, variance, whether it is flat (then the variance is that of one as high), and by how
# much the logarithm of its density at the curves' mean exceeds that normal one's
Moments = tuple[float, float, bool, float]


class Beside:
    """What the curves of all other kinds tell of models of one kind."""

    def __init__(self, kinds: Sequence[OtherKind], alone: Sequence[Explanation]) -> None:
        """Of at least one kind; `alone` are the sets that were fitted to the recordings without these."""
        self.kinds = tuple(kinds)
        self._alone = sorted(alone, key=lambda entry: -entry.log_evidence)
        self._of_both: dict[Kind, tuple[str, ...]] = {}

    def __call__(self, model: Model, lines: Lines) -> Knowledge:
        """Of this model's parameters, in their fit coordinates."""
        self._bind(lines)
        each = [self._of_kind(kind, model, lines) for kind in self.kinds]
        return sum(each[1:], each[0])

    def _bind(self, lines: Lines) -> None:
        for kind in self.kinds if not self._of_both else ():
            self._of_both[kind.kind] = tuple(name for name in kind.supported if _acts_on(name, lines))
            kind.tell_all(self._of_both[kind.kind])

    def told(self, kind: OtherKind, names: Sequence[str]) -> OfCurves:
        """What curves of a kind say under a set of mechanisms."""
        return kind.told(names, self._of_both[kind.kind])

    def told_alone(self, kind: OtherKind) -> OfCurves:
        """What curves of a kind say under the set that they alone find the most probable."""
        return self.told(kind, tuple(self._most_probable(kind)[0]))

    def asked_for(self, lines: Lines, alone: Sequence[frozenset[str]]) -> list[frozenset[str]]:
        """Sets by which recordings of both kinds may be explained: what the curves find the most probable and nothing,
        each by itself or with an error of the modulus, and with the sets that explain the other recordings `alone`."""
        self._bind(lines)
        nothing: frozenset[str] = frozenset()
        errors = frozenset(name for name in (MODULUS_ERROR,) if _acts_on(name, lines))
        found = dict.fromkeys([*(names for kind in self.kinds for names in self._most_probable(kind)), nothing])
        each = [names | own | further for names in found for own in (nothing, *alone) for further in (nothing, errors)]
        return [names for names in dict.fromkeys(each) if len(names) <= LARGEST]

    def _most_probable(self, kind: OtherKind) -> list[frozenset[str]]:
        """The sets by the curves alone, as far as they count."""
        both = len(self._of_both[kind.kind])
        weights = {names: told.log_weight + log_prior(len(names), both) for names, told in kind.found.items()}
        ranked = sorted(weights, key=lambda names: -weights[names])
        return [names for names in ranked[:_ASKED_FOR] if weights[names] > weights[ranked[0]] - _BEHIND]

    def log_evidence_apart(self, kind: OtherKind, names: Sequence[str], supported: int) -> float:
        """Of the curves of a kind with a material of their own, where recordings of another kind have a set of
        mechanisms, of so many `supported`: those that the curves have besides cost what they would cost there."""
        own = frozenset(names)
        return float(
            np.logaddexp.reduce(
                [
                    told.log_weight + log_prior(len(own | both), supported) - log_prior(len(own), supported)
                    for both, told in kind.found.items()
                    if len(own | both) <= LARGEST
                ]
            )
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
        matrix, offset, priors = _in_model(told, model, lines, self._begun(model.names, lines))
        return _likelihood(told, matrix, offset, priors)

    def _begun(self, names: Sequence[str], lines: Lines) -> dict[Quantity, tuple[float, float]]:
        """Fit coordinates of mechanisms' parameters, and their variances, where the recordings alone have them: under
        this set, or else under the best one that holds the mechanism."""
        begun: dict[Quantity, tuple[float, float]] = {}
        for entry in sorted(self._alone, key=lambda entry: frozenset(entry.names) != frozenset(names)):
            variances = dict(zip(entry.best.hypothesis.mean_places, np.diag(entry.best.covariance), strict=True))
            for mechanism, places in own_places(entry.names, lines).items():
                for place in range(places.start, places.stop):
                    key = (mechanism, entry.model.parameters[place].name)
                    begun.setdefault(key, (float(entry.point.fit[place]), float(variances.get(place, np.inf))))
        return begun


def _acts_on(name: str, lines: Lines) -> bool:
    mechanism = lines.mechanisms.named.get(name)
    known = mechanism is not None and lines.kind in mechanism.kinds
    return known and mechanism is not None and mechanism.unsupported(lines.campaign, lines.kind) is None


def _in_model(
    told: OfCurves, model: Model, lines: Lines, begun: Mapping[Quantity, tuple[float, float]]
) -> tuple[Floats, Floats, list[Moments]]:
    """The quantities as matrix · x + offset of the model's fit coordinates, and what is known of each without any
    recording; a row of zeros where the model has no such quantity. `begun`: fit coordinates by the recordings alone,
    and their variances."""
    quantities = told.quantities
    places = own_places(model.names, lines)
    names = [entry.name for entry in model.parameters]
    matrix, offset = np.zeros((len(quantities), len(names))), np.zeros(len(quantities))
    priors: list[Moments] = []
    for row, (mechanism, key) in enumerate(quantities):
        if (mechanism, key) == MODULUS:
            declared = lines.campaign.skin.youngs_modulus_mpa
            matrix[row, names.index("youngs_modulus")] = 1.0
            if MODULUS_ERROR in places:
                matrix[row, places[MODULUS_ERROR].start] = 1.0
            offset[row] = np.log(to_si("youngs_modulus_mpa", 1.0 if declared is None else declared))
            priors.append((float(told.mean[row]), _MODULUS_SD**2, False, 0.0))
            continue
        if (mechanism, key) == THICKNESS:
            matrix[row, names.index("thickness")] = 1.0
            if THICKNESS_ERROR in places:
                matrix[row, places[THICKNESS_ERROR].start] = 1.0
            priors.append(_moments(UNKNOWN_THICKNESS, float(told.mean[row])))
            continue
        own = places.get(mechanism, slice(0, 0))
        found = [index for index in range(own.start, own.stop) if names[index] == key]
        if found:
            entry = model.parameters[found[0]]
            matrix[row, found[0]], offset[row] = _tangent(told, row, entry, begun.get((mechanism, key)))
            priors.append(_moments(entry, float(told.mean[row])))
        else:
            priors.append((0.0, 0.0, False, 0.0))
    return matrix, offset, priors


def _tangent(told: OfCurves, row: int, entry: Parameter, begun: tuple[float, float] | None) -> tuple[float, float]:
    """Slope and offset of a quantity over its fit coordinate.

    A fraction that is known as a ratio to a time alone, as of curves that are short beside it, is known along a line
    that is straight in its logarithm: m ln(x/m) + m in place of x. Its tangent is about where the recordings alone have
    it, if they tell it better than the curves do; else the fit will be about the curves' mean, where both are one.
    """
    mean, (at, variance) = float(told.mean[row]), begun or (0.0, np.inf)
    if entry.scale == "log" or not told.is_ratio(row) or min(mean, at) <= 0 or variance > told.covariance[row, row]:
        return 1.0, 0.0
    return mean / at, mean * float(np.log(at / mean))


def _moments(entry: Parameter, mean: float) -> Moments:
    low, high = entry.bounds
    inside = float(np.clip(mean, low, high))
    precision, centre = quadratic_of_prior(entry, inside)
    if not precision:
        return (low + high) / 2, (high - low) ** 2 / (2 * np.pi), True, 0.0
    normal = 0.5 * float(np.log(precision / (2 * np.pi)) - precision * (inside - centre) ** 2)
    return centre, 1 / precision, False, entry.log_prior(inside) - normal


def _likelihood(told: OfCurves, matrix: Floats, offset: Floats, priors: Sequence[Moments]) -> Knowledge:
    """ln L(x), so that ∫ L(q) p(q) dq over the quantities' prior is the curves' evidence; normal."""
    centre, variance, flat, higher = (np.array(column) for column in zip(*priors, strict=True))
    flat = flat.astype(bool)
    widest = np.where(flat, variance * (2 * np.pi / 12), variance)  # between bounds: a uniform distribution's
    known = matrix.any(axis=1) & (np.diag(told.covariance) < _INFORMED**2 * widest)
    if not known.any():
        return Knowledge(np.zeros((matrix.shape[1],) * 2), np.zeros(matrix.shape[1]), told.log_weight)
    after = _inverse(told.covariance[np.ix_(known, known)])
    centre, variance, flat = centre[known], variance[known], flat[known]
    before = np.diag(np.where(flat, 0.0, 1 / variance))
    precision = _definite(after - before)
    mean = np.linalg.solve(precision, after @ told.mean[known] - before @ centre)
    # The evidence is the integral of the likelihood over the prior, a flat one as a normal one of the same height
    prior = np.diag(variance)
    away = mean - centre
    volume = np.linalg.slogdet(np.eye(len(mean)) + precision @ prior)[1]
    height = told.log_weight + 0.5 * volume - float(higher[known].sum())
    height += 0.5 * away @ np.linalg.solve(np.linalg.inv(precision) + prior, np.where(flat, 0.0, away))
    matrix, offset = matrix[known], offset[known]
    batch = np.diag([told.tolerance**2 if told.quantities[row] == MODULUS else 0.0 for row in np.flatnonzero(known)])
    loose = np.eye(len(mean)) + precision @ batch
    height -= 0.5 * np.linalg.slogdet(loose)[1]
    tolerant: Floats = np.linalg.solve(loose, precision).astype(np.float64)
    return Knowledge.of(matrix, offset, mean, tolerant, float(height))


def _inverse(covariance: Floats) -> Floats:
    """Of a covariance, whose correlations may be nearly singular: quantities that are known as a ratio alone."""
    deviation = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(deviation, deviation))
    return np.asarray((vectors / np.maximum(values, _LEAST_CORRELATION)) @ vectors.T / np.outer(deviation, deviation))


def _definite(precision: Floats) -> Floats:
    values, vectors = np.linalg.eigh(precision)
    return np.asarray((vectors * np.maximum(values, 1e-9)) @ vectors.T)
