"""What curves of one kind, beside recordings of another, tell of the elastomer that is common to both.

The curves are fitted with the modulus free, once for each subset of the mechanisms that act on both kinds. Mechanisms
of the curves alone (a stage that gives) are summed over; so are those that an apparent modulus may hide whatever the
curves look like (friction at the platens).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from underskin.autodiff import Differentiated
from underskin.diagnosis.data.curve_samples import curve_lines
from underskin.diagnosis.inference.explanation import Explanation, FittingProblem, Request
from underskin.diagnosis.inference.hypothesis import own_places
from underskin.diagnosis.selection.priors import least_evidence, log_prior
from underskin.mechanisms.base import Kind, Unsupported
from underskin.mechanisms.parameter import Parameter
from underskin.mechanisms.registry import Known
from underskin.recordings.campaign import Campaign
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import Floats, to_si

_BATCH = 0.02  # by how much the modulus of one elastomer differs from piece to piece (sd of its logarithm)
_EXTRAPOLATED = 0.7  # of what a law takes off a modulus at no strain: laws of one fit differ by that
MODULUS_ERROR, MODULUS = "modulus_error", ("", "youngs_modulus")

Quantity = tuple[str, str]  # a mechanism, or none, and what is known of it


@dataclass(frozen=True, eq=False)
class OfCurves:
    """What one subset of the mechanisms that act on both kinds leaves to be known.

    `each` set of mechanisms that holds it and none else but the curves' own, with its log prior times evidence; `mean`
    (quantities,) and `covariance` of the `quantities` under the most probable one; `tolerance` is the standard
    deviation by which the logarithm of the modulus may differ from the skin's; `hidden` are by how much the logarithm
    of the apparent modulus may be too large by mechanisms that do not show, with their probabilities.
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
    def log_weight(self) -> float:
        """The logarithm of the sum over the curves' own mechanisms."""
        return float(np.logaddexp.reduce([weight for _, weight in self.each]))


class OtherKind:
    """The curves of one kind in a campaign that is diagnosed by recordings of another."""

    def __init__(self, campaign: Campaign, kind: Kind, table: SigmaTable, without: Sequence[str]) -> None:
        """Find the contact points with nothing missing, the modulus free."""
        skin = replace(campaign.skin, youngs_modulus_mpa=None)
        mechanisms = Known({MODULUS_ERROR, *without})
        free = replace(campaign, skin=skin)
        mechanisms.bind(free, table, kind)
        self.kind = kind
        self.problem = FittingProblem(replace(curve_lines(free, kind), mechanisms=mechanisms), table)
        self.supported = tuple(name for name in mechanisms.named if self._supports(name))
        may_hide = {name: mechanisms[name].hidden_in_modulus(free) for name in self.supported}
        self._may_hide = {name: values for name, values in may_hide.items() if values}
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
            alone = [name for name in self.supported if name not in of_both and name not in self._may_hide]
            self.found[key] = self._tolerant(self._fitted(key, alone), key, of_both)
        return self.found[key]

    def _tolerant(self, told: OfCurves, names: frozenset[str], of_both: Sequence[str]) -> OfCurves:
        """Where a law extrapolates the modulus to no strain: as unsure as a good part of what it takes off."""
        plain = [name for name in names if not self.problem.lines.mechanisms[name].extrapolates_modulus]
        if len(plain) == len(names):
            return told
        taken_off = float(told.mean[0] - self.told(plain, of_both).mean[0])  # what hides is in both
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
        quantities, mean, covariance = _posterior(best, both)
        hidden = self._hidden()
        values, shares = np.array(hidden).T
        mean[0] -= shares @ values
        covariance[0, 0] += shares @ values**2 - (shares @ values) ** 2
        return OfCurves(each, quantities, mean, covariance, hidden=hidden)

    def _hidden(self) -> tuple[tuple[float, float], ...]:
        """What the apparent modulus may hide, with probabilities: each is there as often as any mechanism."""
        hidden = [(0.0, 1.0)]
        there, nothing = (np.exp(log_prior(size, 1)) for size in (1, 0))
        share = float(there / (there + nothing))
        for values in self._may_hide.values():
            each = [(0.0, 1 - share), *((value, share / len(values)) for value in values)]
            hidden = [(one + more, weight * other) for one, weight in hidden for more, other in each]
        return tuple(hidden)


def _posterior(explanation: Explanation, both: frozenset[str]) -> tuple[tuple[Quantity, ...], Floats, Floats]:
    """Mean and covariance of what both kinds know: the modulus' logarithm, the parameters of mechanisms."""
    hypothesis, fit = explanation.best.hypothesis, explanation.point.fit
    parameters, lines = explanation.model.parameters, hypothesis.lines
    quantities: list[Quantity] = [MODULUS]
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
