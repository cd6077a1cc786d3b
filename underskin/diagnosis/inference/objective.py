"""One hypothesis evaluated: the cost of a point, its derivatives, and its noise levels brought to rest.

What only enters the covariance (gain and position scatter, line level, and a mechanism's spread or pick-up) moves by
Newton steps on the likelihood of the prediction at hand, which costs no model evaluation.
"""

from dataclasses import dataclass, replace

import numpy as np

from underskin.diagnosis.inference.hypothesis import Hypothesis, Point, curvature_of_prior, own_parameters
from underskin.diagnosis.inference.likelihood import LogLikelihoods, Marginal, Moments
from underskin.diagnosis.noise.noise_levels import NoiseLevels, SeveralLevels
from underskin.mechanisms.models.composed import Prediction
from underskin.mechanisms.models.composition import SENSOR_SPREAD
from underskin.units import Floats

GAIN, POSITION = 0, 2  # places among the covariance's parameters, the latter where there is positioning scatter

_LARGEST_STEP = 0.7  # of a Newton step in a noise level's logarithm: a factor of 2
_STEP = 0.05  # of the finite differences in the covariance's logarithms
_FREE_SPREAD = 0.02  # above this sd, e^b is linearised where b is, not at 0
_BENDINGS, _BENT, _LARGEST_BEND = 6, 3e-3, 2.0  # rounds at most, change that ends them, and bounds of b


@dataclass(frozen=True)
class Evaluated:
    """A point with what was worked out there; `cost` is minus the log posterior density (up to what all share).

    `growth` of the position's slopes, once a fit has needed it, near there.
    """

    point: Point
    prediction: Prediction
    moments: Moments
    marginal: Marginal
    cost: float
    growth: Floats | None = None

    @property
    def pickup_variance(self) -> Floats:
        """Of real and of imaginary part of each row, at the point's own levels [(C/N)²]."""
        return replace(self.prediction, pickup=self.marginal.levels.pickup).pickup_variance


