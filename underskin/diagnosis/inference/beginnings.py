"""Points at which fits begin: what of a hypothesis no start names, its nuisances, d33 and noise levels."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from underskin.diagnosis.inference.frf_products import FrfProducts
from underskin.diagnosis.inference.hypothesis import FitPoint
from underskin.diagnosis.inference.noise_steps import SettlingEvaluator
from underskin.diagnosis.inference.points import Evaluated, Points
from underskin.diagnosis.inference.products import Products
from underskin.diagnosis.noise.noise_priors import GAIN_PRIOR, POSITION_PRIOR, START_GAIN
from underskin.units import Floats, Indices

_LARGEST_STEP = 1.0  # of log d33
_POSITION_STARTS = (0.07e-3, 0.14e-3, 0.28e-3)  # [m]


class BeginningEvaluator(SettlingEvaluator):
    """Evaluates points, and begins fits."""

    def start(self, own: Sequence[Floats], parents: Sequence[FitPoint | None]) -> Points:
        """Points of each hypothesis with these coordinates of its mechanisms (points, own), and the nuisances of a
        parent or at their centre; noise as it is usual."""
        owner = np.repeat(np.arange(len(own)), [len(entry) for entry in own])
        fit = np.zeros((len(owner), max(self.counts)))
        for number, (entry, values, parent) in enumerate(zip(self.hypotheses, own, parents, strict=True)):
            count, mechanisms = self.counts[number], entry.own_parameters
            nuisances = [parameter.start for parameter in entry.model.parameters[mechanisms:]]
            if parent is not None:
                nuisances = parent.fit[len(parent.fit) - (count - mechanisms) :].tolist()
            rows = owner == number
            fit[rows, :mechanisms], fit[rows, mechanisms:count] = values, nuisances
        common = [GAIN_PRIOR.middle, 0.0]
        if self.placed:
            common.append(POSITION_PRIOR.middle)
        if self.lines.curves:
            common.append(self.hypotheses[0].smooth.middle)
        of_mechanisms = np.take_along_axis(fit, self.own[owner], axis=1)
        covariance = np.concatenate([np.tile(common, (len(owner), 1)), of_mechanisms], axis=1)
        return Points(owner, fit, covariance, np.tile(self.no_bend, (len(owner), 1)))

    def begin(
        self, own: Sequence[Floats], parents: Sequence[FitPoint | None] | None = None, *, slopes: bool = False
    ) -> Evaluated:
        """The starts of each hypothesis with these coordinates, d33 as the data would have it, evaluated."""
        points = self.start(own, parents or [None] * len(own))
        products = self.products(points, slopes=slopes, place=self.placed)
        if not any(entry.proportional for entry in self.hypotheses[0].model.parameters):
            return self.weighed(points, products)
        ratio = self._ratio(points, products)
        if isinstance(products, FrfProducts):
            return self.weighed(*self._scaled(points, products, ratio))
        return self.evaluate(self._times(points, ratio)[0], slopes=slopes)

    def _ratio(self, points: Points, products: Products) -> Floats:
        """What measured recordings are of the predicted ones (points,): their mean, weighed by noise and scatter."""
        sums = products.summed(self.levels(points.covariance[:, None]))
        uu, uy = sums.uu[:, 0], sums.uy[:, 0]
        level = products.level
        weight = 1 / (1 + START_GAIN**2 * level**2 * uu)
        return np.asarray((weight * level * uy).sum(axis=1) / np.maximum((weight * level**2 * uu).sum(axis=1), 1e-300))

    def with_scatter(self, points: Points) -> Points:
        """For each point fitted without positioning scatter, the best of a few scales of it, d33 following each.

        Where the scatter is large, what was fitted without it may be far off: also from the nuisances' centres.
        """
        fresh = points.fit.copy()
        for number, (hypothesis, count) in enumerate(zip(self.hypotheses, self.counts, strict=True)):
            nuisances = slice(hypothesis.own_parameters, count)
            starts = [entry.start for entry in hypothesis.model.parameters[nuisances]]
            fresh[points.owner == number, nuisances] = starts
        scales = np.log(_POSITION_STARTS)
        gain, level, own = points.covariance[:, :1], points.covariance[:, 1:2], points.covariance[:, 2:]
        common = np.minimum(gain, GAIN_PRIOR.middle), level
        covariances = [np.concatenate([*common, np.full_like(gain, scale), own], axis=1) for scale in scales]
        twice = np.repeat(np.arange(len(points)), 2)
        is_fresh = np.tile([False, True], len(points))
        both = points[twice]
        both = replace(both, fit=np.where(is_fresh[:, None], fresh[twice], both.fit), covariance=covariances[0][twice])
        products = self.products(both, slopes=True, place=True)
        both, products = self._scaled(both, products, np.where(is_fresh, self._ratio(both, products), 1.0))
        rows = np.repeat(np.arange(len(both)), len(scales))
        each = np.stack(covariances, axis=1)[twice].reshape(len(rows), -1)
        at = self._with_d33(self.weighed(self.with_covariance(both[rows], each), products[rows]))
        sets = 2 * len(scales)
        return at.points[at.cost.reshape(-1, sets).argmin(axis=1) + sets * np.arange(len(points))]

    def _scaled(self, points: Points, products: Products, ratio: Floats) -> tuple[Points, Products]:
        """Points with d33 so many times as large (points,), and what they predict."""
        assert isinstance(products, FrfProducts)
        moved, factor = self._times(points, ratio)
        return moved, products.scaled(factor)

    def _times(self, points: Points, ratio: Floats) -> tuple[Points, Floats]:
        """With d33 so many times as large (points,), within its bounds, and by how much; as it is where not above 0."""
        number, place = np.arange(len(points)), self._d33[points.owner]
        fit = points.fit.copy()
        change = np.log(np.where(ratio > 0, ratio, 1.0))
        low, high = self.low[points.owner, place], self.high[points.owner, place]
        fit[number, place] = np.clip(fit[number, place] + change, low, high)
        return replace(points, fit=fit), np.exp(fit[number, place] - points.fit[number, place])

    def _with_d33(self, at: Evaluated) -> Evaluated:
        """With the d33 that the data would have at these noise levels: no further prediction."""
        information, gradient = self.posterior_equations(at)
        number, place = np.arange(len(at)), self._d33[at.points.owner]
        step = np.clip(gradient[number, place] / information[number, place, place], -_LARGEST_STEP, _LARGEST_STEP)
        return self.settle(self.weighed(*self._scaled(at.points, at.products, np.exp(step))), 2)

    @cached_property
    def _d33(self) -> Indices:
        """Where each hypothesis has the parameter that the prediction is proportional to."""
        proportional = [[entry.proportional for entry in one.model.parameters] for one in self.hypotheses]
        return np.array([own.index(True) for own in proportional])
