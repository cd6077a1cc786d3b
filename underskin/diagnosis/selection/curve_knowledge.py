"""What curves of one kind, beside recordings of another, tell of the elastomer that is common to both.

The curves are searched with the modulus free, as if they were alone; each subset of the mechanisms that act on both
kinds then leaves something to be known. Mechanisms of the curves alone (a stage that gives) are summed over; so are
those that an apparent modulus may hide whatever the curves look like (friction at the platens).
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from underskin.autodiff import Differentiated
from underskin.diagnosis.data.curve_samples import curve_lines
from underskin.diagnosis.inference.across_bounds import parts
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.hypothesis import own_places
from underskin.diagnosis.selection.priors import least_evidence, log_prior
from underskin.diagnosis.selection.unknown_thickness import LayerOfUnknownThickness
from underskin.mechanisms.base import Kind, Unsupported
from underskin.mechanisms.parameter import Parameter
from underskin.mechanisms.registry import Known
from underskin.recordings.campaign import Campaign
from underskin.recordings.conditions import Conditions
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, to_si

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
            self.problem.hypothesis((name,), placed=False)
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


def may_hide(mechanisms: Known, conditions: Conditions, names: Iterable[str]) -> Mapping[str, Sequence[float]]:
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
    mechanisms = Known({MODULUS_ERROR, *without})
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
    return posteriors[0][0], *_mixed(shares, [mean for _, mean, _ in posteriors], [one for _, _, one in posteriors])


def _mixed(shares: Floats, means: Sequence[Floats], covariances: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Mean and covariance of a mixture of distributions with these."""
    mean = np.asarray(shares @ np.array(means))
    away = np.array(means) - mean
    return mean, np.tensordot(shares, np.array(covariances), 1) + (shares[:, None] * away).T @ away


def _posterior(explanation: Explanation, both: frozenset[str]) -> tuple[tuple[Quantity, ...], Floats, Floats]:
    """Mean and covariance of what both kinds know: the modulus' logarithm, the parameters of mechanisms."""
    modulus = [entry.name for entry in explanation.model.parameters].index("youngs_modulus")
    each = parts(explanation.best, modulus)
    known = [_quantities(explanation, part.fit, both, modulus) for part in each]
    mean_places = explanation.best.hypothesis.mean_places
    slopes = [rows[:, mean_places] for _, _, rows in known]
    covariances = [one @ part.covariance @ one.T for one, part in zip(slopes, each, strict=True)]
    return known[0][0], *_mixed(np.array([part.share for part in each]), [mean for _, mean, _ in known], covariances)


def _quantities(
    explanation: Explanation, fit: Floats, both: frozenset[str], modulus: int
) -> tuple[tuple[Quantity, ...], Floats, Floats]:
    """What both kinds know, its values at a point and their slopes over the fit coordinates (quantities, parameters);
    the place of the modulus is given."""
    parameters, lines = explanation.model.parameters, explanation.best.hypothesis.lines
    quantities: list[Quantity] = [MODULUS]
    values = [fit[modulus] + np.log(to_si("youngs_modulus_mpa", 1.0))]
    rows = [np.eye(len(fit))[modulus]]
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
    return tuple(quantities), np.array(values), np.array(rows)


def _unit(entry: Parameter, fit: Floats, index: int, count: int) -> Floats:
    slopes = np.zeros((count, 1))
    slopes[index] = entry.from_fit(fit[index]) if entry.scale == "log" else 1.0
    return slopes
