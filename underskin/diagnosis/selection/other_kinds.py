"""Posteriors of the parameters that recordings of several kinds share, as likelihoods for the kind that is diagnosed.

Curves of a block or of the skin and FRFs are of one material: one modulus, one adhesion, one law. By Bayes' rule the
evidence of a set of mechanisms on all recordings is that of the curves times that of the FRFs under what the curves
leave of the shared parameters. Laplace's approximation of the curves' posterior, divided by the prior, is the
likelihood under which the FRFs are fitted (hypothesis.py).

The curves are searched with the modulus free. Each subset of the mechanisms that act on both kinds has a posterior;
mechanisms of the curves alone (compliance of a stage) are summed over, and so are those that an apparent modulus may
hide whatever the curves look like (friction at the platens). The thickness of indented layers is free too: it may be
declared wrongly, which FRFs tell (`thickness_error`), and must not be absorbed by the modulus.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from underskin.autodiff import Differentiated
from underskin.diagnosis.data.dataset import Lines, curve_lines
from underskin.diagnosis.inference.evidence import NEGLIGIBLE_NATS
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.gaussian import Gaussian, moments
from underskin.diagnosis.inference.hypothesis import parameter_slices, quadratic_of_prior
from underskin.diagnosis.selection.priors import LARGEST, least_evidence, log_prior
from underskin.mechanisms.base import Kind, Mechanism, Parameter, Values
from underskin.mechanisms.laws import platen_friction, strain_stiffening
from underskin.mechanisms.laws.layered_contact import LayeredContact
from underskin.mechanisms.laws.thickness_error import ThicknessError
from underskin.mechanisms.models.composed import Model
from underskin.mechanisms.models.composition import WIDE_SD, fit_coordinates
from underskin.mechanisms.models.contact_state import Contacts
from underskin.mechanisms.models.curve_state import Curve
from underskin.mechanisms.registry import ActiveCatalogue
from underskin.recordings.campaign import Campaign, Conditions
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, to_si

(UNKNOWN_THICKNESS,) = ThicknessError.parameters_stated
THICKNESS_ERROR = ThicknessError.name
PLATEN_FRICTION, STRAIN_STIFFENING = platen_friction.PlatenFriction.name, strain_stiffening.StrainStiffening.name
THICKNESS = (LayeredContact.name, UNKNOWN_THICKNESS.name)


class LayerOfUnknownThickness(LayeredContact):
    """`layered_contact` of indentations with the thickness over the declared one as a parameter."""

    parameters_stated = (UNKNOWN_THICKNESS,)
    parameters = Mechanism.parameters  # those stated

    def act(self, state: Contacts | Curve, values: Values) -> None:
        """Contact with a layer of that thickness."""
        super().act(state, values)
        if state.thickness is not None:
            state.thickness = state.thickness * values[UNKNOWN_THICKNESS.name]


_BETWEEN_SPECIMENS = 0.02  # sd of the logarithm of the modulus from piece to piece of one elastomer
_EXTRAPOLATION = 0.15  # of the reduction of a modulus extrapolated to no strain: differs so between laws of one fit
_HIDDEN_PRIOR = 0.5  # prior of a mechanism that cannot show: platens are oiled as often as they are not
MODULUS_ERROR, MODULUS = "modulus_error", ("", "youngs_modulus")

Quantity = tuple[str, str]  # a mechanism, or "", and the name of its parameter


@dataclass(frozen=True, eq=False)
class CurvePosterior:
    """The posterior of the shared quantities under one subset of the mechanisms that act on both kinds.

    `fits`: the sets of mechanisms that add to the subset only mechanisms of the curves alone, each with its log of
    prior times evidence, the subset itself first; `mean` (quantities,) and `covariance` of the `quantities` over all of
    them; `tolerance`: standard deviation of the logarithm of the modulus against the skin's; `hidden`: by how much the
    logarithm of the apparent modulus may be too large through mechanisms that do not show, with probabilities.
    """

    fits: tuple[tuple[Explanation, float], ...]
    quantities: tuple[Quantity, ...]
    mean: Floats
    covariance: Floats
    tolerance: float = _BETWEEN_SPECIMENS
    hidden: tuple[tuple[float, float], ...] = ((0.0, 1.0),)

    @property
    def best(self) -> Explanation:
        """The fit of the most probable set."""
        return max(self.fits, key=lambda fit: fit[1])[0]

    @property
    def modulus_deviation(self) -> float:
        """Standard deviation of the logarithm of the skin's modulus."""
        return float(np.hypot(np.sqrt(self.covariance[0, 0]), self.tolerance))

    def is_ratio(self, index: int) -> bool:
        """Whether only the ratio of a quantity to another one of its mechanism is known."""
        deviation = np.sqrt(np.diag(self.covariance))
        correlated = np.abs(self.covariance[index]) > _RATIO * deviation[index] * deviation
        mechanisms = [mechanism for mechanism, _ in self.quantities]
        return any(
            correlated[other]
            for other in range(len(deviation))
            if mechanisms[other] == mechanisms[index] and other != index
        )

    @property
    def log_weight(self) -> float:
        """Log of prior times evidence, summed over the mechanisms of the curves alone."""
        return float(np.logaddexp.reduce([weight for _, weight in self.fits]))


