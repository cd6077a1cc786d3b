"""The evidence of one hypothesis: Laplace's method, and integrals over parameters whose posterior is not Gaussian.

A parameter on a logarithmic scale that the lines hardly determine (the time of a small step, the onset of a small loss)
is one: the others follow it along a curve, and where the effect is small it is free. There Z is the integral over that
parameter of the evidence that Laplace's method gives with it held.

The positioning scatter is another: its prior is flat between two values, and often the recordings do not determine it;
the gain scatter's posterior is then not Gaussian either. There Z is the integral over the logarithms of both, at the
most probable prediction, from which the quadratic of the mean parameters leads on.

Integrals are sums at equal strides, as good as exact for what falls to nothing both ways.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from underskin.diagnosis.inference.laplace import Evidence, around, around_levels, around_mean, log_volume
from underskin.diagnosis.inference.objective import GAIN, POSITION
from underskin.diagnosis.inference.optimizer import Fitter
from underskin.diagnosis.inference.points import Evaluated, Points
from underskin.units import Floats

__all__ = ["Evidence", "around", "held_points", "integrated", "laplace"]

_TRUSTED = 1.0  # gain in log posterior within which an integral was begun at the most probable point
_LOOSE = 0.3  # standard deviation beyond which a logarithmic parameter is integrated over: a factor of 1.35
_FEWEST_STRIDES = 8  # from one bound to the other
_GONE = 4.0  # nats below the greatest at which an integral ends
_LONGEST_STRIDE = 0.3  # of scatter's logarithm: twice the deviation with which its prior falls off
_GAIN_STRIDES = 8  # either way: 2.4 of the logarithm at most, and the prior's flat part is 1.6 wide
_SETTLING = 5  # steps of the other noise levels at each positioning scatter
_AT_ONCE = 2  # strides either way, before it is known whether more are needed


def laplace(fitter: Fitter, at: Evaluated) -> Evidence:
    """The evidence around the most probable point, over all values of what the lines leave loose."""
    return integrated(around(fitter, at))[0]


def integrated(evidence: Sequence[Evidence]) -> list[Evidence]:
    """Over all values of a parameter that the lines leave loose, where there is one, and of the positioning scatter."""
    whole = list(evidence)
    for group in _alike(whole, [_loosest(entry) is not None for entry in whole]):
        for number, entry in zip(group, _over_loose([whole[number] for number in group]), strict=True):
            whole[number] = entry
    for group in _alike(whole, [entry.hypothesis.placed for entry in whole]):
        for number, entry in zip(group, _over_position([whole[number] for number in group]), strict=True):
            whole[number] = entry
    return whole


def _alike(evidence: Sequence[Evidence], chosen: Sequence[bool]) -> list[list[int]]:
    """Of those chosen, which can be evaluated together."""
    groups: dict[object, list[int]] = {}
    for number, entry in enumerate(evidence):
        if chosen[number]:
            groups.setdefault(entry.hypothesis.group(number), []).append(number)
    return list(groups.values())


@dataclass
class _Integral:
    """∫ Z(x) dx within bounds, from values at equal strides either way of `begin` until Z is gone.

    Each value counts for half the way to the next; the last before a bound for the way to the bound.
    """

    begin: float
    stride: float
    low: float
    high: float
    log_values: dict[float, float] = field(default_factory=dict)

    def missing(self) -> list[float]:
        """The values of x that are wanted next; none where Z is gone both ways."""
        if not self.log_values:
            steps = list(range(-_AT_ONCE, _AT_ONCE + 1))
            values = [self.begin + step * self.stride for step in steps]
        else:
            least = max(self.log_values.values()) - _GONE
            first, last = min(self.log_values), max(self.log_values)
            steps = list(range(1, _AT_ONCE + 1))
            below = [first - step * self.stride for step in steps] if self.log_values[first] > least else []
            above = [last + step * self.stride for step in steps] if self.log_values[last] > least else []
            values = below + above
        return [value for value in values if value == self.begin or self.low <= value <= self.high]

    @property
    def log_total(self) -> float:
        """The logarithm of the integral."""
        values = np.array(sorted(self.log_values))
        below, above = values[0] - self.low, self.high - values[-1]
        half = self.stride / 2
        edges = [values[0] - (below if below < self.stride else half), *((values[1:] + values[:-1]) / 2)]
        edges.append(values[-1] + (above if above < self.stride else half))
        logs = [self.log_values[value] for value in values.tolist()]
        return float(np.logaddexp.reduce(logs + np.log(np.maximum(np.diff(edges), 1e-300))))


def _work_out(integrals: Sequence[_Integral], log_values: Callable[[list[int], Floats], Floats]) -> None:
    """Fill the integrals: `log_values` of the integrals with these numbers at these values."""
    while True:
        wanted = [(number, value) for number, entry in enumerate(integrals) for value in entry.missing()]
        if not wanted:
            return
        numbers, values = [number for number, _ in wanted], np.array([value for _, value in wanted])
        for (number, value), log_value in zip(wanted, log_values(numbers, values).tolist(), strict=True):
            integrals[number].log_values[value] = log_value


def _over_loose(evidence: list[Evidence]) -> list[Evidence]:
    """With log ∫ Z(x) p(x) dx over the loosest parameter x of each.

    Where the integral comes upon a point more probable than that around which it was begun, it begins again from there.
    """
    places = [_loosest(entry) for entry in evidence]
    known = [place for place in places if place is not None]
    held = Fitter([entry.hypothesis for entry in evidence], held=[(place,) for place in known])
    integrals = []
    for number, (entry, place) in enumerate(zip(evidence, known, strict=True)):
        low, high = held.low[number, place], held.high[number, place]
        deviation = float(np.sqrt(np.diag(entry.covariance)[entry.hypothesis.mean_places.index(place)]))
        stride = min(deviation, (high - low) / _FEWEST_STRIDES)
        integrals.append(_Integral(float(entry.point.fit[place]), stride, low, high))
    better: dict[int, Evidence] = {}

    def log_values(numbers: list[int], values: Floats) -> Floats:
        points = held_points(held, evidence, known, numbers, values)
        begun = held.settle(held.evaluate(points), 1)
        found = around(held, held.descend(begun, 1, _within_reach))
        own = [held.hypotheses[number].model.parameters[known[number]] for number in numbers]
        priors = [entry.log_prior(value) for entry, value in zip(own, values.tolist(), strict=True)]
        for number, entry, prior in zip(numbers, found, priors, strict=True):
            cost = entry.cost - prior
            if cost < min(evidence[number].cost - _TRUSTED, better[number].cost if number in better else np.inf):
                better[number] = replace(entry, cost=cost)
        return np.array([entry.log_evidence + prior for entry, prior in zip(found, priors, strict=True)])

    _work_out(integrals, log_values)
    whole = [
        replace(entry, log_evidence=integral.log_total) for entry, integral in zip(evidence, integrals, strict=True)
    ]
    for number, entry in better.items():
        fitter = Fitter([entry.hypothesis])
        settled = fitter.settle(fitter.evaluate(fitter.at(entry.point)), 1)
        if settled.cost[0] < evidence[number].cost - _TRUSTED:
            again = around(fitter, settled)
            whole[number] = _over_loose(again)[0] if _loosest(again[0]) is not None else again[0]
    return whole


def _within_reach(at: Evaluated) -> Floats:
    """The cost that points must get below to count in the integrals that they belong to."""
    least = np.full(at.points.owner.max() + 1, np.inf)
    np.minimum.at(least, at.points.owner, at.cost)
    return np.asarray(least[at.points.owner] + _GONE + _TRUSTED)


def _loosest(evidence: Evidence) -> int | None:
    """The place of the mechanisms' logarithmic parameter whose standard deviation is the largest, where that counts."""
    hypothesis = evidence.hypothesis
    deviations = {
        place: float(np.sqrt(variance))
        for place, variance in zip(hypothesis.mean_places, np.diag(evidence.covariance), strict=True)
        if place < hypothesis.own_parameters and hypothesis.model.parameters[place].scale == "log"
    }
    place = max(deviations, key=lambda place: deviations[place], default=None)
    return place if place is not None and deviations[place] > _LOOSE else None


