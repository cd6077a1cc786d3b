"""The most probable parameters of one hypothesis, by Gauss–Newton steps with a trust region.

Mean parameters move by the model's derivatives; what only enters the covariance is settled in between. Fisher's
information between the two groups is zero for a normal likelihood, so they are taken in turns.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from underskin.diagnosis.inference.hypothesis import FitPoint
from underskin.diagnosis.inference.objective import Evaluated, Evaluator
from underskin.diagnosis.noise.noise_priors import GAIN_PRIOR, POSITION_PRIOR
from underskin.mechanisms.models.composed import Prediction
from underskin.units import Floats

__all__ = ["Evaluated", "Fitter"]

_CURVE_SETTLING = 8
_SLOPE_STEP = 1e-4  # of a parameter's range, for differences of the position's slopes
_LARGEST_STEP = 1.0
_CONVERGED = 0.01  # in log posterior
_MOST_ITERATIONS = 25


class Fitter(Evaluator):
    """Begins and improves points of one hypothesis."""

    def holds(self, point: FitPoint) -> bool:
        """Whether a point has this hypothesis' covariance parameters."""
        return len(point.covariance) == len(self.covariance)

    def _uncentred(self, own: Sequence[float] | Floats, parent: FitPoint | None) -> FitPoint:
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
        return FitPoint(fit, np.array([*covariance, *fit[self._own]]), self.no_bend)

    def start(
        self, own: Sequence[float] | Floats, parent: FitPoint | None = None, prediction: Prediction | None = None
    ) -> FitPoint:
        """A point with these coordinates of the mechanisms, E and h of a parent or their centre, d33 as data say."""
        point = self._uncentred(own, parent)
        fit = point.fit
        place = next((index for index, entry in enumerate(self.parameters) if entry.proportional), None)
        if place is not None:
            lines = self.hypothesis.lines
            value = (prediction or self.hypothesis.model.predict(fit)).value
            weight = 1 / (lines.deviation**2 + (0.03 * np.abs(value)) ** 2)
            ratio = np.sum(weight * (value.conj() * lines.value).real) / np.sum(weight * np.abs(value) ** 2)
            if ratio > 0:
                fit[place] = np.clip(fit[place] + np.log(ratio), self.low[place], self.high[place])
        return point

    def begin(self, own: Sequence[float] | Floats, parent: FitPoint | None = None) -> Evaluated:
        """The start of these coordinates, evaluated with a single prediction where d33 only scales it."""
        prediction = self.hypothesis.model.predict(self._uncentred(own, parent).fit)
        point = self.start(own, parent, prediction)
        names = [entry.name for entry in self.parameters]
        if "d33" not in names:
            return self.evaluate(point)
        place = names.index("d33")
        return self.evaluate(point, _scaled(prediction, point.fit[place] - self._uncentred(own, parent).fit[place]))

    def rescaled(self, begin: Evaluated, covariance: Floats) -> Evaluated:
        """At other covariance parameters, and d33 as they would have it: no further prediction."""
        at = self.weighed_anew(self.moved(begin.point, covariance), begin)
        place = [entry.name for entry in self.parameters].index("d33")
        information, gradient = self.posterior_equations(at)
        index = self.places.index(place)
        fit = at.point.fit.copy()
        step = float(gradient[index] / information[index, index])
        fit[place] = np.clip(
            fit[place] + np.clip(step, -_LARGEST_STEP, _LARGEST_STEP), self.low[place], self.high[place]
        )
        prediction = _scaled(at.prediction, fit[place] - at.point.fit[place])
        return self.settle(self.weighed_anew(replace(at.point, fit=fit), replace(at, prediction=prediction)), 2)

    def improve(self, start: FitPoint) -> Evaluated:
        """The most probable point near the start."""
        if not self.hypothesis.lines.curves:
            return self.settle(self._descend(self.settle(self.evaluate(start), 3), 1), 2)
        # Small smooth error and close fit, or large and loose: each may be a maximum of its own.
        fits = []
        for smooth in (self.hypothesis.smooth.low, self.hypothesis.smooth.middle):
            begin = replace(start, covariance=np.array([GAIN_PRIOR.middle, 0.0, smooth]))
            fitted = self.settle(self._descend(self.evaluate(begin), 0), _CURVE_SETTLING)
            fits.append(self.settle(self._descend(fitted, 1), _CURVE_SETTLING))
        return min(fits, key=lambda at: at.cost)

    def _descend(self, best: Evaluated, settling: int) -> Evaluated:
        """Steps of the mean parameters, each followed by so many of the covariance's."""
        damping = 1e-3
        for _ in range(_MOST_ITERATIONS):
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
        growth = np.zeros((len(slopes), len(self.parameters)))
        for place in self.places:
            step = _SLOPE_STEP * (self.high[place] - self.low[place])
            moved = at.point.fit.copy()
            moved[place] += step if moved[place] + step <= self.high[place] else -step
            growth[:, place] = (self.evaluate(replace(at.point, fit=moved)).moments.log_slopes - slopes) / (
                moved[place] - at.point.fit[place]
            )
        return replace(at, growth=growth)

    def _step(self, at: Evaluated, damping: float) -> tuple[Floats, float]:
        """A damped Gauss–Newton step of the mean parameters within the bounds, and what the gradient says it gains."""
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


def _scaled(prediction: Prediction, log_factor: float) -> Prediction:
    """Of another d33."""
    factor = float(np.exp(log_factor))
    slopes = prediction.position_slopes
    return replace(
        prediction,
        value=factor * prediction.value,
        slopes=factor * prediction.slopes,
        position_slopes=None if slopes is None else factor * slopes,
    )
