"""Least-squares fits of curves: starting points of the fit, and plain least squares for comparison.

The residuals are in units of a law's usual error, with the parameters' priors, a gain of each recording, and zero and
drift of its cell taken out (variable projection). Scipy's trust-region reflective algorithm converges from far away,
where steps on the likelihood, whose covariance depends on the model, do not. With adhesion the force jumps at the
contact point, and no derivative leads past a sample there: where a curve does not show its jumps, it is fitted again
between the samples where it fits best.
"""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from scipy.optimize import least_squares

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.hypothesis import Hypothesis, curvature_of_prior
from underskin.diagnosis.noise import START_GAIN, TYPICAL, USUAL_DRIFT
from underskin.mechanisms.models.curves import CurveModel
from underskin.recordings.campaign import curves_of
from underskin.units import Floats

_TOLERANCE, _OF_STARTS = 1e-4, 1e-3  # of the sum of squares, and the same for starting points
_EVALUATIONS = 40  # at most
_STEP = 1e-3  # of that, the tolerance on steps: a contact point's prior is far wider than a snap-in is deep
_PASSED = 4  # most samples, either way, that a contact point is moved past
_OFF_SAMPLE = 1e-6  # of the gap between two samples: a contact point at a sample is past it
_ROUNDING = 1e-9  # of a range: smaller differences are rounding, and a start is so far off its bounds


Linearised = tuple[Floats, Floats]  # residuals (rows,) and their derivatives (rows, coordinates)


class LeastSquares:
    """Least-squares fits of one hypothesis of curves."""

    def __init__(self, hypothesis: Hypothesis) -> None:
        """Prepare the measured samples and the projections."""
        lines, model = hypothesis.lines, hypothesis.model
        assert isinstance(model, CurveModel)
        assert lines.smooth is not None
        self._model = model
        self._recording = lines.recording
        self._spans = lines.spans
        largest = np.array([np.abs(lines.value[span]).max() for span in lines.spans])
        self._unit = TYPICAL * np.maximum(largest, 1e-300)[lines.recording]
        self._cell_projections = []
        for span in lines.spans:
            columns = lines.smooth.columns[span] / self._unit[span, None]
            solved = np.linalg.solve(np.eye(columns.shape[1]) + columns.T @ columns, columns.T)
            self._cell_projections.append((columns, solved))
        self._measured = lines.value.real
        self._low, self._high = np.array([parameter.bounds for parameter in model.parameters]).T
        priors = np.array([curvature_of_prior(parameter) for parameter in model.parameters])
        self._precision, self._centre = np.sqrt(priors[:, 0]), priors[:, 1]
        travels = [curve.displacement_mm for curve in curves_of(lines.campaign)]
        self._approach = [_distinct(travel[: int(travel.argmax()) + 1]) for travel in travels]
        self._has_jumps = model.hidden_jumps

    def fitted(self, start: Floats) -> tuple[Floats, float]:
        """The fit coordinates (parameters,) from a start, and half the sum of squares there."""
        initial, low, high = np.append(start, np.zeros(len(self._spans))), self._low.copy(), self._high.copy()
        x, cost = self._minimised(initial, low, high)
        if self._has_jumps:
            other, less = self._minimised(*self._between_samples(x))
            x, cost = (other, less) if less < cost else (x, cost)
        return np.clip(x[: len(start)], self._low, self._high), cost  # rounding may exceed the bounds

    def _between_samples(self, x: Floats) -> tuple[Floats, Floats, Floats]:
        """Fit coordinates and gains with each contact point in the interval of the approach, near its present one,
        where its curve fits best; and bounds that keep it there."""
        count, indices = len(self._low), self._model.contact_points
        lower, upper = (np.empty((2 * _PASSED + 1, len(indices))) for _ in range(2))
        for curve, travel in enumerate(self._approach):
            first = np.searchsorted(travel, x[indices[curve]]) - 1 - _PASSED
            cells = np.clip(first + np.arange(len(lower)), 0, max(len(travel) - 2, 0))
            lower[:, curve], upper[:, curve] = travel[cells], travel[np.minimum(cells + 1, len(travel) - 1)]
        lower, upper = (np.clip(edge, self._low[indices], self._high[indices]) for edge in (lower, upper))
        shut = lower >= upper  # intervals outside the contact point's bounds: these are kept
        lower, upper = np.where(shut, self._low[indices], lower), np.where(shut, self._high[indices], upper)
        fits = np.tile(x[:count], (len(lower), 1))
        fits[:, indices] = (lower + upper) / 2
        force = (1 + x[count:][self._recording]) * self._model.forces(fits)
        residuals = self._projected((self._measured - force) / self._unit)[:, : len(self._measured)]
        best = np.add.reduceat(residuals**2, [span.start for span in self._spans], axis=1).argmin(axis=0)
        curves = np.arange(len(indices))
        moved, low, high = x.copy(), self._low.copy(), self._high.copy()
        moved[indices], low[indices], high[indices] = fits[best, indices], lower[best, curves], upper[best, curves]
        return moved, low, high

    def _minimised(self, start: Floats, low: Floats, high: Floats) -> tuple[Floats, float]:
        """Fit coordinates and gains from a start, and half the sum of squares there."""
        count = len(low)
        gains = np.full(len(start) - count, 0.5)
        margin = _ROUNDING * (high - low)
        initial = np.append(np.clip(start[:count], low + margin, high - margin), start[count:])
        bounds = np.append(low, -gains), np.append(high, gains)
        unit = np.append(_units(self._model, self._precision), np.ones(len(gains)))
        return _solved(self._linearised, initial, bounds, unit, _OF_STARTS)

    def _linearised(self, x: Floats) -> Linearised:
        count = len(self._low)
        fit, gain = x[:count], x[count:]
        force, slopes = (part[0] for part in self._model.forces_and_slopes(fit[None]))
        scaled = 1 + gain[self._recording]
        residuals = self._projected((self._measured - scaled * force) / self._unit)
        by_gain = np.where(self._recording == np.arange(len(gain))[:, None], -force / self._unit, 0.0)
        rows = np.concatenate([self._projected(-(slopes * scaled) / self._unit), self._projected(by_gain)]).T
        priors = np.diag(np.append(self._precision, np.full(len(gain), 1 / START_GAIN)))
        offsets = (fit - self._centre) * self._precision, gain / START_GAIN
        return np.concatenate([residuals, *offsets]), np.concatenate([rows, priors])

    def _projected(self, rows: Floats) -> Floats:
        """Rows (…, rows) minus their projection on zero and drift of each cell, and the coefficients of these."""
        parts, coefficients = [], []
        for span, (columns, solved) in zip(self._spans, self._cell_projections, strict=True):
            coefficients.append(rows[..., span] @ solved.T)
            parts.append(rows[..., span] - coefficients[-1] @ columns.T)
        return np.concatenate([*parts, *coefficients], axis=-1)