class OtherKind:
    """The curves of one kind in a campaign that is diagnosed by recordings of another."""

    def __init__(
        self, kind: Kind, problem: FittingProblem, explanations: Sequence[Explanation], unsupported: Collection[str]
    ) -> None:
        """Curves with the modulus free (`free_modulus_problem`), the explanations that a search found for them, and the
        mechanisms that they do not support."""
        self.kind, self.problem = kind, problem
        self._explanations = {frozenset(explanation.names): explanation for explanation in explanations}
        self.supported = tuple(name for name in problem.lines.mechanisms.named if name not in unsupported)
        self._may_hide = may_hide(problem.lines.campaign, self.supported)
        self.posteriors: dict[frozenset[str], CurvePosterior] = {}

    def posterior(self, names: Collection[str], shared: Sequence[str]) -> CurvePosterior:
        """Under a set of the mechanisms `shared` by both kinds, summed over those of the curves alone."""
        key = frozenset(name for name in names if name in self.supported and name in shared)
        if key not in self.posteriors:
            self.posteriors[key] = self._with_extrapolation_tolerance(self._posterior_of(key, shared), key, shared)
        return self.posteriors[key]

    def fit_all(self, shared: Sequence[str]) -> None:
        """Fill `posteriors` for every set that was searched."""
        for names in tuple(self._explanations):
            self.posterior(names, shared)

    def _with_extrapolation_tolerance(
        self, posterior: CurvePosterior, names: frozenset[str], shared: Sequence[str]
    ) -> CurvePosterior:
        """Widened where a law extrapolates the modulus to no strain, by a part of how much the law reduces it."""
        plain = [name for name in names if name != STRAIN_STIFFENING]
        if len(plain) == len(names):
            return posterior
        reduction = float(posterior.mean[0] - self.posterior(plain, shared).mean[0])  # hidden mechanisms cancel
        return replace(posterior, tolerance=float(np.hypot(_BETWEEN_SPECIMENS, _EXTRAPOLATION * reduction)))

    def _posterior_of(self, names: frozenset[str], shared: Sequence[str]) -> CurvePosterior:
        curve_only = {name for name in self.supported if name not in shared and name not in self._may_hide}
        smallest = self._explanation(names)
        least = smallest.log_evidence + least_evidence(smallest)
        larger_fits = [
            explanation
            for larger, explanation in self._explanations.items()
            if larger > names and larger - names <= curve_only and explanation.log_evidence > least
        ]
        fits = tuple(
            (explanation, explanation.log_evidence + log_prior(len(explanation.names) - len(names), len(curve_only)))
            for explanation in (smallest, *larger_fits)
        )
        quantities, mean, covariance = _mixture(fits, names)
        hidden = hidden_factors(self._may_hide, names)
        values, shares = np.array(hidden).T
        mean[0] -= shares @ values
        covariance[0, 0] += shares @ values**2 - (shares @ values) ** 2
        return CurvePosterior(fits, quantities, mean, covariance, hidden=hidden)

    def _explanation(self, names: frozenset[str]) -> Explanation:
        if names not in self._explanations:
            ordered = tuple(name for name in self.supported if name in names)
            smaller = [self._explanations.get(names - {name}) for name in ordered]
            parent = max(
                (explanation for explanation in smaller if explanation),
                key=lambda explanation: explanation.log_evidence,
                default=None,
            )
            start = self._explanations[frozenset()].point
            requests = [
                Request(ordered, nuisances=start, never_pruned=True),
                Request(ordered, parent, never_pruned=True),
            ]
            fits = self.problem.explain_all(requests if parent else requests[:1])
            best = max(
                (explanation for explanation in fits if explanation), key=lambda explanation: explanation.log_evidence
            )
            self._explanations[names] = best
        return self._explanations[names]


