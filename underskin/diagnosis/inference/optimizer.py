"""Points of hypotheses begun and improved, all at once: damped Gauss–Newton steps within the bounds.

Every step of the mean parameters is followed by steps of the noise levels, which cost no prediction. Each point has its
own damping, and rests once it has converged, while the others go on.
"""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import Self

import numpy as np

from underskin.diagnosis.inference.curve_starts import between_samples, by_least_squares
from underskin.diagnosis.inference.frf_products import FrfProducts
from underskin.diagnosis.inference.hypothesis import FitPoint, own_places
from underskin.diagnosis.inference.objective import Evaluator
from underskin.diagnosis.inference.points import Evaluated, Points
from underskin.diagnosis.inference.products import Products, joined
from underskin.diagnosis.noise.noise_priors import GAIN_PRIOR, POSITION_PRIOR, START_GAIN
from underskin.units import Floats, Indices, Mask

__all__ = ["Evaluated", "Fitter"]

_CURVE_SETTLING = 8
_PROMISED, _MARGIN = 10.0, 2.0  # times what the gradient says, and nats beyond, that a fit may still gain
_SLOPE_STEP = 1e-4  # of a parameter's range, for differences of the position's slopes
_LARGEST_STEP = 1.0
_CONVERGED = 0.01  # in log posterior
_MOST_ITERATIONS = 25
_LEAST_CURVATURE = 1e-10
_MAY_GAIN = 60.0  # nats that a fit of curves may still gain beyond the least-squares one's
_POSITION_STARTS = (0.07e-3, 0.14e-3, 0.28e-3)  # [m]


Target = Callable[[Evaluated], Floats]  # costs (points,) that points must get below to be of any use