def held_points(
    held: Fitter, evidence: Sequence[Evidence], places: Sequence[int], numbers: Sequence[int], values: Floats
) -> Points:
    """Where the held parameters have these values and the others follow as the quadratics say."""
    fits = np.zeros((len(numbers), held.low.shape[1]))
    for row, (number, value) in enumerate(zip(numbers, values.tolist(), strict=True)):
        entry, place = evidence[number], places[number]
        mean = entry.hypothesis.mean_places
        index = mean.index(place)
        along = entry.covariance[:, index] / entry.covariance[index, index]
        fits[row, : len(entry.point.fit)] = entry.point.fit
        fits[row, mean] += along * (value - entry.point.fit[place])
        fits[row] = np.clip(fits[row], held.low[number], held.high[number])
        fits[row, place] = value
    covariance, bend = (
        np.array([getattr(evidence[number].point, name) for number in numbers]) for name in ("covariance", "bend")
    )
    return Points(np.array(numbers, dtype=np.intp), fits, covariance, bend)


def _over_position(evidence: list[Evidence]) -> list[Evidence]:
    """With the integrals over log p in place of their normal approximation, p the positioning scatter."""
    fitter = Fitter([entry.hypothesis for entry in evidence])
    fits = np.zeros((len(evidence), fitter.low.shape[1]))
    for row, entry in zip(fits, evidence, strict=True):
        row[: len(entry.point.fit)] = entry.point.fit
    covariance, bend = (np.array([getattr(entry.point, name) for entry in evidence]) for name in ("covariance", "bend"))
    best = fitter.evaluate(Points(np.arange(len(evidence)), fits, covariance, bend))
    growth = np.full((len(evidence), fitter.lines.recordings, fits.shape[1]), np.nan)
    for row, entry in zip(growth, evidence, strict=True):
        if entry.growth is not None:
            row[:, : entry.growth.shape[-1]] = entry.growth[0]
            row[:, entry.growth.shape[-1] :] = 0.0
    best = replace(best, growth=growth)
    hessian = fitter.covariance_equations(best)[1]
    low, high = fitter.covariance[POSITION].low, fitter.covariance[POSITION].high
    integrals = [
        _Integral(float(entry.point.covariance[POSITION]), float(stride), low, high)
        for entry, stride in zip(evidence, _stride(hessian[:, POSITION, POSITION]), strict=True)
    ]

    def log_values(numbers: list[int], values: Floats) -> Floats:
        begin = best[np.array(numbers)]
        covariance = begin.points.covariance.copy()
        covariance[:, POSITION] = values
        moved = fitter.weighed(fitter.with_covariance(begin.points, covariance), begin.products)
        at = replace(fitter.settle(moved, _SETTLING, held=POSITION), growth=begin.growth)
        return around_mean(fitter, at)[0] + _over_gain(fitter, at)

    _work_out(integrals, log_values)
    quadratic = around_mean(fitter, best)[0] + around_levels(fitter, best)
    return [
        replace(entry, log_evidence=entry.log_evidence + integral.log_total - whole)
        for entry, integral, whole in zip(evidence, integrals, quadratic.tolist(), strict=True)
    ]