class Evaluator:
    """Evaluates points of one hypothesis, and settles their noise levels."""

    def __init__(self, hypothesis: Hypothesis, held: int | None = None) -> None:
        """Prepare the names and bounds; the parameter at `held` is fixed where a point has it, and has no prior."""
        self.hypothesis = hypothesis
        self.parameters = hypothesis.model.parameters
        self.places = [place for place in hypothesis.mean_places if place != held]
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
        self._own = [index for index, entry in enumerate(self.parameters) if entry.moves_covariance]
        self._common = len(self.covariance) - len(self._own)
        acts_on = [entry.acts_on for entry in self.parameters]
        self._spread = acts_on.index("gain_spread") if "gain_spread" in acts_on else None
        self.nuisances = len(self.parameters) - own_parameters(hypothesis)
        sensors = int(hypothesis.lines.sensor.max()) + 1
        self.no_bend = np.zeros(sensors)

    def evaluate(self, point: Point, prediction: Prediction | None = None) -> Evaluated:
        """Predict, where that was not done already, and weigh."""
        hypothesis = self.hypothesis
        prediction = prediction or hypothesis.model.predict(point.fit)
        position = float(np.exp(point.covariance[POSITION])) if hypothesis.placed else 0.0
        lines = hypothesis.lines
        for _ in range(_BENDINGS):
            ratio = self._smooth(point) / float(np.exp(point.covariance[1]))
            moments = Moments(lines, prediction, point.bend[lines.sensor], hypothesis.curvature, position, ratio)
            at = self._weigh(point, prediction, moments)
            if self.levels(point).spread < _FREE_SPREAD:
                break
            bend = np.clip(at.marginal.sensor_gains, -_LARGEST_BEND, _LARGEST_BEND)
            if np.abs(bend - point.bend).max() < _BENT:
                break
            point = replace(point, bend=bend)
        return at

    def _weigh(self, point: Point, prediction: Prediction, moments: Moments) -> Evaluated:
        lines, levels = self.hypothesis.lines, self.levels(point)
        if lines.curves and levels.smooth != moments.ratio * levels.level:
            moments = moments.at_ratio(levels.smooth / levels.level)
        marginal = Marginal(lines, moments, levels)
        cost = -marginal.log_likelihood - self._log_prior(point)
        return Evaluated(point, prediction, moments, marginal, cost)

    def levels(self, point: Point) -> NoiseLevels:
        """The noise levels at a point."""
        gain, level, *_ = np.exp(point.covariance).tolist()
        position, spread, pickup = self._own_levels(point.covariance)
        return NoiseLevels(gain, level, float(position), float(spread), pickup, self._smooth(point))

    def _own_levels(self, covariance: Floats) -> tuple[Floats | float, Floats | float, Floats | None]:
        """p, τ and the pick-up (…, picked rows) that covariance parameters (…, parameters) hold."""
        position: Floats | float = np.exp(covariance[..., POSITION]) if self.hypothesis.placed else 0.0
        spread: Floats | float = SENSOR_SPREAD
        values = {}
        for place, column in zip(self._own, range(self._common, len(self.covariance)), strict=True):
            if place == self._spread:
                spread = np.exp(covariance[..., column])
            else:
                values[self.parameters[place].name] = np.exp(covariance[..., [column]])
        pickup = self.hypothesis.model.pickup
        return position, spread, None if pickup is None else pickup.deviation(values)

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

    def posterior_equations(self, at: Evaluated) -> tuple[Floats, Floats]:
        """Information and gradient of the log posterior in the mean parameters."""
        information, gradient = at.marginal.normal_equations(at.growth)
        places = self.places
        information, gradient = information[np.ix_(places, places)], gradient[places]
        precision, centre = self._priors[places].T
        return information + np.diag(precision), gradient - precision * (at.point.fit[places] - centre)

    def settle(self, at: Evaluated, steps: int, held: int | None = None) -> Evaluated:
        """Newton steps of the covariance parameters, one of which may be held, at a fixed prediction.

        Several of a mechanism's own hang together, so that steps of one at a time would creep.
        """
        for _ in range(steps):
            gradient, hessian = self.covariance_equations(at, mixed=len(self._own) > 1)
            if held is not None:
                hessian[held, :] = hessian[:, held] = gradient[held] = 0.0
            low, high = self._lowest, self._highest
            eigenvalues, vectors = np.linalg.eigh(hessian)
            step = -vectors @ ((vectors.T @ gradient) / np.maximum(np.abs(eigenvalues), 1.0))
            outwards = ((at.point.covariance <= low) & (step < 0)) | ((at.point.covariance >= high) & (step > 0))
            step = np.where(outwards, 0.0, step)
            step *= min(1.0, _LARGEST_STEP / max(np.abs(step).max(), 1e-12))
            for _ in range(4):
                point = self.moved(at.point, np.clip(at.point.covariance + step, low, high))
                tried = self._weigh(point, at.prediction, at.moments)
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
        same = at.marginal.levels.position == at.moments.position
        return at if same else self.weighed_anew(at.point, at)

    def weighed_anew(self, point: Point, at: Evaluated) -> Evaluated:
        """A point with the prediction of another, whose moments are summed at the point's own scatter."""
        lines, curvature = self.hypothesis.lines, self.hypothesis.curvature
        position = self.levels(point).position
        moments = Moments(lines, at.prediction, point.bend[lines.sensor], curvature, position)
        return self._weigh(point, at.prediction, moments)

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
        costs = self.costs(at, centre + np.array([np.zeros(count), *steps, *-steps, *both, *(-step for step in both)]))
        middle, up, down = costs[0], costs[1 : count + 1], costs[count + 1 : 2 * count + 1]
        alone = up + down - 2 * middle
        together = costs[2 * count + 1 :].reshape(2, -1).sum(axis=0) - 2 * middle
        gradient = (up - down) / (2 * _STEP)
        hessian = np.diag(alone / _STEP**2)
        for (a, b), both_ways in zip(pairs, together, strict=True):
            hessian[a, b] = hessian[b, a] = (both_ways - alone[a] - alone[b]) / (2 * _STEP**2)
        return gradient + hessian @ (here - centre), hessian

    def costs(self, at: Evaluated, covariances: Floats) -> Floats:
        """The costs with other covariance parameters (K, parameters) at the same prediction."""
        if self.hypothesis.lines.curves:  # each of which weighs its rows anew
            points = [self.moved(at.point, covariance) for covariance in covariances]
            return np.array([self._weigh(point, at.prediction, at.moments).cost for point in points])
        gain, level = np.exp(covariances[:, :2]).T[..., None]
        position, spread, pickup = self._own_levels(covariances)
        position, spread = (value if isinstance(value, float) else value[:, None] for value in (position, spread))
        likelihoods = LogLikelihoods(
            self.hypothesis.lines, at.moments, SeveralLevels(gain, level, position, spread, pickup)
        ).each
        prior = np.zeros(len(covariances))
        for entry, column in zip(self.covariance, covariances.T.tolist(), strict=True):
            density = {value: entry.log_density(value) for value in set(column)}
            prior += [density[value] for value in column]
        return -likelihoods - prior - self._log_mean_prior(at.point)