class Fitter(Evaluator):
    """Begins and improves points of hypotheses."""

    def _start(self, own: Sequence[Floats], parents: Sequence[FitPoint | None]) -> Points:
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
        points = self._start(own, parents or [None] * len(own))
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

    @cached_property
    def _moves_place(self) -> Mask:
        """Which parameters of each hypothesis may change how σ depends on the contact's place (hypotheses, parameters),
        relative to σ: not d33, nor those of the dynamics."""
        moves = np.zeros(self.low.shape, dtype=bool)
        for number, hypothesis in enumerate(self.hypotheses):
            moves[number, : self.counts[number]] = [not entry.proportional for entry in hypothesis.model.parameters]
            for name, own in own_places(hypothesis.model.names, self.lines).items():
                moves[number, own] &= not self.lines.mechanisms[name].needs_lines
        return moves

    def improve(self, start: Points, target: Target | None = None) -> Evaluated:
        """The most probable points near the starts; only roughly where their targets will not be reached."""
        if not self.lines.curves:
            return self.settle(self.descend(self.settle(self.evaluate(start), 3), 1, target), 2)
        begun = by_least_squares(self, start)
        if target is not None and begun.cost[0] > target(begun)[0] + _MAY_GAIN:
            return begun
        return self.settle(self._between_samples(begun).descend(begun, 1), _CURVE_SETTLING)

    def _between_samples(self, at: Evaluated) -> Self:
        """Of what sticks, with contact points held between the samples where they are at one point."""
        (hypothesis,) = self.hypotheses
        if not any(self.lines.mechanisms[name].moves_contact_points for name in hypothesis.model.names):
            return self
        held = copy(self)
        held.low, held.high = (
            bound[None] for bound in between_samples(hypothesis, at.points.fit[0], self.low[0], self.high[0])
        )
        return held

    def descend(self, best: Evaluated, settling: int, target: Target | None = None) -> Evaluated:
        """Steps of the mean parameters, each followed by so many of the covariance's.

        A point goes no further once it promises no cost below its target. What the gradient promises leaves out what
        the noise levels may gain: where these are a curve's, or a mechanism's own, no point is left.
        """
        if self.lines.curves or self.own.size:
            target = None
        damping = np.full(len(best), 1e-3)
        moving = np.arange(len(best))
        for _ in range(_MOST_ITERATIONS):
            part = best.some(moving)
            step, slope = self._step(part, damping[moving])
            if target is not None:
                promising = part.cost - _PROMISED * slope - _MARGIN < target(best)[moving]
                moving, part, step, slope = moving[promising], part[promising], step[promising], slope[promising]
            resting = (slope < _CONVERGED) & self.grown(part)
            going = np.ones(len(part), dtype=bool)
            if resting.any():
                settled = self.settle(part[resting], settling)
                going[resting] = part.cost[resting] - settled.cost >= _CONVERGED
                best = self.replaced(best, moving[resting], settled)
            stepping = ~resting
            if stepping.any():
                number = moving[stepping]
                after, damping[number], going[stepping] = self._moved_on(
                    part[stepping], step[stepping], damping[number], settling
                )
                best = self.replaced(best, number, after)
            moving = moving[going]
            if not len(moving):
                break
        return best

    def _moved_on(self, at: Evaluated, step: Floats, damping: Floats, settling: int) -> tuple[Evaluated, Floats, Mask]:
        """The points after steps, where these gain; their damping; and which of them are to go on.

        A point that gains nothing learns first how the position's slopes change, then tries shorter steps.
        """
        owner = at.points.owner
        fit = np.clip(at.points.fit + step, self.low[owner], self.high[owner])
        tried = self.settle(self.evaluate(replace(at.points, fit=fit)), settling)
        gained = at.cost - tried.cost
        better = gained > 0
        after = self.replaced(at, np.flatnonzero(better), replace(tried, growth=at.growth)[better])
        stuck = ~better & ((damping > 1e4) | (np.abs(step).max(axis=1) < 1e-7))
        blind = np.flatnonzero(~better & ~stuck & ~self.grown(at))
        if len(blind):
            after = self.replaced(after, blind, self.with_growth(at[blind]))
        failed = ~better & ~stuck
        failed[blind] = False
        damping = np.where(better, np.maximum(damping / 10, 1e-6), damping)
        damping = np.where(failed, np.maximum(damping * 10, 1e-2), damping)
        idle = failed & (gained > -_CONVERGED) & (damping > 1)
        return after, damping, ~(stuck | idle | (better & (gained < _CONVERGED)))

    def grown(self, at: Evaluated) -> Mask:
        """Which points know how the position's slopes change, or have no use for it."""
        if not self.placed:
            return np.ones(len(at), dtype=bool)
        if at.growth is None:
            return np.zeros(len(at), dtype=bool)
        return np.asarray(np.isfinite(at.growth).all(axis=(1, 2)))

    def replaced(self, at: Evaluated, where: Indices, other: Evaluated) -> Evaluated:
        """With other points in the place of some, which are in rising order."""
        if not len(where):
            return at
        if len(where) == len(at) and (at.growth is None or other.growth is not None):
            return other
        order = np.arange(len(at))
        order[where] = len(at) + np.arange(len(other))

        def of(one: Floats, two: Floats) -> Floats:
            return np.concatenate([one, two])[order]

        one, two = at.points, other.points
        points = Points(
            np.concatenate([one.owner, two.owner])[order],
            of(one.fit, two.fit),
            of(one.covariance, two.covariance),
            of(one.bend, two.bend),
        )
        growth = None
        if at.growth is not None or other.growth is not None:
            unknown = np.full((1, self.lines.recordings, max(self.counts)), np.nan)
            growth = of(
                *(np.repeat(unknown, len(one), axis=0) if one.growth is None else one.growth for one in (at, other))
            )
        products = joined([at.products, other.products], max(self.counts))[order]
        return Evaluated(points, products, of(at.cost, other.cost), growth)

    def with_growth(self, at: Evaluated) -> Evaluated:
        """With ∂ log |t|²/∂θ (points, recordings, parameters) of the position's slopes t, by differences."""
        count = max(self.counts)
        owner = at.points.owner
        step = _SLOPE_STEP * (self.high - self.low)[owner]
        step = np.where(at.points.fit + step <= self.high[owner], step, -step)
        number, place = np.nonzero(self.free[owner] & self._moves_place[owner])
        moved = at.points[number]
        fit = moved.fit.copy()
        fit[np.arange(len(fit)), place] += step[number, place]
        here, there = (_log_size(self.place_slopes(points)) for points in (at.points, replace(moved, fit=fit)))
        growth = np.zeros((len(at), here.shape[1], count))
        growth[np.arange(len(at)), :, self._d33[owner]] = 2.0  # the response is proportional to d33
        growth[number, :, place] = (there - here[number]) / step[number, place][:, None]
        return replace(at, growth=growth)

    def _step(self, at: Evaluated, damping: Floats) -> tuple[Floats, Floats]:
        """Damped Gauss–Newton steps of the mean parameters within the bounds, and what the gradients say they gain."""
        information, gradient = self.posterior_equations(at)
        owner, fit = at.points.owner, at.points.fit
        low, high = self.low[owner], self.high[owner]
        free, every = self.free[owner], np.arange(fit.shape[1])
        diagonal = information[:, every, every]
        # Of curves, lest what changes nothing (the share of a second relaxation that is none) takes all of a step
        least = self._range[owner] ** -2.0 if self.lines.curves else np.full(fit.shape, _LEAST_CURVATURE)
        for _ in every:
            matrix = np.where(free[:, :, None] & free[:, None, :], information, 0.0)
            matrix[:, every, every] = np.where(free, diagonal * (1 + damping[:, None]) + least, 1.0)
            step = np.linalg.solve(matrix, np.where(free, gradient, 0.0)[..., None])[..., 0]
            scale = np.abs(step) / np.maximum(_LARGEST_STEP, 0.3 * (high - low))
            step /= np.maximum(1.0, scale.max(axis=1))[:, None]
            leaving = free & (((fit <= low) & (step < 0)) | ((fit >= high) & (step > 0)))
            if not leaving.any():
                break
            free = free & ~leaving
        return step, (gradient * step).sum(axis=1)


def _log_size(slopes: Floats) -> Floats:
    """log |t|² (points, recordings) of the position's slopes (2, points, recordings); least where there are none."""
    return np.log((slopes**2).sum(axis=0) + 1e-300)
