"""Points of hypotheses improved, all at once: damped Gauss–Newton steps within the bounds.

Every step of the mean parameters is followed by steps of the noise levels, which cost no prediction. Each point has its
own damping, and rests once it has converged, while the others go on.
"""

from collections.abc import Callable
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import Self

import numpy as np

from underskin.diagnosis.inference.beginnings import BeginningEvaluator
from underskin.diagnosis.inference.curve_starts import between_samples, by_least_squares
from underskin.diagnosis.inference.hypothesis import own_places
from underskin.diagnosis.inference.points import Evaluated, Points
from underskin.diagnosis.inference.products import joined
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


Target = Callable[[Evaluated], Floats]  # costs (points,) that points must get below to be of any use


class Fitter(BeginningEvaluator):
    """Begins and improves points of hypotheses."""

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
        as_they_are = self.settle(self.evaluate(start), _CURVE_SETTLING)
        if as_they_are.cost.min() < begun.cost[0]:
            begun = as_they_are[as_they_are.best()]
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