def _over_gain(fitter: Fitter, at: Evaluated) -> Floats:
    """What the integrals over the noise levels but the position's add: sums over the gain's, the others following."""
    hessian = fitter.covariance_equations(at)[1]
    others = [place for place in range(hessian.shape[1]) if place not in (GAIN, POSITION)]
    curvature = hessian[:, others][:, :, others]
    stride = _stride(hessian[:, GAIN, GAIN])
    steps = stride[:, None] * np.arange(-_GAIN_STRIDES, _GAIN_STRIDES + 1)
    covariances = np.repeat(at.points.covariance[:, None], steps.shape[1], axis=1)
    covariances[..., GAIN] += steps
    follow = np.linalg.solve(curvature, hessian[:, others, GAIN][..., None])[..., 0]
    covariances[..., others] -= steps[..., None] * follow[:, None]
    entry = fitter.covariance[GAIN]
    within = (covariances[..., GAIN] >= entry.low) & (covariances[..., GAIN] <= entry.high)
    gains = np.where(within, at.cost[:, None] - fitter.costs(at, covariances), -np.inf)
    return np.asarray(np.logaddexp.reduce(gains, axis=1) + np.log(stride) + log_volume(curvature))


def _stride(curvature: Floats) -> Floats:
    """One standard deviation, or what resolves how the priors of scatter fall off."""
    return np.asarray(np.maximum(curvature, _LONGEST_STRIDE**-2) ** -0.5)
