"""The most probable parameters of one hypothesis, by Gauss–Newton steps with a trust region.

Mean parameters move by the model's derivatives; what only enters the covariance (gain and position scatter, line level,
and a mechanism's spread or pick-up) by Newton steps on the likelihood of the prediction at hand, which costs no model
evaluation. Fisher's information between the two groups is zero for a normal likelihood, so they are taken in turns.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from underskin.diagnosis.hypothesis import (
    COVARIANCE_NAMES,
    Hypothesis,
    Point,
    curvature_of_prior,
    is_scale,
    moves_covariance,
    own_parameters,
)
from underskin.diagnosis.likelihood import LogLikelihoods, Marginal, Moments, NoiseLevels, SeveralLevels
from underskin.diagnosis.scatter import GAIN_PRIOR, POSITION_PRIOR
from underskin.mechanisms.composition import SENSOR_SPREAD
from underskin.mechanisms.model import Prediction
from underskin.units import Floats

_CURVE_SETTLING = 8
_STEP = 0.05  # of the finite differences in the covariance's logarithms
_SLOPE_STEP = 1e-4  # of a parameter's range, for differences of the position's slopes
_LARGEST_STEP = 1.0
_CONVERGED = 0.01  # in log posterior
_MOST_ITERATIONS = 25
_FREE_SPREAD = 0.02  # above this sd, e^b is linearised where b is, not at 0
_BENDINGS, _BENT, _LARGEST_BEND = 6, 3e-3, 2.0  # rounds at most, change that ends them, and bounds of b


@dataclass(frozen=True)
class Evaluated:
    """A point with what was worked out there; `cost` is minus the log posterior density (up to what all share).

    `growth` of the position's slopes, once a fit has needed it, near there.
    """

    point: Point
    predicted_at: Floats
    prediction: Prediction
    moments: Moments
    marginal: Marginal
    cost: float
    growth: Floats | None = None


class Fitter:
    """Evaluates and improves points of one hypothesis."""

    def __init__(self, hypothesis: Hypothesis) -> None:
        """Prepare the names and bounds."""
        self.hypothesis = hypothesis
        self.parameters = hypothesis.model.parameters
        self.places = hypothesis.mean_places
        self.covariance = hypothesis.covariance
        bounds = np.array([entry.bounds for entry in self.parameters]).reshape(-1, 2)
        self.low, self.high = bounds.T
        self._lowest = np.array([entry.low for entry in self.covariance])
        self._highest = np.array([entry.high for entry in self.covariance])
        self._priors = np.array([curvature_of_prior(entry) for entry in self.parameters])
        own = [self.parameters[place] for place in self.places]
        at_start = np.array([entry.start for entry in own]) - self._priors[self.places, 1]
        densities = sum(entry.log_prior(entry.start) for entry in own)
        self._log_prior_height = densities + 0.5 * float(self._priors[self.places, 0] @ at_start**2)
        self._own = [index for index, entry in enumerate(self.parameters) if moves_covariance(entry)]
        self._common = len(self.covariance) - len(self._own)
        names = [entry.name for entry in self.parameters]
        self._spread, self._pickup = (names.index(name) if name in names else None for name in COVARIANCE_NAMES)
        self.nuisances = len(names) - own_parameters(hypothesis)
        sensors = int(hypothesis.lines.sensor.max()) + 1
        self.no_bend = np.zeros(sensors)

    def holds(self, point: Point) -> bool:
        """Whether a point has this hypothesis' covariance parameters."""
        return len(point.covariance) == len(self.covariance)

    def _uncentred(self, own: Sequence[float] | Floats, parent: Point | None) -> Point:
        """A point with these coordinates of the mechanisms, and the nuisances of a parent or at their centre."""
        fit = np.array([entry.start for entry in self.parameters])
        fit[: len(own)] = own
        if parent is not None:
            fit[len(own) :] = parent.fit[len(parent.fit) - len(fit) + len(own) :]
        covariance = [GAIN_PRIOR.middle, 0.0]
        if self.hypothesis.placed:
            covariance.append(POSITION_PRIOR.middle)
        if self.hypothesis.lines.curves:
            covariance.append(self.hypothesis.smooth.middle)
        return Point(fit, np.array([*covariance, *fit[self._own]]), self.no_bend)

    def start(
        self, own: Sequence[float] | Floats, parent: Point | None = None, prediction: Prediction | None = None
    ) -> Point:
        """A point with these coordinates of the mechanisms, E and h of a parent or their centre, d33 as data say."""
        point = self._uncentred(own, parent)
        fit = point.fit
        place = next((index for index, entry in enumerate(self.parameters) if is_scale(entry)), None)
        if place is not None:
            lines = self.hypothesis.lines
            value = (prediction or self.hypothesis.model.predict(fit)).value
            weight = 1 / (lines.deviation**2 + (0.03 * np.abs(value)) ** 2)
            ratio = np.sum(weight * (value.conj() * lines.value).real) / np.sum(weight * np.abs(value) ** 2)
            if ratio > 0:
                fit[place] = np.clip(fit[place] + np.log(ratio), self.low[place], self.high[place])
        return point

    def begin(self, own: Sequence[float] | Floats, parent: Point | None = None) -> Evaluated:
        """The start of these coordinates, evaluated with a single prediction where d33 only scales it."""
        prediction = self.hypothesis.model.predict(self._uncentred(own, parent).fit)
        point = self.start(own, parent, prediction)
        names = [entry.name for entry in self.parameters]
        if "d33" not in names:
            return self.evaluate(point)
        factor = float(np.exp(point.fit[names.index("d33")] - self._uncentred(own, parent).fit[names.index("d33")]))
        slopes = prediction.position_slopes
        scaled = replace(
            prediction,
            value=factor * prediction.value,
            slopes=factor * prediction.slopes,
            position_slopes=None if slopes is None else factor * slopes,
        )
        return self.evaluate(point, scaled)

    def evaluate(self, point: Point, prediction: Prediction | None = None) -> Evaluated:
        """Predict, where that was not done already, and weigh."""
        hypothesis = self.hypothesis
        prediction = prediction or hypothesis.model.predict(point.fit)
        position = float(np.exp(point.covariance[2])) if hypothesis.placed else 0.0
        lines = hypothesis.lines
        for _ in range(_BENDINGS):
            ratio = self._smooth(point) / float(np.exp(point.covariance[1]))
            moments = Moments(lines, prediction, point.bend[lines.sensor], hypothesis.curvature, position, ratio)
            at = self._weigh(point, point.fit, prediction, moments)
            if self.levels(point, point.fit).spread < _FREE_SPREAD:
                break
            bend = np.clip(at.marginal.sensor_gains, -_LARGEST_BEND, _LARGEST_BEND)
            if np.abs(bend - point.bend).max() < _BENT:
                break
            point = replace(point, bend=bend)
        return at

    def _weigh(self, point: Point, predicted_at: Floats, prediction: Prediction, moments: Moments) -> Evaluated:
        lines, levels = self.hypothesis.lines, self.levels(point, predicted_at)
        if lines.curves and levels.smooth != moments.ratio * levels.level:
            moments = moments.at_ratio(levels.smooth / levels.level)
        marginal = Marginal(lines, moments, levels)
        cost = -marginal.log_likelihood - self._log_prior(point)
        return Evaluated(point, predicted_at, prediction, moments, marginal, cost)

    def levels(self, point: Point, predicted_at: Floats) -> NoiseLevels:
        """The noise levels at a point, for a prediction made at other coordinates of the covariance."""
        gain, level, *_ = np.exp(point.covariance).tolist()
        own = self._own_levels(point.covariance, predicted_at)
        position, spread, pickup = (float(value) for value in own)
        return NoiseLevels(gain, level, position, spread, pickup, self._smooth(point))

    def _own_levels(self, covariance: Floats, predicted_at: Floats) -> tuple[Floats | float, ...]:
        """p, τ and the pick-up over the prediction's, where covariance parameters (…, parameters) hold them."""
        position: Floats | float = np.exp(covariance[..., 2]) if self.hypothesis.placed else 0.0
        spread: Floats | float = SENSOR_SPREAD
        pickup: Floats | float = 1.0
        for place, column in zip(self._own, range(self._common, len(self.covariance)), strict=True):
            if place == self._spread:
                spread = np.exp(covariance[..., column])
            else:
                pickup = np.exp(covariance[..., column] - predicted_at[place])
        return position, spread, pickup

    def _smooth(self, point: Point) -> float:
        """η, which follows the two that all recordings have."""
        return float(np.exp(point.covariance[2])) if self.hypothesis.lines.curves else 0.0

    def _with_own(self, fit: Floats, covariance: Floats) -> Floats:
        if not self._own:
            return fit
        whole = fit.copy()
        whole[self._own] = covariance[self._common :]
        return whole

    def _log_prior(self, point: Point) -> float:
        return self._log_mean_prior(point) + sum(
            entry.log_density(value) for entry, value in zip(self.covariance, point.covariance.tolist(), strict=True)
        )

    def _log_mean_prior(self, point: Point) -> float:
        """Of the parameters that move the mean."""
        places = self.places
        fit = point.fit[places]
        if (fit < self.low[places]).any() or (fit > self.high[places]).any():
            return -np.inf
        precision, centre = self._priors[places].T
        return self._log_prior_height - 0.5 * float(precision @ (fit - centre) ** 2)

    def improve(self, start: Point, iterations: int = _MOST_ITERATIONS) -> Evaluated:
        """The most probable point near the start."""
        if not self.hypothesis.lines.curves:
            return self.settle(self._descend(self.settle(self.evaluate(start), 3), iterations, 1), 2)
        # Small smooth error and close fit, or large and loose: each may be a maximum of its own.
        found = []
        for smooth in (self.hypothesis.smooth.low, self.hypothesis.smooth.middle):
            begin = replace(start, covariance=np.array([GAIN_PRIOR.middle, 0.0, smooth]))
            fitted = self.settle(self._descend(self.evaluate(begin), iterations, 0), _CURVE_SETTLING)
            found.append(self.settle(self._descend(fitted, iterations, 1), _CURVE_SETTLING))
        return min(found, key=lambda at: at.cost)

    def _descend(self, best: Evaluated, iterations: int, settling: int) -> Evaluated:
        """Steps of the mean parameters, each followed by so many of the covariance's."""
        damping = 1e-3
        for _ in range(iterations):
            step, slope = self._step(best, damping)
            if slope < _CONVERGED and (best.growth is not None or not self.hypothesis.placed):
                settled = replace(self.settle(best, settling), growth=best.growth)
                if best.cost - settled.cost < _CONVERGED:
                    return settled
                best = settled
                continue
            moved = replace(best.point, fit=np.clip(best.point.fit + step, self.low, self.high))
            tried = self.settle(self.evaluate(moved), settling)
            gained = best.cost - tried.cost
            if gained > 0:
                best = replace(tried, growth=best.growth)
                damping = max(damping / 10, 1e-6)
                if gained < _CONVERGED:
                    break
            elif damping > 1e4 or np.abs(step).max() < 1e-7:
                break
            elif self.hypothesis.placed and best.growth is None:
                best = self.with_growth(best)
            else:
                damping = max(damping * 10, 1e-2)
                if gained > -_CONVERGED and damping > 1:
                    break
        return best

    def with_growth(self, at: Evaluated) -> Evaluated:
        """With ∂ log |t|²/∂θ (recordings, parameters) of the position's slopes t, by differences."""
        slopes = at.moments.log_slopes
        found = np.zeros((len(slopes), len(self.parameters)))
        for place in self.places:
            step = _SLOPE_STEP * (self.high[place] - self.low[place])
            moved = at.point.fit.copy()
            moved[place] += step if moved[place] + step <= self.high[place] else -step
            found[:, place] = (self.evaluate(replace(at.point, fit=moved)).moments.log_slopes - slopes) / (
                moved[place] - at.point.fit[place]
            )
        return replace(at, growth=found)

    def _step(self, at: Evaluated, damping: float) -> tuple[Floats, float]:
        """A Gauss–Newton step of the mean parameters, damped, within the bounds, and what the gradient says it gains."""
        information, gradient = self.posterior_equations(at)
        places = np.array(self.places)
        fit = at.point.fit[places]
        low, high = self.low[places], self.high[places]
        free = np.ones(len(places), dtype=bool)
        step = np.zeros(len(fit))
        for _ in range(len(places)):
            matrix = information[np.ix_(free, free)]
            matrix = matrix + damping * np.diag(np.diag(matrix)) + 1e-10 * np.eye(len(matrix))
            step[:] = 0.0
            step[free] = np.linalg.solve(matrix, gradient[free])
            scale = np.abs(step) / np.maximum(_LARGEST_STEP, 0.3 * (high - low))
            step /= max(1.0, scale.max())
            leaving = free & (((fit <= low) & (step < 0)) | ((fit >= high) & (step > 0)))
            if not leaving.any():
                break
            free &= ~leaving
            if not free.any():
                step[:] = 0.0
                break
        whole = np.zeros(len(self.parameters))
        whole[places] = step
        return whole, float(gradient @ step)

    def posterior_equations(self, at: Evaluated) -> tuple[Floats, Floats]:
        """Information and gradient of the log posterior in the mean parameters."""
        information, gradient = at.marginal.normal_equations(at.growth)
        places = self.places
        information, gradient = information[np.ix_(places, places)], gradient[places]
        precision, centre = self._priors[places].T
        return information + np.diag(precision), gradient - precision * (at.point.fit[places] - centre)

    def settle(self, at: Evaluated, steps: int) -> Evaluated:
        """Newton steps of the covariance parameters at a fixed prediction."""
        for _ in range(steps):
            gradient, hessian = self.covariance_equations(at, mixed=False)
            low, high = self._lowest, self._highest
            eigenvalues, vectors = np.linalg.eigh(hessian)
            step = -vectors @ ((vectors.T @ gradient) / np.maximum(np.abs(eigenvalues), 1.0))
            outwards = ((at.point.covariance <= low) & (step < 0)) | ((at.point.covariance >= high) & (step > 0))
            step = np.where(outwards, 0.0, step)
            step *= min(1.0, 0.7 / max(np.abs(step).max(), 1e-12))
            for _ in range(4):
                point = self.moved(at.point, np.clip(at.point.covariance + step, low, high))
                tried = self._weigh(point, at.predicted_at, at.prediction, at.moments)
                if tried.cost < at.cost:
                    break
                step = step / 4
            else:
                break
            gained, at = at.cost - tried.cost, tried
            if gained < 1e-3:
                break
        return self._summed_again(at)

    def _summed_again(self, at: Evaluated) -> Evaluated:
        """With the moments of the same prediction at the positioning scatter that the point has come to."""
        lines, position = self.hypothesis.lines, at.marginal.levels.position
        if position == at.moments.position:
            return at
        bend = at.point.bend[lines.sensor]
        moments = Moments(lines, at.prediction, bend, self.hypothesis.curvature, position)
        return self._weigh(at.point, at.predicted_at, at.prediction, moments)

    def moved(self, point: Point, covariance: Floats) -> Point:
        """The point with other covariance parameters, a mechanism's own among the coordinates of the fit."""
        return replace(point, covariance=covariance, fit=self._with_own(point.fit, covariance))

    def covariance_equations(self, at: Evaluated, *, mixed: bool = True) -> tuple[Floats, Floats]:
        """Gradient and Hessian of the cost in the covariance parameters, by differences; the mixed terms on request."""
        here = at.point.covariance
        count = len(here)
        steps = _STEP * np.eye(count)
        # Far enough inside the bounds for the differences
        centre = np.clip(here, self._lowest + 2 * _STEP, self._highest - 2 * _STEP)
        pairs = [(a, b) for a in range(count) for b in range(a if mixed else 0)]
        both = [steps[a] + steps[b] for a, b in pairs]
        costs = self._costs(at, centre + np.array([np.zeros(count), *steps, *-steps, *both]))
        middle, up, down = costs[0], costs[1 : count + 1], costs[count + 1 : 2 * count + 1]
        gradient = (up - down) / (2 * _STEP)
        hessian = np.diag((up + down - 2 * middle) / _STEP**2)
        for (a, b), cost in zip(pairs, costs[2 * count + 1 :], strict=True):
            hessian[a, b] = hessian[b, a] = (cost - up[a] - up[b] + middle) / _STEP**2
        return gradient + hessian @ (here - centre), hessian

    def _costs(self, at: Evaluated, covariances: Floats) -> Floats:
        """The costs with other covariance parameters (K, parameters) at the same prediction."""
        if self.hypothesis.lines.curves:  # each of which weighs its rows anew
            points = [self.moved(at.point, covariance) for covariance in covariances]
            return np.array([self._weigh(point, at.predicted_at, at.prediction, at.moments).cost for point in points])
        columns = np.exp(covariances[:, :2]).T[..., None]
        own = [
            value if isinstance(value, float) else value[:, None]
            for value in self._own_levels(covariances, at.predicted_at)
        ]
        likelihoods = LogLikelihoods(self.hypothesis.lines, at.moments, SeveralLevels(*columns, *own)).each
        prior = np.zeros(len(covariances))
        for entry, column in zip(self.covariance, covariances.T.tolist(), strict=True):
            density = {value: entry.log_density(value) for value in set(column)}
            prior += [density[value] for value in column]
        return -likelihoods - prior - self._log_mean_prior(at.point)