def may_hide(conditions: Conditions, names: Collection[str]) -> Mapping[str, Sequence[float]]:
    """Mechanisms that an apparent modulus may hide, with logarithms of the factor by which it may be too large."""
    hidden = platen_friction.hidden_in_modulus(conditions) if PLATEN_FRICTION in names else ()
    return {PLATEN_FRICTION: hidden} if hidden else {}


def hidden_factors(hiding: Mapping[str, Sequence[float]], shown: Collection[str]) -> tuple[tuple[float, float], ...]:
    """Logarithms of the factor by which an apparent modulus may be too large, with probabilities.

    Over the mechanisms of `hiding` that are not among those `shown`.
    """
    hidden = [(0.0, 1.0)]
    for values in (values for name, values in hiding.items() if name not in shown):
        options = [(0.0, 1 - _HIDDEN_PRIOR), *((value, _HIDDEN_PRIOR / len(values)) for value in values)]
        hidden = [
            (log_factor + option, weight * option_weight)
            for log_factor, weight in hidden
            for option, option_weight in options
        ]
    return tuple(hidden)


def free_modulus_problem(campaign: Campaign, kind: Kind, table: SigmaTable, without: Sequence[str]) -> FittingProblem:
    """The curves of one kind with the modulus free, and of a layer the thickness; `without` some mechanisms."""
    mechanisms = ActiveCatalogue({MODULUS_ERROR, *without})
    free = replace(campaign, skin=replace(campaign.skin, youngs_modulus_mpa=None))
    mechanisms.bind(free, table, kind)
    mechanisms.replace(LayerOfUnknownThickness())
    return FittingProblem(replace(curve_lines(free, kind), mechanisms=mechanisms), table)


def _mixture(
    fits: Sequence[tuple[Explanation, float]], shared: frozenset[str]
) -> tuple[tuple[Quantity, ...], Floats, Floats]:
    """Shared quantities, their mean and covariance over sets with their log weights."""
    weights = np.array([weight for _, weight in fits])
    shares = np.exp(weights - np.logaddexp.reduce(weights))
    posteriors = [_posterior(explanation, shared) for explanation, _ in fits]
    return posteriors[0][0], *moments(
        shares, [mean for _, mean, _ in posteriors], [covariance for _, _, covariance in posteriors]
    )


def _posterior(explanation: Explanation, shared: frozenset[str]) -> tuple[tuple[Quantity, ...], Floats, Floats]:
    """Shared quantities (logarithm of the modulus, parameters of mechanisms), their mean and covariance.

    A uniform prior counts as a normal one of its variance about the fit, as in `_moments`: indentations determine
    E/(1 − ν²), so that E and ν trade along a ridge, which ν between its bounds cuts short.
    """
    best = explanation.best
    indices, (precision, *_) = best.hypothesis.mean_indices, best.hypothesis.priors
    widths = np.ptp(best.hypothesis.bounds, axis=0)
    bounded = np.where(precision == 0, 12 / np.maximum(widths, 1e-12) ** 2, 0.0)[indices]
    covariance = np.linalg.inv(np.linalg.inv(best.covariance) + np.diag(bounded))
    quantities, mean, rows = _quantities(explanation, best.point.fit, shared)
    slopes = rows[:, indices]
    return quantities, mean, slopes @ covariance @ slopes.T