def _distinct(travel: Floats) -> Floats:
    """The distinct displacements in order, to within rounding."""
    values = np.unique(travel)
    return values[np.append(True, np.diff(values) > _ROUNDING * np.ptp(values))]


def plain_least_squares(hypothesis: Hypothesis, start: Floats) -> tuple[Floats, float]:
    """The fit (parameters,) of the law by plain least squares, and the root mean square residual of all raw samples
    [% of the force's own].

    Without priors and gains: the parameters and a zero of each curve are free, and its drift where that is plain in the
    air. From a start (parameters,).
    """
    lines, model = hypothesis.lines, hypothesis.model
    assert isinstance(model, CurveModel)
    assert lines.smooth is not None
    count = lines.smooth.count
    root, measured = np.sqrt(count), lines.value.real
    bases = [_cell_columns(lines.smooth.columns[span], root[span], measured[span]) for span in lines.spans]

    def about_zero(rows: Floats) -> Floats:
        """Weighed rows (…, rows) less what zero and drift of each curve take of them."""
        weighed = root * rows
        parts = [weighed[..., span] for span in lines.spans]
        return np.concatenate(
            [part - part @ basis @ basis.T for part, basis in zip(parts, bases, strict=True)], axis=-1
        )

    def linearised(x: Floats) -> Linearised:
        force, slopes = (part[0] for part in model.forces_and_slopes(x[None]))
        return about_zero(measured - force) / unit, -about_zero(slopes).T / unit

    unit = float(np.sqrt((about_zero(measured) ** 2).sum()))
    low, high = np.array([parameter.bounds for parameter in model.parameters]).T
    margin = _ROUNDING * (high - low)
    initial = np.clip(start, low + margin, high - margin)
    precision = np.sqrt([curvature_of_prior(parameter)[0] for parameter in model.parameters])
    best, cost = _solved(linearised, initial, (low, high), _units(model, precision), _TOLERANCE)
    square_sum = 2 * cost * unit**2 + lines.smooth.within(model.forces(best[None])[0], lines.spans)
    return best, 100 * float(np.sqrt(square_sum / (count * measured**2).sum()))


