"""What the other kinds of recordings of a campaign say of one kind's parameters.

A layer whose thickness indentations tell for themselves, beside recordings that may tell of another than declared.

The thickness may be declared wrongly, which FRFs tell (`thickness_error`). What indentations that feel the base tell of
it must then be known, and may not stand in their modulus.

What curves of one kind, beside recordings of another, tell of the elastomer that is common to both.

The curves are searched with the modulus free, as if they were alone; each subset of the mechanisms that act on both
kinds then leaves something to be known. Mechanisms of the curves alone (a stage that gives) are summed over; so are
those that an apparent modulus may hide whatever the curves look like (friction at the platens).

What curves of a block, or of the skin, tell of the skin's FRFs: one material, so one modulus, one adhesion, one law.

By Bayes' rule the evidence of a set of mechanisms on all recordings is that of the curves, times that of the FRFs under
what the curves leave of the parameters that both have. Laplace's approximation of the curves' posterior,
divided by the prior, is the likelihood (hypothesis.py) that the FRFs are fitted under.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from underskin.autodiff import Differentiated
from underskin.diagnosis.data.dataset import Lines, curve_lines
from underskin.diagnosis.inference.evidence import parts
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.gaussian import Gaussian, moments
from underskin.diagnosis.inference.hypothesis import parameter_slices, quadratic_of_prior
from underskin.diagnosis.selection.priors import LARGEST, least_evidence, log_prior
from underskin.mechanisms.base import Kind, Unsupported, Values
from underskin.mechanisms.laws.layered_contact import LayeredContact
from underskin.mechanisms.laws.thickness_error import ThicknessError
from underskin.mechanisms.models.composed import Model
from underskin.mechanisms.models.curve_state import Curve
from underskin.mechanisms.parameter import Parameter
from underskin.mechanisms.registry import ActiveCatalogue
from underskin.recordings.campaign import Campaign, Conditions
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, to_si

(UNKNOWN_THICKNESS,) = ThicknessError.parameters_stated
THICKNESS_ERROR = ThicknessError.name
THICKNESS = (LayeredContact.name, UNKNOWN_THICKNESS.name)


class LayerOfUnknownThickness(LayeredContact):
    """`layered_contact` of indentations with the thickness over the declared one as a parameter."""

    parameters_stated = (UNKNOWN_THICKNESS,)

    def parameters(self, conditions: Conditions, kind: Kind = "frf") -> tuple[Parameter, ...]:  # noqa: ARG002
        """The thickness over the declared one."""
        return self.parameters_stated

    def follows_from_declared(self, conditions: Conditions, kind: Kind) -> bool:  # noqa: ARG002
        """Its thickness is free."""
        return False

    def on_curve(self, curve: Curve, values: Values) -> None:
        """Press the layer of that thickness."""
        super().on_curve(curve, values)
        if curve.thickness is not None:
            curve.thickness = curve.thickness * values[UNKNOWN_THICKNESS.name]


_BATCH = 0.02  # by how much the modulus of one elastomer differs from piece to piece (sd of its logarithm)
_EXTRAPOLATED = 0.15  # of what a law takes off a modulus at no strain: laws of one fit differ by that
_RATIO = 0.9  # correlation of quantities that are known as a ratio alone
_HIDES = 0.5  # prior of what does not show: platens are oiled as often as they are not
MODULUS_ERROR, MODULUS = "modulus_error", ("", "youngs_modulus")

Quantity = tuple[str, str]  # a mechanism, or none, and what is known of it


@dataclass(frozen=True, eq=False)
class OfCurves:
    """What one subset of the mechanisms that act on both kinds leaves to be known.

    `each` set of mechanisms that holds it and none else but the curves' own, with its log prior times evidence, that
    without these first; `mean` (quantities,) and `covariance` of the `quantities` over all of them; `tolerance` is the
    standard deviation by which the logarithm of the modulus may differ from the skin's; `hidden` are by how much the
    logarithm of the apparent modulus may be too large by mechanisms that do not show, with their probabilities.
    """

    each: tuple[tuple[Explanation, float], ...]
    quantities: tuple[Quantity, ...]
    mean: Floats
    covariance: Floats
    tolerance: float = _BATCH
    hidden: tuple[tuple[float, float], ...] = ((0.0, 1.0),)

    @property
    def best(self) -> Explanation:
        """The most probable set's fit."""
        return max(self.each, key=lambda entry: entry[1])[0]

    @property
    def modulus_deviation(self) -> float:
        """Standard deviation of the logarithm of the skin's modulus."""
        return float(np.hypot(np.sqrt(self.covariance[0, 0]), self.tolerance))

    def is_ratio(self, row: int) -> bool:
        """Whether a quantity is known as a ratio to another one of its mechanism alone."""
        mechanism = self.quantities[row][0]
        deviation = np.sqrt(np.diag(self.covariance))
        alike = np.abs(self.covariance[row]) > _RATIO * deviation[row] * deviation
        return any(alike[other] and one[0] == mechanism for other, one in enumerate(self.quantities) if other != row)

    @property
    def log_weight(self) -> float:
        """The logarithm of the sum over the curves' own mechanisms."""
        return float(np.logaddexp.reduce([weight for _, weight in self.each]))