def _quantities(
    explanation: Explanation, fit: Floats, shared: frozenset[str]
) -> tuple[tuple[Quantity, ...], Floats, Floats]:
    """Shared quantities, their values at a point and slopes over the fit coordinates (quantities, parameters)."""
    parameters, lines = explanation.model.parameters, explanation.best.hypothesis.lines
    modulus = explanation.index("youngs_modulus")
    quantities: list[Quantity] = [MODULUS]
    values = [fit[modulus] + np.log(to_si("youngs_modulus_mpa", 1.0))]
    rows = [np.eye(len(fit))[modulus]]
    for name, span in explanation.spans.items():
        if name not in shared:
            continue
        seeds = {
            parameter.name: Differentiated(
                np.array([parameter.from_fit(fit[index])]), _unit_slope(parameter, fit, index, len(fit))
            )
            for index, parameter in zip(range(span.start, span.stop), parameters[span], strict=True)
        }
        shared_values = fit_coordinates(lines.mechanisms[name].parameters_stated, seeds)
        if name == STRAIN_STIFFENING:
            shared_values = strain_stiffening.shared_parameters(lines.kind, seeds)
        for key, quantity in shared_values.items():
            quantities.append((name, key))
            values.append(float(quantity.value[0]))
            rows.append(quantity.slopes[:, 0])
    return tuple(quantities), np.array(values), np.array(rows)


def _unit_slope(parameter: Parameter, fit: Floats, index: int, count: int) -> Floats:
    slopes = np.zeros((count, 1))
    slopes[index] = parameter.from_fit(fit[index]) if parameter.scale == "log" else 1.0
    return slopes


_MOST_SETS = 3  # of a kind of curves
_RATIO = 0.9  # correlation above which of two quantities only the ratio is known

# A prior as a normal one: mean, precision, and by how much its log density at the curves' mean exceeds the normal one's
Moments = tuple[float, float, float]


