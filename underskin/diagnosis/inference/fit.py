"""Fits of a hypothesis: costs and their derivatives at several points at once, starting points, and their improvement.

Mean parameters take damped Gauss–Newton steps within the bounds, with a damping for each point, until it converges.
Parameters of the covariance only (gain and position scatter, line level, sensor spread, pick-up) take Newton steps on
the likelihood of fixed predictions, which need no model evaluation.
"""

from collections.abc import Callable, Collection
from copy import copy
from dataclasses import replace
from enum import IntEnum
from functools import cached_property
from typing import Self

import numpy as np

from underskin.autodiff import contiguous
from underskin.diagnosis.inference.hypothesis import (
    Evaluated,
    FitPoint,
    Hypothesis,
    Points,
    Tangent,
    log_likelihoods,
)
from underskin.diagnosis.inference.least_squares import LeastSquares, between_samples
from underskin.diagnosis.inference.products import FrfProducts, Products
from underskin.diagnosis.noise import DISCREPANCY, GAIN_PRIOR, START_GAIN, USUAL, SeveralLevels
from underskin.mechanisms.models.composition import SENSOR_SPREAD
from underskin.mechanisms.models.curves import CurveModel
from underskin.units import Floats, Mask

_FREE_SPREAD = 0.02  # above this sd of b, e^b is linearised at the most probable b, not at 0
_NUMBERS_AT_ONCE = 1_000_000
_GAIN_ROUNDS, _GAIN_CHANGE = 6, 3e-3  # most rounds, and the change that ends them
_LARGEST_SENSOR_LOG_GAIN = 2.0  # bound of b
_LARGEST_STEP = 1.0  # of a fit coordinate; of wider ranges a share
_POSITION_STARTS = (0.07e-3, 0.14e-3, 0.28e-3)  # [m]
_SETTLING = 20
_SMOOTH_STARTS = (USUAL.low, DISCREPANCY.low)  # of curves: close fit, and loose
_CURVE_SETTLING = 8
_PROMISED, _MARGIN = 10.0, 2.0  # times the gain by the gradient, and nats beyond it, that a fit may still gain
_CONVERGED = 0.01  # in log posterior
_MOST_ITERATIONS = 25
_LEAST_CURVATURE = 1e-10
_LEVEL_STEP = 0.05  # of the finite differences in the logarithms of noise levels
_LARGEST_LEVEL_STEP = 0.7  # of a Newton step in a noise level's logarithm: a factor of 2
_TRIES, _SHORTER, _LEAST_GAIN = (
    4,
    4.0,
    1e-3,
)  # tries of a step without gain, its shortening, and the gain that ends them
_LEAST_DAMPING = 1e-3  # of a first Gauss–Newton step
_MAY_GAIN = 60.0  # nats that a fit of curves may still gain beyond the least-squares one's
CostToBeat = Callable[[Evaluated], Floats]  # costs (points,) that points must get below


class Scatter(IntEnum):
    """Indices of the covariance parameters; those of mechanisms come after them. FRFs may have a positioning scatter,
    curves have a smooth error in its place."""

    GAIN = 0
    LEVEL = 1
    POSITION = 2
    SMOOTH = 2