class OtherKind:
    """The curves of one kind in a campaign that is diagnosed by recordings of another."""

    def __init__(self, kind: Kind, problem: FittingProblem, explanations: Sequence[Explanation]) -> None:
        """Curves with the modulus free (`of_curves`), and the sets of mechanisms that were found to explain them."""
        self.kind, self.problem = kind, problem
        self._explanations = {frozenset(entry.names): entry for entry in explanations}
        mechanisms, conditions = problem.lines.mechanisms, problem.lines.campaign
        self.supported = tuple(name for name in mechanisms.named if self._supports(name))
        self._may_hide = may_hide(mechanisms, conditions, self.supported)
        self.found: dict[frozenset[str], OfCurves] = {}

    def _supports(self, name: str) -> bool:
        try:
            self.problem.hypothesis((name,), has_position_scatter=False)
        except Unsupported:
            return False
        return True

    def told(self, names: Collection[str], of_both: Sequence[str]) -> OfCurves:
        """Under a set of mechanisms of those that act on both kinds; the curves' own ones may be there beside."""
        key = frozenset(name for name in names if name in self.supported and name in of_both)
        if key not in self.found:
            self.found[key] = self._tolerant(self._fitted(key, of_both), key, of_both)
        return self.found[key]

    def tell_all(self, of_both: Sequence[str]) -> None:
        """Under every set that was found, so that `found` holds them."""
        for names in tuple(self._explanations):
            self.told(names, of_both)

    def _tolerant(self, told: OfCurves, names: frozenset[str], of_both: Sequence[str]) -> OfCurves:
        """Where a law extrapolates the modulus to no strain: as unsure as a good part of what it takes off."""
        plain = [name for name in names if not self.problem.lines.mechanisms[name].extrapolates_modulus]
        if len(plain) == len(names):
            return told
        taken_off = float(told.mean[0] - self.told(plain, of_both).mean[0])  # what hides is in both
        return replace(told, tolerance=float(np.hypot(_BATCH, _EXTRAPOLATED * taken_off)))

    def _fitted(self, both: frozenset[str], of_both: Sequence[str]) -> OfCurves:
        alone = {name for name in self.supported if name not in of_both and name not in self._may_hide}
        without = self._explained(both)
        shown = without.log_evidence + least_evidence(without)
        beside = [
            entry
            for names, entry in self._explanations.items()
            if names > both and names - both <= alone and entry.log_evidence > shown
        ]
        each = tuple(
            (entry, entry.log_evidence + log_prior(len(entry.names) - len(both), len(alone)))
            for entry in (without, *beside)
        )
        quantities, mean, covariance = _mixture(each, both)
        hidden = hidden_factors(self._may_hide, both)
        values, shares = np.array(hidden).T
        mean[0] -= shares @ values
        covariance[0, 0] += shares @ values**2 - (shares @ values) ** 2
        return OfCurves(each, quantities, mean, covariance, hidden=hidden)

    def _explained(self, names: frozenset[str]) -> Explanation:
        if names not in self._explanations:
            ordered = tuple(name for name in self.supported if name in names)
            smaller = [self._explanations.get(names - {name}) for name in ordered]
            parent = max((one for one in smaller if one), key=lambda one: one.log_evidence, default=None)
            begin = self._explanations[frozenset()].point
            requests = [Request(ordered, begin=begin, kept=True), Request(ordered, parent, kept=True)]
            found = self.problem.explain(requests if parent else requests[:1])
            explanation = max((one for one in found if one), key=lambda one: one.log_evidence)
            self._explanations[names] = explanation
        return self._explanations[names]