class CurveLikelihood:
    """The likelihood of the parameters of one kind's models, from the curves of all other kinds."""

    def __init__(self, kinds: Sequence[OtherKind], explanations: Sequence[Explanation]) -> None:
        """Of at least one kind; `explanations` are fits to the diagnosed recordings without these kinds."""
        self.kinds = tuple(kinds)
        self._explanations = explanations
        self._shared: dict[Kind, tuple[str, ...]] = {}

    def __call__(self, model: Model, lines: Lines) -> Gaussian:
        """In the fit coordinates of this model's parameters."""
        self._bind(lines)
        likelihoods = [self._kind_likelihood(kind, model, lines) for kind in self.kinds]
        return sum(likelihoods[1:], likelihoods[0])

    def _bind(self, lines: Lines) -> None:
        for kind in self.kinds if not self._shared else ():
            self._shared[kind.kind] = tuple(name for name in kind.supported if _acts_on(name, lines))
            kind.fit_all(self._shared[kind.kind])

    def posterior(self, kind: OtherKind, names: Sequence[str]) -> CurvePosterior:
        """Of the curves of a kind under a set of mechanisms."""
        return kind.posterior(names, self._shared[kind.kind])

    def posterior_alone(self, kind: OtherKind) -> CurvePosterior:
        """Of the curves of a kind under the set that is the most probable by these curves alone."""
        return self.posterior(kind, tuple(self._most_probable(kind)[0]))

    def required_sets(self, lines: Lines, first_kind_sets: Sequence[frozenset[str]]) -> list[frozenset[str]]:
        """Sets of mechanisms that are tried on all kinds together.

        The most probable sets of the curves and the empty set, each alone and with the sets that explain the first
        kind, without and with an error of the modulus.
        """
        self._bind(lines)
        empty: frozenset[str] = frozenset()
        errors = frozenset(name for name in (MODULUS_ERROR,) if _acts_on(name, lines))
        curve_sets = dict.fromkeys([*(names for kind in self.kinds for names in self._most_probable(kind)), empty])
        sets = [
            names | first_kind_set | error
            for names in curve_sets
            for first_kind_set in (empty, *first_kind_sets)
            for error in (empty, errors)
        ]
        return [names for names in dict.fromkeys(sets) if len(names) <= LARGEST]

    def _most_probable(self, kind: OtherKind) -> list[frozenset[str]]:
        """The most probable sets by the curves alone, at most `_MOST_SETS`."""
        supported = len(self._shared[kind.kind])
        weights = {
            names: posterior.log_weight + log_prior(len(names), supported)
            for names, posterior in kind.posteriors.items()
        }
        ranked = sorted(weights, key=lambda names: -weights[names])
        return [names for names in ranked[:_MOST_SETS] if weights[names] > weights[ranked[0]] - NEGLIGIBLE_NATS]

    def log_evidence_apart(self, kind: OtherKind, names: Sequence[str], supported: int) -> float:
        """Of the curves of a kind with a material of their own, where the first kind has a set of mechanisms.

        Of `supported` mechanisms; those that only the curves need have the same prior as in the first kind's sets.
        """
        first_kind_set = frozenset(names)
        return float(
            np.logaddexp.reduce(
                [
                    posterior.log_weight
                    + log_prior(len(first_kind_set | shared_set), supported)
                    - log_prior(len(first_kind_set), supported)
                    for shared_set, posterior in kind.posteriors.items()
                    if len(first_kind_set | shared_set) <= LARGEST
                ]
            )
        )

    def curve_only_sets(self, names: Sequence[str]) -> list[tuple[tuple[str, ...], float]]:
        """Sets of mechanisms of the curves that are not in an answer, with their probabilities."""
        products: list[tuple[tuple[str, ...], float]] = [((), 1.0)]
        for kind in self.kinds:
            posterior = self.posterior(kind, names)
            fits = [
                (tuple(name for name in fit.names if name not in names), float(np.exp(weight - posterior.log_weight)))
                for fit, weight in posterior.fits
            ]
            products = [
                ((*names_of_others, *curve_only), share * fit_share)
                for names_of_others, share in products
                for curve_only, fit_share in fits
            ]
        return products

    def _kind_likelihood(self, kind: OtherKind, model: Model, lines: Lines) -> Gaussian:
        posterior = self.posterior(kind, model.names)
        return _likelihood(posterior, *_in_model(posterior, model, lines, partial(self._alone, model.names)))

    def _alone(self, names: Sequence[str], mechanism: str, parameter: str) -> tuple[float, float]:
        """Fit coordinate of a mechanism's parameter, and its variance, by the first kind alone.

        Under this set of mechanisms, else under the best one that holds the mechanism; 0 and ∞ where none does.
        """
        fits = [fit for fit in self._explanations if mechanism in fit.names]
        if not fits:
            return 0.0, np.inf
        fit = max(fits, key=lambda fit: ({*fit.names} == {*names}, fit.log_evidence))
        span = fit.spans[mechanism]
        index = span.start + [stated.name for stated in fit.model.parameters[span]].index(parameter)
        return float(fit.point.fit[index]), float(fit.best.covariance_of([index])[0, 0])


def _acts_on(name: str, lines: Lines) -> bool:
    """Whether the recordings can share a mechanism with another kind's: one of a rig is of the rig of its kind."""
    mechanism = lines.mechanisms.named.get(name)
    if mechanism is None or lines.kind not in mechanism.kinds or mechanism.of == "rig":
        return False
    return mechanism.unsupported(lines.campaign, lines.kind) is None