def least_squares_reading(lines: Lines, force: Floats) -> Floats:
    """The cells' readings of a force (rows,) [N] by plain least squares: with the best zero of each curve, and its
    drift where that is plain in the air."""
    assert lines.smooth is not None
    root, measured = np.sqrt(lines.smooth.count), lines.value.real
    reading = force.copy()
    for span in lines.spans:
        basis = _cell_columns(lines.smooth.columns[span], root[span], measured[span])
        rest = root[span] * (measured[span] - force[span])
        reading[span] += basis @ (basis.T @ rest) / root[span]
    return reading


def _cell_columns(columns: Floats, root: Floats, force: Floats) -> Floats:
    """An orthonormal basis (rows, 1 or 2) of the zero of one curve and, where more than usual is expected, its drift in
    time; `root` are the square roots of the rows' weights."""
    time = columns[:, 1]
    plain = float(np.abs(time).max()) > 1.001 * USUAL_DRIFT * float(np.abs(force).max())
    return np.asarray(
        np.linalg.qr(root[:, None] * np.column_stack([np.ones(len(time)), *([time] if plain else [])]))[0]
    )


def _units(model: CurveModel, precision: Floats) -> Floats:
    """Scales of the fit coordinates (parameters,): the prior's deviation of contact points, else 1."""
    units = np.ones(len(precision))
    units[model.contact_points] = 1 / precision[model.contact_points]
    return units


def _solved(
    linearised: Callable[[Floats], Linearised],
    start: Floats,
    bounds: tuple[Floats, Floats],
    unit: Floats,
    tolerance: float,
) -> tuple[Floats, float]:
    """The solution and half the sum of squares there.

    Coordinates are shifted to the start and scaled by `unit`, so that the tolerance on steps does not depend on the
    zero of the displacement. Residuals are followed by their derivatives at the same point, of which one prediction is
    enough.
    """
    low, high = bounds

    @lru_cache(maxsize=1)
    def at(moved: bytes) -> Linearised:
        return linearised(start + unit * (np.frombuffer(moved) - 1))

    def residuals_at(moved: Floats) -> Floats:
        return at(moved.tobytes())[0]

    def jacobian_at(moved: Floats) -> Floats:
        return at(moved.tobytes())[1] * unit

    lowest, highest = 1 + (low - start) / unit, 1 + (high - start) / unit
    result = least_squares(
        residuals_at,
        np.clip(1.0, lowest, highest),  # scipy's first trust region is as large as that; rounding may leave the bounds
        jacobian_at,
        bounds=(lowest, highest),
        x_scale="jac",
        ftol=tolerance,
        xtol=_STEP * tolerance,
        gtol=1e-12,
        max_nfev=_EVALUATIONS,
    )
    return start + unit * (np.asarray(result.x) - 1), float(result.cost)


def between_samples(hypothesis: Hypothesis, fit: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Bounds of fit coordinates (parameters,) that keep each contact point between the samples where it is.

    With adhesion the force jumps as a contact point passes a sample, which no derivative shows.
    """
    assert isinstance(hypothesis.model, CurveModel)
    low, high = low.copy(), high.copy()
    curves = curves_of(hypothesis.lines.campaign)
    for index, curve in zip(hypothesis.model.contact_points.tolist(), curves, strict=True):
        travel = curve.displacement_mm[: int(curve.displacement_mm.argmax()) + 1]
        before, after = travel[travel < fit[index]], travel[travel >= fit[index]]
        if len(before) and len(after):
            first, last = float(before.max()), float(after.min())
            low[index] = max(low[index], first + _OFF_SAMPLE * (last - first))
            high[index] = min(high[index], last)
    return np.minimum(low, fit), np.maximum(high, fit)