def may_hide(
    mechanisms: ActiveCatalogue, conditions: Conditions, names: Iterable[str]
) -> Mapping[str, Sequence[float]]:
    """Mechanisms that an apparent modulus may hide, with the logarithms of by how much it may be too large."""
    hidden = {name: mechanisms[name].hidden_in_modulus(conditions) for name in names}
    return {name: values for name, values in hidden.items() if values}


def hidden_factors(hiding: Mapping[str, Sequence[float]], shown: Collection[str]) -> tuple[tuple[float, float], ...]:
    """By how much the logarithm of an apparent modulus may be too large by mechanisms of `hiding` that are not among
    those `shown`, with probabilities."""
    hidden = [(0.0, 1.0)]
    for values in (values for name, values in hiding.items() if name not in shown):
        each = [(0.0, 1 - _HIDES), *((value, _HIDES / len(values)) for value in values)]
        hidden = [(one + more, weight * other) for one, weight in hidden for more, other in each]
    return tuple(hidden)


def of_curves(campaign: Campaign, kind: Kind, table: SigmaTable, without: Sequence[str]) -> FittingProblem:
    """The curves of one kind of a campaign, its modulus free and, of a layer, its thickness; mechanisms `without` which
    all is to be explained."""
    mechanisms = ActiveCatalogue({MODULUS_ERROR, *without})
    free = replace(campaign, skin=replace(campaign.skin, youngs_modulus_mpa=None))
    mechanisms.bind(free, table, kind)
    mechanisms.replace(LayerOfUnknownThickness())
    return FittingProblem(replace(curve_lines(free, kind), mechanisms=mechanisms), table)


def _mixture(
    each: Sequence[tuple[Explanation, float]], both: frozenset[str]
) -> tuple[tuple[Quantity, ...], Floats, Floats]:
    """Mean and covariance of what both kinds know, over sets with their log weights."""
    weights = np.array([weight for _, weight in each])
    shares = np.exp(weights - np.logaddexp.reduce(weights))
    posteriors = [_posterior(entry, both) for entry, _ in each]
    return posteriors[0][0], *moments(shares, [mean for _, mean, _ in posteriors], [one for _, _, one in posteriors])


def _posterior(explanation: Explanation, both: frozenset[str]) -> tuple[tuple[Quantity, ...], Floats, Floats]:
    """Mean and covariance of what both kinds know: the modulus' logarithm, the parameters of mechanisms."""
    modulus = [entry.name for entry in explanation.model.parameters].index("youngs_modulus")
    each = parts(explanation.best, modulus)
    known = [_quantities(explanation, part.fit, both, modulus) for part in each]
    mean_indices = explanation.best.hypothesis.mean_indices
    slopes = [rows[:, mean_indices] for _, _, rows in known]
    covariances = [one @ part.covariance @ one.T for one, part in zip(slopes, each, strict=True)]
    return known[0][0], *moments(np.array([part.share for part in each]), [mean for _, mean, _ in known], covariances)


def _quantities(
    explanation: Explanation, fit: Floats, both: frozenset[str], modulus: int
) -> tuple[tuple[Quantity, ...], Floats, Floats]:
    """What both kinds know, its values at a point and their slopes over the fit coordinates (quantities, parameters);
    the place of the modulus is given."""
    parameters, lines = explanation.model.parameters, explanation.best.hypothesis.lines
    quantities: list[Quantity] = [MODULUS]
    values = [fit[modulus] + np.log(to_si("youngs_modulus_mpa", 1.0))]
    rows = [np.eye(len(fit))[modulus]]
    for name, place in parameter_slices(explanation.names, lines).items():
        if name not in both:
            continue
        seeds = {
            entry.name: Differentiated(np.array([entry.from_fit(fit[index])]), _unit(entry, fit, index, len(fit)))
            for index, entry in zip(range(place.start, place.stop), parameters[place], strict=True)
        }
        for key, quantity in lines.mechanisms[name].shared_parameters(lines.kind, seeds).items():
            quantities.append((name, key))
            values.append(float(quantity.value[0]))
            rows.append(quantity.slopes[:, 0])
    return tuple(quantities), np.array(values), np.array(rows)