def _in_model(
    posterior: CurvePosterior, model: Model, lines: Lines, alone: Callable[[str, str], tuple[float, float]]
) -> tuple[Floats, Floats, list[Moments]]:
    """The quantities as matrix · x + offset of the model's fit coordinates x, and the prior of each.

    A row of zeros where the model has no such quantity. `alone` gives the fit coordinate of a mechanism's parameter by
    the first kind alone, and its variance.
    """
    quantities = posterior.quantities
    spans = parameter_slices(model.names, lines)
    names = [parameter.name for parameter in model.parameters]
    matrix, offset = np.zeros((len(quantities), len(names))), np.zeros(len(quantities))
    priors: list[Moments] = []
    for row, (mechanism, key) in enumerate(quantities):
        if (mechanism, key) == MODULUS:
            declared = lines.campaign.skin.youngs_modulus_mpa
            matrix[row, names.index("youngs_modulus")] = 1.0
            if MODULUS_ERROR in spans:
                matrix[row, spans[MODULUS_ERROR].start] = 1.0
            offset[row] = np.log(to_si("youngs_modulus_mpa", 1.0 if declared is None else declared))
            priors.append((float(posterior.mean[row]), WIDE_SD**-2, 0.0))
            continue
        if (mechanism, key) == THICKNESS:
            matrix[row, names.index("thickness")] = 1.0
            if THICKNESS_ERROR in spans:
                matrix[row, spans[THICKNESS_ERROR].start] = 1.0
            priors.append(_moments(UNKNOWN_THICKNESS, float(posterior.mean[row])))
            continue
        span = spans.get(mechanism, slice(0, 0))
        indices = [index for index in range(span.start, span.stop) if names[index] == key]
        if indices:
            parameter = model.parameters[indices[0]]
            matrix[row, indices[0]], offset[row] = _tangent(posterior, row, parameter, *alone(mechanism, key))
            priors.append(_moments(parameter, float(posterior.mean[row])))
        else:
            priors.append((0.0, 0.0, 0.0))
    return matrix, offset, priors


def _tangent(
    posterior: CurvePosterior, row: int, parameter: Parameter, start: float, variance: float
) -> tuple[float, float]:
    """Slope and offset of a quantity over its fit coordinate.

    A fraction of which only the ratio to a time is known, as from curves that are short against that time, is known
    along a line that is straight in its logarithm: m ln(x/m) + m in place of x. The tangent is taken at the value of
    the first kind alone if that is more precise than the curves'; else the fit is near the curves' mean, where the
    tangent is the identity.
    """
    mean = float(posterior.mean[row])
    is_far = variance < posterior.covariance[row, row] and min(mean, start) > 0 and parameter.scale != "log"
    if not (is_far and posterior.is_ratio(row)):
        return 1.0, 0.0
    return mean / start, mean * float(np.log(start / mean))


def _moments(parameter: Parameter, mean: float) -> Moments:
    """About the curves' mean: of a uniform prior, those of a uniform distribution there."""
    low, high = parameter.bounds
    inside = float(np.clip(mean, low, high))
    precision, centre = quadratic_of_prior(parameter, inside)
    if not precision:
        precision, centre = 12 / (high - low) ** 2, inside
    normal = 0.5 * float(np.log(precision / (2 * np.pi)) - precision * (inside - centre) ** 2)
    return centre, precision, parameter.log_prior(inside) - normal


def _likelihood(posterior: CurvePosterior, matrix: Floats, offset: Floats, priors: Sequence[Moments]) -> Gaussian:
    """ln L(x), so that ∫ L(q) p(q) dq over the quantities' prior is the curves' evidence."""
    known = np.flatnonzero(matrix.any(axis=1)).tolist()
    centre, precision, log_height_ratio = np.array([priors[row] for row in known]).reshape(-1, 3).T
    covariance, evidence = posterior.covariance[np.ix_(known, known)], posterior.log_weight - log_height_ratio.sum()
    of_curves = Gaussian.from_posterior(evidence, posterior.mean[known], covariance, centre, precision)
    tolerance = np.array([posterior.tolerance**2 * (posterior.quantities[row] == MODULUS) for row in known])
    return of_curves.of_mean(tolerance).over(matrix[known], offset[known])
