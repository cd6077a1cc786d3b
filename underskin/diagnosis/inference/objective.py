"""Hypotheses evaluated at several points at once: costs and their derivatives."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from underskin.autodiff import contiguous
from underskin.diagnosis.inference.frf_products import FrfProducts
from underskin.diagnosis.inference.hypothesis import FitPoint, Hypothesis
from underskin.diagnosis.inference.knowledge import KnowledgeOfSeveral
from underskin.diagnosis.inference.likelihood import Likelihoods, log_likelihoods, normal_equations
from underskin.diagnosis.inference.points import Evaluated, Points
from underskin.diagnosis.inference.products import Products, joined
from underskin.diagnosis.noise.noise_levels import SeveralLevels
from underskin.mechanisms.models.composition import SENSOR_SPREAD
from underskin.mechanisms.models.frf_models import FrfModels
from underskin.units import Floats, Indices

GAIN, LEVEL, POSITION = 0, 1, 2  # places among the covariance's parameters, the last where there is such scatter
SMOOTH = 2  # of curves, which have no place

_FREE_SPREAD = 0.02  # above this sd, e^b is linearised where b is, not at 0
_NUMBERS_AT_ONCE = 500_000
_PREDICTED_AT_ONCE = 1_000_000
_BENDINGS, _BENT, _LARGEST_BEND = 6, 3e-3, 2.0  # rounds at most, change that ends them, and bounds of b


class Evaluator:
    """Evaluates points of hypotheses of the same recordings, which have the same covariance parameters."""

    def __init__(self, hypotheses: Sequence[Hypothesis], held: Sequence[Collection[int]] | None = None) -> None:
        """Prepare the names and bounds; the parameters of each hypothesis at `held` stay where a point has them, and
        have no prior."""
        self.hypotheses = tuple(hypotheses)
        first = hypotheses[0]
        self.lines, self.curvature, self.placed = first.lines, first.curvature, first.placed
        self.covariance = first.covariance
        self._covariance_prior = np.array([entry.prior.row for entry in self.covariance])
        self._lowest = np.array([entry.low for entry in self.covariance])
        self._highest = np.array([entry.high for entry in self.covariance])
        self.counts = [len(entry.model.parameters) for entry in hypotheses]
        shape = len(hypotheses), max(self.counts)
        self.free = np.zeros(shape, dtype=bool)
        self.low, self.high, self._precision, self._centre = (np.zeros(shape) for _ in range(4))
        self._freedom = np.full(shape, np.inf)
        self._log_prior_height = np.zeros(len(hypotheses))
        for number, hypothesis in enumerate(hypotheses):
            places = [place for place in hypothesis.mean_places if held is None or place not in held[number]]
            self.free[number, places] = True
            self.low[number, : self.counts[number]], self.high[number, : self.counts[number]] = hypothesis.bounds
            of_priors = hypothesis.priors[:, places]
            self._precision[number, places], self._centre[number, places] = of_priors[:2]
            self._log_prior_height[number], self._freedom[number, places] = of_priors[2].sum(), of_priors[3]
        self._range = self.high - self.low
        each = [entry.knowledge for entry in hypotheses]
        self._known = KnowledgeOfSeveral(each, shape[1]) if any(one is not None for one in each) else None
        # Where each hypothesis has the covariance parameters that are its mechanisms' own, which come last.
        self.own = np.array(
            [
                [place for place, entry in enumerate(one.model.parameters) if entry.moves_covariance]
                for one in hypotheses
            ],
            dtype=np.intp,
        ).reshape(len(hypotheses), -1)
        own = [first.model.parameters[place] for place in self.own[0]]
        self._common = len(self.covariance) - len(own)
        spreads = [self._common + place for place, entry in enumerate(own) if entry.acts_on == "gain_spread"]
        self._spread = spreads[0] if spreads else None

    @property
    def no_bend(self) -> Floats:
        """Log gains of the sensors that are all 0."""
        return np.zeros(self.lines.sensors.shape[1])

    def at(self, point: FitPoint) -> Points:
        """One point of the first hypothesis."""
        return Points(np.zeros(1, dtype=np.intp), point.fit[None], point.covariance[None], point.bend[None])

    def evaluate(self, points: Points, *, slopes: bool = True) -> Evaluated:
        """Predict, with derivatives unless they are not needed, and weigh."""
        products = self.products(points, slopes=slopes, place=self.placed)
        return self.weighed(points, products)

    def products(self, points: Points, *, slopes: bool, place: bool) -> Products:
        """The inner products at points."""
        if self.lines.curves:
            edges = np.searchsorted(points.owner, np.arange(len(self.hypotheses) + 1))
            parts = [
                hypothesis.curve_products(points.fit[low:high, :count], slopes=slopes)
                for hypothesis, count, low, high in zip(
                    self.hypotheses, self.counts, edges[:-1], edges[1:], strict=True
                )
                if high > low
            ]
            return joined(parts, max(self.counts))
        several = self._at_once(points, max(self.counts) if slopes else 0)
        return joined([self._frf_products(points[some], slopes, place) for some in several], max(self.counts))

    def _at_once(self, points: Points, variables: int) -> list[slice]:
        """Which points are worked out at once, so that arrays with derivatives by so many variables stay small."""
        largest = max(hypothesis.frf_model.numbers(variables) for hypothesis in self.hypotheses)
        count = max(_PREDICTED_AT_ONCE // largest, 1)
        return [slice(first, first + count) for first in range(0, len(points), count)]

    @cached_property
    def _models(self) -> FrfModels:
        return FrfModels([hypothesis.frf_model for hypothesis in self.hypotheses])

    def place_slopes(self, points: Points) -> Floats:
        """∂m/∂x and ∂m/∂y of recordings, before the dynamics (2, points, recordings)."""
        slopes = np.empty((2, len(points), self.lines.recordings))
        for some in self._at_once(points, 0):
            part = points[some]
            for rows, response in self._models.respond(part.owner, part.fit, slopes=False, place=True, lines=False):
                slopes[:, some][:, rows] = response.place_slopes
        return slopes

    def _frf_products(self, points: Points, slopes: bool, place: bool) -> FrfProducts:
        """The inner products at points that are worked out at once."""
        parts = self._models.respond(points.owner, points.fit, slopes=slopes, place=place)
        each = []
        for rows, response in parts:
            own = self.hypotheses[points.owner[rows[0]]]
            each.append(FrfProducts.of(own.frf_lines, own.pickup_rows, response))
        order = np.argsort(np.concatenate([rows for rows, _ in parts]))
        if len(parts) == 1:  # whose points come in the order of what presses their contacts
            return each[0] if (np.diff(order) == 1).all() else each[0][order]
        return FrfProducts.joined(each, max(self.counts))[order]

    def weighed(self, points: Points, products: Products) -> Evaluated:
        """Points whose predictions are known, with the sensors' gains that belong to them where these are free."""
        if self._spread is not None:
            for _ in range(_BENDINGS):
                levels = self.levels(points.covariance[:, None])
                gains = Likelihoods(self.lines, self.curvature, products, levels, points.bend).sensor_gains
                free = levels.spread[:, 0] >= _FREE_SPREAD
                bend = np.where(free, np.clip(gains, -_LARGEST_BEND, _LARGEST_BEND), points.bend)
                bent = np.abs(bend - points.bend).max()
                if bent < _BENT:
                    break
                points = replace(points, bend=bend)
        return Evaluated(points, products, self._costs(points, products, points.covariance[:, None])[:, 0])

    def marginal(self, at: Evaluated) -> Likelihoods:
        """The likelihoods at points."""
        levels = self.levels(at.points.covariance[:, None])
        return Likelihoods(self.lines, self.curvature, at.products, levels, at.points.bend)

    def levels(self, covariance: Floats) -> SeveralLevels:
        """The noise levels that covariance parameters (…, parameters) hold, (…, 1)."""
        values = np.exp(covariance[..., None])
        shape = (*covariance.shape[:-1], 1)
        own = {entry.name: values[..., column, :] for column, entry in enumerate(self.covariance)}
        pickup = self.hypotheses[0].model.pickup
        return SeveralLevels(
            gain=values[..., GAIN, :],
            level=values[..., LEVEL, :],
            position=values[..., POSITION, :] if self.placed else np.zeros(shape),
            spread=np.full(shape, SENSOR_SPREAD) if self._spread is None else values[..., self._spread, :],
            pickup=None if pickup is None else pickup.deviation(own),
            smooth=values[..., SMOOTH, :] if self.lines.curves else np.zeros(shape),
        )

    def _costs(self, points: Points, products: Products, covariances: Floats) -> Floats:
        """The costs (points, sets) with covariance parameters (points, sets, parameters), where points predict."""
        from underskin.diagnosis.inference.cost_kernel import log_priors

        pickup = self.hypotheses[0].model.pickup
        if pickup is not None or self.lines.curves:
            rows = len(self.lines.value) if pickup is None else 4 * self.lines.recordings
            at_once = max(_NUMBERS_AT_ONCE // (covariances.shape[1] * rows), 1)
            if len(points) > at_once:
                parts = [slice(first, first + at_once) for first in range(0, len(points), at_once)]
                return np.concatenate([self._costs(points[part], products[part], covariances[part]) for part in parts])
        covariances = contiguous(covariances)
        each = log_likelihoods(self.lines, self.curvature, products, self.levels(covariances), points.bend)
        bounds = self.free, self.low, self.high, self._precision, self._centre
        heights = self._freedom, self._log_prior_height
        log_priors(points.owner, contiguous(points.fit), *bounds, *heights, covariances, self._covariance_prior, each)
        if self._known is not None:
            each += self._known.log_densities(points)[:, None]
        return -each

    def costs(self, at: Evaluated, covariances: Floats) -> Floats:
        """The costs (points, sets) at the same predictions with other covariance parameters (points, sets, …)."""
        return self._costs(at.points, at.products, covariances)

    def posterior_equations(self, at: Evaluated) -> tuple[Floats, Floats]:
        """Information and gradient of the log posterior in the mean parameters (points, parameters, parameters).

        What is held or no parameter has gradient 0 and information 1 of its own.
        """
        levels, bend = self.levels(at.points.covariance[:, None]), at.points.bend
        information, gradient = normal_equations(self.lines, self.curvature, at.products, levels, bend, at.growth)
        owner = at.points.owner
        free = self.free[owner]
        away = at.points.fit - self._centre[owner]
        precision = self._prior_precision(owner, away)
        if self._known is not None:
            of_others, towards = self._known.equations(at.points)
            information, gradient = information + of_others, gradient + towards
        gradient = np.where(free, gradient - precision * away, 0.0)
        information = np.where(free[:, :, None] & free[:, None, :], information, 0.0)
        diagonal = np.arange(free.shape[1])
        information[:, diagonal, diagonal] += np.where(free, precision, 1.0)
        return information, gradient

    def _prior_precision(self, owner: Indices, away: Floats) -> Floats:
        """What a quadratic with the prior's gradient has for its precision, so far `away` from the centres (points,
        parameters): less and less in heavy tails."""
        precision, freedom = self._precision[owner], self._freedom[owner]
        with np.errstate(invalid="ignore"):
            weight = (freedom + 1) / (freedom + precision * away**2)
        return np.where(np.isfinite(freedom), weight, 1.0) * precision

    def with_covariance(self, points: Points, covariance: Floats) -> Points:
        """The points with other covariance parameters, a mechanism's own among the coordinates of the fit."""
        fit = points.fit.copy()
        np.put_along_axis(fit, self.own[points.owner], covariance[:, self._common :], axis=1)
        return replace(points, covariance=covariance, fit=fit)