def _unit(entry: Parameter, fit: Floats, index: int, count: int) -> Floats:
    slopes = np.zeros((count, 1))
    slopes[index] = entry.from_fit(fit[index]) if entry.scale == "log" else 1.0
    return slopes


_INFORMED = 0.8  # of a prior's deviation, above which a posterior's says nothing
_ASKED_FOR, _BEHIND = 3, 12.0  # sets of a kind of curves, and how far behind the best one in nats
_MODULUS_SD = 1.5  # of the logarithm of a modulus that nobody declared
_LEAST_CORRELATION = 1e-11  # eigenvalue of correlations: less is rounding

# Of a prior as a normal one: mean, variance, whether it is flat (then the variance is that of one as high), and by how
# much the logarithm of its density at the curves' mean exceeds that normal one's
Moments = tuple[float, float, bool, float]


class CurveLikelihood:
    """What the curves of all other kinds tell of models of one kind."""

    def __init__(self, kinds: Sequence[OtherKind], alone: Sequence[Explanation]) -> None:
        """Of at least one kind; `alone` are the sets that were fitted to the recordings without these."""
        self.kinds = tuple(kinds)
        self._alone = sorted(alone, key=lambda entry: -entry.log_evidence)
        self._of_both: dict[Kind, tuple[str, ...]] = {}

    def __call__(self, model: Model, lines: Lines) -> Gaussian:
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

    def required_sets(self, lines: Lines, alone: Sequence[frozenset[str]]) -> list[frozenset[str]]:
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

    def _of_kind(self, kind: OtherKind, model: Model, lines: Lines) -> Gaussian:
        told = self.told(kind, model.names)
        matrix, offset, priors = _in_model(told, model, lines, self._begun(model.names, lines))
        return _likelihood(told, matrix, offset, priors)

    def _begun(self, names: Sequence[str], lines: Lines) -> dict[Quantity, tuple[float, float]]:
        """Fit coordinates of mechanisms' parameters, and their variances, where the recordings alone have them: under
        this set, or else under the best one that holds the mechanism."""
        begun: dict[Quantity, tuple[float, float]] = {}
        for entry in sorted(self._alone, key=lambda entry: frozenset(entry.names) != frozenset(names)):
            variances = dict(zip(entry.best.hypothesis.mean_indices, np.diag(entry.best.covariance), strict=True))
            for mechanism, places in parameter_slices(entry.names, lines).items():
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
    places = parameter_slices(model.names, lines)
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


def _likelihood(told: OfCurves, matrix: Floats, offset: Floats, priors: Sequence[Moments]) -> Gaussian:
    """ln L(x), so that ∫ L(q) p(q) dq over the quantities' prior is the curves' evidence; normal."""
    centre, variance, flat, higher = (np.array(column) for column in zip(*priors, strict=True))
    flat = flat.astype(bool)
    widest = np.where(flat, variance * (2 * np.pi / 12), variance)  # between bounds: a uniform distribution's
    known = matrix.any(axis=1) & (np.diag(told.covariance) < _INFORMED**2 * widest)
    if not known.any():
        return Gaussian(np.zeros((matrix.shape[1],) * 2), np.zeros(matrix.shape[1]), told.log_weight)
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
    tolerance = np.array([told.tolerance**2 * (told.quantities[row] == MODULUS) for row in np.flatnonzero(known)])
    return Gaussian.of(mean, precision, float(height)).of_mean(tolerance).over(matrix[known], offset[known])


def _inverse(covariance: Floats) -> Floats:
    """Of a covariance, whose correlations may be nearly singular: quantities that are known as a ratio alone."""
    deviation = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(deviation, deviation))
    return np.asarray((vectors / np.maximum(values, _LEAST_CORRELATION)) @ vectors.T / np.outer(deviation, deviation))


def _definite(precision: Floats) -> Floats:
    values, vectors = np.linalg.eigh(precision)
    return np.asarray((vectors * np.maximum(values, 1e-9)) @ vectors.T)