class Fitter:
    """Evaluates, starts and improves points of a hypothesis."""

    def __init__(self, hypothesis: Hypothesis, held: Collection[int] = ()) -> None:
        """Prepare names and bounds; parameters with indices `held` are fixed and have no prior."""
        self.hypothesis, self.model, self.lines = hypothesis, hypothesis.model, hypothesis.lines
        self.curvature, self.has_position_scatter = hypothesis.curvature, hypothesis.has_position_scatter
        self.covariance = hypothesis.covariance
        self._covariance_prior = np.array([parameter.prior.row for parameter in self.covariance])
        self._lowest = np.array([parameter.low for parameter in self.covariance])
        self._highest = np.array([parameter.high for parameter in self.covariance])
        parameters = self.model.parameters
        self.free = np.zeros(len(parameters), dtype=bool)
        self.free[[index for index in hypothesis.mean_indices if index not in held]] = True
        self.low, self.high = map(contiguous, hypothesis.bounds)
        self._range = self.high - self.low
        precision, centre, height, freedom = hypothesis.priors
        self._precision, self._centre = np.where(self.free, precision, 0.0), np.where(self.free, centre, 0.0)
        self._freedom = np.where(self.free, freedom, np.inf)
        self._log_prior_height = float(height[self.free].sum())
        # Indices of the covariance parameters that belong to mechanisms; these come last.
        self.covariance_indices = np.array(
            [index for index, parameter in enumerate(parameters) if parameter.moves_covariance], dtype=np.intp
        )
        self._shared_count = len(self.covariance) - len(self.covariance_indices)
        spreads = [
            self._shared_count + number
            for number, index in enumerate(self.covariance_indices)
            if parameters[index].acts_on == "gain_spread"
        ]
        self._spread = spreads[0] if spreads else None

    @property
    def no_sensor_log_gain(self) -> Floats:
        """Log gains of 0 (sensors,)."""
        return np.zeros(self.lines.sensors.shape[1])

    def at(self, point: FitPoint) -> Points:
        """One point."""
        return Points(point.fit[None], point.covariance[None], point.sensor_log_gain[None])

    def evaluate(self, points: Points, *, slopes: bool = True) -> Evaluated:
        """Predict, with derivatives if `slopes`, and compute the costs."""
        products = self.products(points, slopes=slopes, place=self.has_position_scatter)
        return self.weighed(points, products)

    def products(self, points: Points, *, slopes: bool, place: bool) -> Products:
        """The inner products at points; with derivatives if `slopes`, with position slopes if `place`."""
        if self.lines.curves:
            return self.hypothesis.curve_products(points.fit, slopes=slopes)
        return FrfProducts.joined(
            [
                FrfProducts.of(
                    self.hypothesis.frf_lines,
                    self.hypothesis.pickup_rows,
                    self.hypothesis.frf_model.respond(points.fit[batch], slopes=slopes, place=place),
                )
                for batch in self._at_once(points, len(self.low) if slopes else 0)
            ]
        )

    def _at_once(self, points: Points, variables: int) -> list[slice]:
        """Slices of points small enough that arrays with derivatives by so many variables stay small."""
        count = max(_NUMBERS_AT_ONCE // self.hypothesis.frf_model.numbers(variables), 1)
        return [slice(first, first + count) for first in range(0, len(points), count)]

    def weighed(self, points: Points, products: Products) -> Evaluated:
        """Points with known predictions and their costs; where the sensors' gains are free, at the most probable
        gains."""
        if self._spread is not None:
            for _ in range(_GAIN_ROUNDS):
                gains = self.tangent(points, products).sensor_gains
                free = self.levels(points.covariance).spread >= _FREE_SPREAD
                sensor_log_gain = np.where(
                    free, np.clip(gains, -_LARGEST_SENSOR_LOG_GAIN, _LARGEST_SENSOR_LOG_GAIN), points.sensor_log_gain
                )
                change = np.abs(sensor_log_gain - points.sensor_log_gain).max()
                if change < _GAIN_CHANGE:
                    break
                points = replace(points, sensor_log_gain=sensor_log_gain)
        return Evaluated(points, products, self._costs(points, products, points.covariance[:, None])[:, 0])

    def tangent(self, points: Points, products: Products, levels: SeveralLevels | None = None) -> Tangent:
        """The likelihood linearised at points with known predictions, under their noise levels or others."""
        levels = self.levels(points.covariance[:, None]) if levels is None else levels
        return Tangent(self.lines, self.curvature, products, levels, points.sensor_log_gain)

    def levels(self, covariance: Floats) -> SeveralLevels:
        """The noise levels (…, 1) of covariance parameters (…, parameters)."""
        values = np.exp(covariance[..., None])
        none = np.zeros((*covariance.shape[:-1], 1))
        named = [(parameter.name, values[..., column, :]) for column, parameter in enumerate(self.covariance)]
        shared, pickup = dict(named[: self._shared_count]), self.model.pickup
        return SeveralLevels(
            gain=shared["gain"],
            level=shared["level"],
            position=shared.get("position", none),
            spread=none + SENSOR_SPREAD if self._spread is None else values[..., self._spread, :],
            pickup=None if pickup is None else pickup.deviation(dict(named[self._shared_count :])),
            smooth=shared.get("smooth", none),
        )

    def _costs(self, points: Points, products: Products, covariances: Floats) -> Floats:
        """The costs (points, sets) with covariance parameters (points, sets, parameters), at fixed predictions."""
        from underskin.diagnosis.kernels import log_priors

        pickup = self.model.pickup
        if pickup is not None or self.lines.curves:
            rows = len(self.lines.value) if pickup is None else 4 * self.lines.recordings
            at_once = max(_NUMBERS_AT_ONCE // (covariances.shape[1] * rows), 1)
            if len(points) > at_once:
                parts = [slice(first, first + at_once) for first in range(0, len(points), at_once)]
                return np.concatenate([self._costs(points[part], products[part], covariances[part]) for part in parts])
        covariances = contiguous(covariances)
        log_posterior = log_likelihoods(
            self.lines, self.curvature, products, self.levels(covariances), points.sensor_log_gain
        )
        bounds = self.free, self.low, self.high, self._precision, self._centre
        heights = self._freedom, self._log_prior_height
        log_priors(contiguous(points.fit), *bounds, *heights, covariances, self._covariance_prior, log_posterior)
        if self.hypothesis.other_kinds is not None:
            log_posterior += self.hypothesis.other_kinds.log_densities(points.fit)[:, None]
        return -log_posterior

    def costs(self, at: Evaluated, covariances: Floats) -> Floats:
        """The costs (points, sets) at the same predictions with other covariance parameters (points, sets, …)."""
        return self._costs(at.points, at.products, covariances)

    def posterior_equations(self, at: Evaluated) -> tuple[Floats, Floats]:
        """Information and gradient of the log posterior in the mean parameters (points, parameters, parameters).

        Held parameters have gradient 0 and information 1.
        """
        information, gradient = self.tangent(at.points, at.products).normal_equations
        offset = at.points.fit - self._centre
        precision = self._prior_precision(offset)
        others = self.hypothesis.other_kinds
        if others is not None:
            information, gradient = information + others.precision, gradient + others.gradients(at.points.fit)
        gradient = np.where(self.free, gradient - precision * offset, 0.0)
        information = np.where(self.free[:, None] & self.free, information, 0.0)
        diagonal = np.arange(len(self.free))
        information[:, diagonal, diagonal] += np.where(self.free, precision, 1.0)
        return information, gradient

    def _prior_precision(self, offset: Floats) -> Floats:
        """Precision of the quadratic with the prior's gradient at the `offset` from the centres (points, parameters);
        it decreases with the offset in heavy tails."""
        precision, freedom = self._precision, self._freedom
        with np.errstate(invalid="ignore"):
            weight = (freedom + 1) / (freedom + precision * offset**2)
        return np.where(np.isfinite(freedom), weight, 1.0) * precision

    def with_covariance(self, points: Points, covariance: Floats) -> Points:
        """The points with other covariance parameters; those of mechanisms are also coordinates of the fit."""
        fit = points.fit.copy()
        fit[:, self.covariance_indices] = covariance[:, self._shared_count :]
        return replace(points, covariance=covariance, fit=fit)

    def update_noise_levels(self, at: Evaluated, steps: int) -> Evaluated:
        """Newton steps of the covariance parameters, at fixed predictions.

        Where mechanisms have covariance parameters these are correlated, so the steps are joint.
        """
        low, high = self._lowest, self._highest
        points, cost, moving = at.points, at.cost.copy(), np.flatnonzero(np.isfinite(at.cost))
        products = at.products.values
        for _ in range(steps):
            part = Evaluated(points, products, cost.copy()).subset(moving)
            gradient, hessian = self.covariance_equations(part, first_mixed=self._shared_count)
            eigenvalues, vectors = np.linalg.eigh(hessian)
            along = np.einsum("nij,ni->nj", vectors, gradient) / np.maximum(np.abs(eigenvalues), 1.0)
            step = -np.einsum("nij,nj->ni", vectors, along)
            here = part.points.covariance
            outwards = ((here <= low) & (step < 0)) | ((here >= high) & (step > 0))
            step = np.where(outwards, 0.0, step)
            step *= np.minimum(1.0, _LARGEST_LEVEL_STEP / np.maximum(np.abs(step).max(axis=1), 1e-12))[:, None]
            covariance, reached, gained = here.copy(), part.cost.copy(), np.zeros(len(part))
            trying = np.arange(len(part))
            for _ in range(_TRIES):
                tried = np.clip(here[trying] + step[trying], low, high)
                costs = self.costs(part.subset(trying), tried[:, None])[:, 0]
                lower = costs < part.cost[trying]
                better = trying[lower]
                covariance[better], reached[better] = tried[lower], costs[lower]
                gained[better] = part.cost[better] - costs[lower]
                trying = trying[~lower]
                if not len(trying):
                    break
                step = step / _SHORTER
            all_covariances = points.covariance.copy()
            all_covariances[moving] = covariance
            points = self.with_covariance(points, all_covariances)
            cost[moving] = reached
            moving = moving[gained >= _LEAST_GAIN]
            if not len(moving):
                break
        return Evaluated(points, at.products, cost)

    def covariance_equations(self, at: Evaluated, *, first_mixed: int = 0) -> tuple[Floats, Floats]:
        """Gradient and Hessian of the costs in the covariance parameters, by differences; without the mixed terms of
        parameters before `first_mixed`."""
        here = at.points.covariance
        count = here.shape[1]
        steps = _LEVEL_STEP * np.eye(count)
        # Far enough inside the bounds for the differences
        centre = np.clip(here, self._lowest + 2 * _LEVEL_STEP, self._highest - 2 * _LEVEL_STEP)
        pairs = [(a, b) for a in range(count) for b in range(first_mixed, a)]
        both = [steps[a] + steps[b] for a, b in pairs]
        shifts = np.array([np.zeros(count), *steps, *-steps, *both, *(-step for step in both)])
        costs = self.costs(at, centre[:, None] + shifts)
        middle, up, down = costs[:, :1], costs[:, 1 : count + 1], costs[:, count + 1 : 2 * count + 1]
        second_differences = up + down - 2 * middle
        gradient = (up - down) / (2 * _LEVEL_STEP)
        hessian = second_differences[:, :, None] / _LEVEL_STEP**2 * np.eye(count)
        mixed_differences = costs[:, 2 * count + 1 :].reshape(len(at), 2, -1).sum(axis=1) - 2 * middle
        for index, (a, b) in enumerate(pairs):
            hessian[:, a, b] = (mixed_differences[:, index] - second_differences[:, a] - second_differences[:, b]) / (
                2 * _LEVEL_STEP**2
            )
            hessian[:, b, a] = hessian[:, a, b]
        return gradient + np.einsum("nij,nj->ni", hessian, here - centre), hessian

    def start(self, mechanism_fits: Floats, parent: FitPoint | None) -> Points:
        """Points with these coordinates of the mechanisms (points, parameters), nuisances from a parent or at their
        priors' centres, and usual noise levels."""
        points, mechanisms = mechanism_fits.shape
        nuisances = np.array([parameter.start for parameter in self.model.parameters[mechanisms:]])
        if parent is not None:
            nuisances = parent.fit[len(parent.fit) - len(nuisances) :]
        # Bounds may differ from the parent's: where the contact sticks, a snap-in confines its beginning.
        nuisances = np.clip(nuisances, self.low[mechanisms:], self.high[mechanisms:])
        fit = np.concatenate([mechanism_fits, np.tile(nuisances, (points, 1))], axis=1)
        shared = [parameter.prior.middle for parameter in self.covariance[: self._shared_count]]
        covariance = np.concatenate([np.tile(shared, (points, 1)), fit[:, self.covariance_indices]], axis=1)
        return Points(fit, covariance, np.tile(self.no_sensor_log_gain, (points, 1)))

    def initial(self, mechanism_fits: Floats, parent: FitPoint | None = None, *, slopes: bool = False) -> Evaluated:
        """The starting points with these coordinates, evaluated, with d33 estimated from the data."""
        points = self.start(mechanism_fits, parent)
        products = self.products(points, slopes=slopes, place=self.has_position_scatter)
        if not any(parameter.proportional for parameter in self.model.parameters):
            return self.weighed(points, products)
        ratio = self._ratio(points, products)
        if isinstance(products, FrfProducts):
            return self.weighed(*self._scaled(points, products, ratio))
        return self.evaluate(self._times(points, ratio)[0], slopes=slopes)

    def _ratio(self, points: Points, products: Products) -> Floats:
        """Mean ratio of measured to predicted recordings (points,), weighted by noise and scatter."""
        sums = products.summed(self.levels(points.covariance[:, None]))
        uu, uy = sums.uu[:, 0], sums.uy[:, 0]
        level = products.level
        weight = 1 / (1 + START_GAIN**2 * level**2 * uu)
        return np.asarray((weight * level * uy).sum(axis=1) / np.maximum((weight * level**2 * uu).sum(axis=1), 1e-300))

    def with_scatter(self, points: Points) -> Points:
        """For each point fitted without positioning scatter, the best of a few scales of it, with d33 estimated for
        each.

        Large scatter may have biased the fit without it, so the nuisances' centres are tried as well.
        """
        fresh, mechanisms = points.fit.copy(), self.hypothesis.mechanism_parameter_count
        fresh[:, mechanisms:] = [parameter.start for parameter in self.model.parameters[mechanisms:]]
        scales = np.log(_POSITION_STARTS)
        gain, level, mechanism_levels = points.covariance[:, :1], points.covariance[:, 1:2], points.covariance[:, 2:]
        shared = np.minimum(gain, GAIN_PRIOR.middle), level
        covariances = [
            np.concatenate([*shared, np.full_like(gain, scale), mechanism_levels], axis=1) for scale in scales
        ]
        twice = np.repeat(np.arange(len(points)), 2)
        is_fresh = np.tile([False, True], len(points))
        both = points[twice]
        both = replace(both, fit=np.where(is_fresh[:, None], fresh[twice], both.fit), covariance=covariances[0][twice])
        products = self.products(both, slopes=True, place=True)
        both, products = self._scaled(both, products, np.where(is_fresh, self._ratio(both, products), 1.0))
        rows = np.repeat(np.arange(len(both)), len(scales))
        covariance = np.stack(covariances, axis=1)[twice].reshape(len(rows), -1)
        at = self._with_d33(self.weighed(self.with_covariance(both[rows], covariance), products[rows]))
        candidates = 2 * len(scales)
        return at.points[at.cost.reshape(-1, candidates).argmin(axis=1) + candidates * np.arange(len(points))]

    def _scaled(self, points: Points, products: Products, ratio: Floats) -> tuple[Points, Products]:
        """Points with d33 multiplied by `ratio` (points,), and their predictions."""
        assert isinstance(products, FrfProducts)
        moved, factor = self._times(points, ratio)
        return moved, products.scaled(factor)

    def _times(self, points: Points, ratio: Floats) -> tuple[Points, Floats]:
        """Points with d33 multiplied by `ratio` (points,) within its bounds, and the factor applied; 1 where the ratio
        is not positive."""
        fit, index = points.fit.copy(), self._d33
        change = np.log(np.where(ratio > 0, ratio, 1.0))
        fit[:, index] = np.clip(fit[:, index] + change, self.low[index], self.high[index])
        return replace(points, fit=fit), np.exp(fit[:, index] - points.fit[:, index])

    def rescaled(self, points: Points) -> Evaluated:
        """The points with derivatives, of FRFs each with its most probable d33."""
        products = self.products(points, slopes=True, place=self.has_position_scatter)
        if not isinstance(products, FrfProducts):
            return self.weighed(points, products)
        return self._with_d33(self.weighed(*self._scaled(points, products, self._ratio(points, products))))

    def _with_d33(self, at: Evaluated) -> Evaluated:
        """With the most probable d33 at these noise levels; needs no further prediction."""
        information, gradient = self.posterior_equations(at)
        index = self._d33
        step = np.clip(gradient[:, index] / information[:, index, index], -_LARGEST_STEP, _LARGEST_STEP)
        return self.update_noise_levels(self.weighed(*self._scaled(at.points, at.products, np.exp(step))), 2)

    @cached_property
    def _d33(self) -> int:
        """Index of the parameter that the prediction is proportional to."""
        return [parameter.proportional for parameter in self.model.parameters].index(True)

    def improve(self, start: Points, cost_to_beat: CostToBeat | None = None, near_cost: float = np.inf) -> Evaluated:
        """The most probable points near the starts; only roughly where they will not reach `cost_to_beat`.

        Curves are not fitted where no start's tangent promises that; tangents count if a start is below `near_cost`.
        """
        if not self.lines.curves:
            return self.update_noise_levels(
                self.descend(self.update_noise_levels(self.evaluate(start), 3), 1, cost_to_beat), 2
            )
        from_starts = self.update_noise_levels(self.evaluate(start), _CURVE_SETTLING)
        is_near = from_starts.cost.min() < near_cost
        if cost_to_beat is not None and is_near and not self._may_beat(from_starts, cost_to_beat):
            return from_starts
        initial = by_least_squares(self, start)
        lowest = from_starts.best if from_starts.cost.min() < initial.cost[0] else initial
        if cost_to_beat is not None and lowest.cost[0] > cost_to_beat(lowest)[0] + _MAY_GAIN:
            return lowest
        # The prior, or an error of the law, may lead elsewhere than least squares; and so may starts that are as low
        alike = from_starts[np.flatnonzero(from_starts.cost < lowest.cost[0] + _MARGIN)]
        ends = [self._descended(at) for at in (initial, *(alike[np.array([number])] for number in range(len(alike))))]
        return min(ends, key=lambda end: float(end.cost[0]))

    def _descended(self, at: Evaluated) -> Evaluated:
        """One point of curves after steps on the likelihood."""
        return self.update_noise_levels(self._between_samples(at).descend(at, 1), _CURVE_SETTLING)

    def _may_beat(self, at: Evaluated, cost_to_beat: CostToBeat) -> bool:
        """Whether some point may get below the cost, by twice what its tangent, a Gauss–Newton step, promises to gain:
        of 149 pairs of curves that were fitted anyway none of the 14 that gained was promised less."""
        *_, promised = self._step(at, np.full(len(at), _LEAST_DAMPING))
        return bool((at.cost - promised < cost_to_beat(at)).any())

    def _between_samples(self, at: Evaluated) -> Self:
        """With contact points confined to the interval between samples that they are in, where adhesion moves them."""
        assert isinstance(self.model, CurveModel)
        if not self.model.hidden_jumps:
            return self
        held = copy(self)
        held.low, held.high = between_samples(self.hypothesis, at.points.fit[0], self.low, self.high)
        return held

    def descend(self, best: Evaluated, settling: int, cost_to_beat: CostToBeat | None = None) -> Evaluated:
        """Steps of the mean parameters, each followed by `settling` steps of the covariance's.

        A point stops once the gradient promises no cost below `cost_to_beat`. As that leaves out gains by the noise
        levels, no point of curves, or of mechanisms with covariance parameters, is stopped.
        """
        if self.lines.curves or self.covariance_indices.size:
            cost_to_beat = None
        damping = np.full(len(best), _LEAST_DAMPING)
        moving = np.arange(len(best))
        for _ in range(_MOST_ITERATIONS):
            part = best.subset(moving)
            step, slope, promised = self._step(part, damping[moving])
            if cost_to_beat is not None:
                promising = part.cost - _PROMISED * promised - _MARGIN < cost_to_beat(best)[moving]
                moving, part, step, slope = moving[promising], part[promising], step[promising], slope[promising]
            resting = slope < _CONVERGED
            going = np.ones(len(part), dtype=bool)
            if resting.any():
                settled = self.update_noise_levels(part[resting], settling)
                going[resting] = part.cost[resting] - settled.cost >= _CONVERGED
                best = best.replaced(moving[resting], settled)
            stepping = ~resting
            if stepping.any():
                number = moving[stepping]
                after, damping[number], going[stepping] = self._after_step(
                    part[stepping], step[stepping], damping[number], settling
                )
                best = best.replaced(number, after)
            moving = moving[going]
            if not len(moving):
                break
        return best

    def _after_step(
        self, at: Evaluated, step: Floats, damping: Floats, settling: int
    ) -> tuple[Evaluated, Floats, Mask]:
        """The points after steps, where these gain; their damping; and which of them continue."""
        fit = np.clip(at.points.fit + step, self.low, self.high)
        tried = self.update_noise_levels(self.evaluate(replace(at.points, fit=fit)), settling)
        gained = at.cost - tried.cost
        better = gained > 0
        gaining = np.flatnonzero(better)
        after = at.replaced(gaining, tried.subset(gaining))
        stuck = ~better & ((damping > 1e4) | (np.abs(step).max(axis=1) < 1e-7))
        failed = ~better & ~stuck
        damping = np.where(better, np.maximum(damping / 10, 1e-6), damping)
        damping = np.where(failed, np.maximum(damping * 10, 1e-2), damping)
        idle = failed & (gained > -_CONVERGED) & (damping > 1)
        return after, damping, ~(stuck | idle | (better & (gained < _CONVERGED)))

    def _step(self, at: Evaluated, damping: Floats) -> tuple[Floats, Floats, Floats]:
        """Damped Gauss–Newton steps of the mean parameters within the bounds, limited in length, and the gains that the
        gradients promise for them and for the steps of full length."""
        information, gradient = self.posterior_equations(at)
        fit, low, high = at.points.fit, self.low, self.high
        free, every = np.broadcast_to(self.free, fit.shape), np.arange(fit.shape[1])
        diagonal = information[:, every, every]
        # Of curves, so that a parameter without effect does not take all of a step
        least = self._range**-2.0 if self.lines.curves else _LEAST_CURVATURE
        for _ in every:
            matrix = np.where(free[:, :, None] & free[:, None, :], information, 0.0)
            matrix[:, every, every] = np.where(free, diagonal * (1 + damping[:, None]) + least, 1.0)
            step = np.linalg.solve(matrix, np.where(free, gradient, 0.0)[..., None])[..., 0]
            scale = np.abs(step) / np.maximum(_LARGEST_STEP, 0.3 * (high - low))
            shortened = np.maximum(1.0, scale.max(axis=1))
            step /= shortened[:, None]
            leaving = free & (((fit <= low) & (step < 0)) | ((fit >= high) & (step > 0)))
            if not leaving.any():
                break
            free = free & ~leaving
        slope = (gradient * step).sum(axis=1)
        return step, slope, slope * shortened


def by_least_squares(fitter: Fitter, start: Points) -> Evaluated:
    """The best least-squares fit of one hypothesis of curves from these starts, with its noise levels.

    A small smooth error with a close fit and a large one with a loose fit may both be local maxima; both are tried.
    """
    fitting = LeastSquares(fitter.hypothesis)
    fits, costs = zip(*(fitting.fitted(fit) for fit in start.fit), strict=True)
    fit = fits[int(np.argmin(costs))]
    smooth = np.clip(_SMOOTH_STARTS, *_smooth_range(fitter))
    covariance = np.array([[GAIN_PRIOR.middle, 0.0, value] for value in smooth])
    both = start[np.zeros(len(smooth), dtype=np.intp)]
    at = fitter.update_noise_levels(
        fitter.evaluate(replace(both, fit=np.tile(fit, (len(smooth), 1)), covariance=covariance)), _SETTLING
    )
    return at.best


def _smooth_range(fitter: Fitter) -> tuple[float, float]:
    """Range of starting values of the log smooth error of curves."""
    smooth = fitter.hypothesis.smooth
    return smooth.low, max(smooth.high, DISCREPANCY.low)
