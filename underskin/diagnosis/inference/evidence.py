"""The evidence of hypotheses, and posteriors that no quadratic describes.

The evidence of one hypothesis by Laplace's method, with care for parameters at their bounds.

log Z = −cost* + (n/2) log 2π − ½ log|H| + log P(box). The cost is that of the quadratic's own minimum (which may lie
outside the bounds), H the information on the mean parameters and the Hessian in the covariance's, P(box) the
probability that a normal with this mean and H⁻¹ gives to the bounds: one bound after another, each with the moments
left by the ones before (exact for one bound; Mendell and Elston 1974).

The posterior of a parameter over all values of the sensors' spread, which two sensors leave open by a factor, is a
mixture over a grid of that spread (`marginalise_sensor_spread`). Where a parameter's 95 % interval reaches no effect,
the profile of the posterior, which need not be Gaussian, ends it (`profile_end`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from scipy.special import log_ndtr

from underskin.diagnosis.inference.fit import Fitter, Scatter
from underskin.diagnosis.inference.gaussian import LEAST_EIGENVALUE, NormalMixture
from underskin.diagnosis.inference.hypothesis import (
    FLAT,
    Evaluated,
    FitPoint,
    Hypothesis,
    Points,
    Tangent,
    cell_response,
)
from underskin.diagnosis.noise import NoiseLevels
from underskin.mechanisms.models.composed import Prediction
from underskin.mechanisms.models.frf import FrfModel
from underskin.units import Floats
from underskin.weak_cache import cached_while_alive

_NEAR = 4.0  # standard deviations: bounds farther than this from the mean are left out
# Largest numbers of polishing steps, of FRFs and of curves, and the gain in log posterior below which a point stops
_POLISHING_STEPS, _POLISHING_STEPS_OF_CURVES, _POLISHING_GAIN = 4, 12, 0.05
_LEAST_COVARIANCE_CURVATURE = 0.3  # in the logarithms of noise levels: their priors are not wider
_REMAINING_GAIN = 1.0  # gain in log posterior that polishing may leave
_LEAST_BOUNDS_TERM = -50.0  # nats: bounds around the point reduce an integral by less, and never raise it
NEGLIGIBLE_NATS = 12.0  # of log evidence behind the best: odds of 1 to 160,000, which no other set makes up for


@dataclass(frozen=True, eq=False)
class Evidence:
    """log Z up to a constant common to all hypotheses, the most probable point and the parameters' covariance there."""

    log_evidence: float
    hypothesis: Hypothesis
    point: FitPoint
    cost: float
    covariance: Floats  # (mean parameters, mean parameters), of the quadratic, bounds not counted
    mean: Floats  # (mean parameters,), of the quadratic, which may lie outside the bounds

    def covariance_of(self, indices: Sequence[int]) -> Floats:
        """The covariance of parameters of the model's mean (indices, indices), in fit coordinates."""
        rows = [self.hypothesis.mean_indices.index(index) for index in indices]
        return self.covariance[np.ix_(rows, rows)]

    def log_density_at_end(self, index: int) -> float:
        """The logarithm of the posterior density of a parameter at its upper bound over that of its prior: the evidence
        with the parameter held there over that with it free (Dickey, Ann. Math. Stat. 42 (1971) 204)."""
        row = self.hypothesis.mean_indices.index(index)
        parameter = self.hypothesis.model.parameters[index]
        low, high = parameter.bounds
        deviation = float(np.sqrt(self.covariance[row, row]))
        at_low, at_high = ((end - float(self.mean[row])) / deviation for end in (low, high))
        inside = _log_between(at_low, at_high) if at_low <= 0 else _log_between(-at_high, -at_low)
        density = -0.5 * at_high**2 - 0.5 * np.log(2 * np.pi) - np.log(deviation) - inside
        return float(density - parameter.log_prior(high))

    @cached_property
    def fitter(self) -> Fitter:
        """Evaluates points of this hypothesis."""
        return Fitter(self.hypothesis)

    @cached_property
    def at(self) -> Evaluated:
        """The most probable point, evaluated."""
        return self.fitter.evaluate(self.fitter.at(self.point))

    @cached_property
    def tangent(self) -> Tangent:
        """The likelihood linearised there."""
        return self.fitter.tangent(self.at.points, self.at.products)

    @cached_property
    def prediction(self) -> Prediction:
        """The model's prediction there, on the rows of the hypothesis: of FRFs without derivatives, of curves with the
        zero and drift of the load cells."""
        model = self.hypothesis.model
        if isinstance(model, FrfModel):
            return model.predict(self.point.fit, slopes=False, place=False)
        prediction = model.predict(self.point.fit)
        added = cell_response(self.hypothesis.lines, self.levels, prediction.value.real).offset
        return replace(prediction, value=prediction.value + added)

    @cached_property
    def relative_place_slopes(self) -> Floats:
        """∇m/m of each recording over its contact's place [1/m] (2, recordings); 0 of curves."""
        model = self.hypothesis.model
        if isinstance(model, FrfModel):
            return model.relative_place_slopes(self.point.fit)
        return np.zeros((2, self.hypothesis.lines.recordings))

    def position_variance(self, position: float) -> Floats:
        """The variance of each recording's relative level by this positioning scatter [m] (recordings,)."""
        first_order = position**2 * (self.relative_place_slopes**2).sum(axis=0)
        return np.asarray(first_order + 0.5 * position**4 * self.hypothesis.curvature.square)

    @cached_property
    def levels(self) -> NoiseLevels:
        """The noise levels there."""
        return self.fitter.levels(self.point.covariance).first

    @property
    def sensor_gains(self) -> Floats:
        """The most probable log gain of each sensor (sensors,)."""
        return self.tangent.sensor_gains[0]

    @property
    def pickup_variance(self) -> Floats:
        """Variance of the pickup in the real and the imaginary part of each row [(C/N)²]."""
        pickup, deviation = self.hypothesis.model.pickup, self.levels.pickup
        on_rows = None if pickup is None or deviation is None else pickup.on_rows(deviation)
        return replace(self.prediction, pickup=on_rows).pickup_variance


def laplace_at(fitter: Fitter, at: Evaluated) -> Evidence:
    """Laplace's approximation at a most probable point, which is first polished until its whole gradient vanishes."""
    for _ in range(_POLISHING_STEPS_OF_CURVES if fitter.lines.curves else _POLISHING_STEPS):
        polished = _polished(fitter, at)
        if polished is None:
            break
        at = polished
    (value,), (mean,), (covariance,) = mean_integrals(fitter, at)
    (volume,) = level_integrals(fitter, at)
    point = FitPoint(at.points.fit[0], at.points.covariance[0], at.points.sensor_log_gain[0])
    log_evidence, cost = float(value + volume), float(at.cost[0])
    return Evidence(log_evidence, fitter.hypothesis, point, cost, covariance, mean)


def mean_integrals(fitter: Fitter, at: Evaluated) -> tuple[Floats, list[Floats], list[Floats]]:
    """Logarithms of the integrals over the mean parameters, with the covariance's held (points,), and the mean (mean
    parameters,) and covariance (mean parameters, mean parameters) of each quadratic."""
    values, means, covariances = [], [], []
    indices = np.flatnonzero(fitter.free)
    for number, (information, gradient) in enumerate(zip(*_equations(fitter, at), strict=True)):
        coordinates, low, high = at.points.fit[number, indices], fitter.low[indices], fitter.high[indices]
        information, gradient = _definite(information[np.ix_(indices, indices)]), gradient[indices]
        # A gradient towards a bound is kept. Elsewhere, a large one after polishing means a kink in the cost, where the
        # gain that the quadratic predicts does not exist.
        free = ~(((coordinates <= low) & (gradient > 0)) | ((coordinates >= high) & (gradient < 0)))
        if 0.5 * gradient[free] @ np.linalg.solve(information[np.ix_(free, free)], gradient[free]) > _REMAINING_GAIN:
            gradient = np.where(free, 0.0, gradient)
        covariance: Floats = np.linalg.inv(information).astype(np.float64)
        gain = 0.5 * gradient @ covariance @ gradient
        volume = 0.5 * len(coordinates) * np.log(2 * np.pi) - 0.5 * np.linalg.slogdet(information)[1]
        mean = (coordinates - covariance @ gradient).astype(np.float64)
        bounds_term = gain + log_box(mean, covariance, low, high)
        if not _LEAST_BOUNDS_TERM < bounds_term < 2 * _REMAINING_GAIN:
            # Truncating one bound after another fails where a quadratic leads far out of several.
            mean, deviation = coordinates, np.where(free, 0.0, np.diag(information) ** -0.5)
            bounds_term = log_box(coordinates, covariance, low, high) - float(
                np.log1p(np.abs(gradient) * deviation).sum()
            )
        values.append(float(-at.cost[number] + volume + bounds_term))
        means.append(mean)
        covariances.append(covariance)
    return np.array(values), means, covariances


def _definite(information: Floats) -> Floats:
    """The information with positive eigenvalues, which rounding may have made negative where it is nearly singular."""
    scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    if values[0] > LEAST_EIGENVALUE:
        return information
    return np.asarray((vectors * np.maximum(values, LEAST_EIGENVALUE)) @ vectors.T * np.outer(scale, scale))


def level_integrals(fitter: Fitter, at: Evaluated) -> Floats:
    """Logarithms of the integrals over the covariance's parameters, relative to the density at the modes (points,)."""
    return log_volume(fitter.covariance_equations(at)[1])


def log_volume(hessian: Floats) -> Floats:
    """The log volume of normal approximations in the logarithms of the noise levels (…, levels, levels)."""
    eigenvalues = np.maximum(np.linalg.eigvalsh(hessian), _LEAST_COVARIANCE_CURVATURE)
    return np.asarray(0.5 * hessian.shape[-1] * np.log(2 * np.pi) - 0.5 * np.log(eigenvalues).sum(axis=-1))


def levels_covariance(hessian: Floats) -> Floats:
    """The covariance of the logarithms of the noise levels, with the same least curvature.

    At a bound the Hessian may be negative, and an interval read from it would have no width.
    """
    eigenvalues, vectors = np.linalg.eigh(hessian)
    return np.asarray(vectors / np.maximum(eigenvalues, _LEAST_COVARIANCE_CURVATURE) @ vectors.T)


def _equations(fitter: Fitter, at: Evaluated) -> tuple[Floats, Floats]:
    """Information on the mean parameters and the gradient of the cost."""
    information, ascent = fitter.posterior_equations(at)
    span, diagonal = fitter.high - fitter.low, np.arange(len(fitter.low))
    information[:, diagonal, diagonal] += np.where(span > 0, FLAT / np.where(span > 0, span, 1.0), 0.0) ** 2
    return information, -ascent


def _polished(fitter: Fitter, at: Evaluated) -> Evaluated | None:
    """One point after a Newton step with the whole gradient, within the bounds; None where none gains."""
    (information,), (gradient,) = _equations(fitter, at)
    (coordinates,), low, high = at.points.fit, fitter.low, fitter.high
    free = fitter.free & ~(((coordinates <= low) & (gradient > 0)) | ((coordinates >= high) & (gradient < 0)))
    matrix = np.where(free[:, None] & free, information, np.eye(len(free)))
    gradient = np.where(free, gradient, 0.0)
    step = -np.linalg.solve(matrix, gradient)
    if -0.5 * gradient @ step < _POLISHING_GAIN:
        return None
    for _ in range(5):
        shifted = np.clip(coordinates + step, low, high)
        trial = fitter.update_noise_levels(fitter.evaluate(replace(at.points, fit=shifted[None])), 1)
        if trial.cost[0] < at.cost[0] - 0.2 * _POLISHING_GAIN:
            return trial
        step = step / 3
    return None


def log_box(mean: Floats, covariance: Floats, low: Floats, high: Floats) -> float:
    """The logarithm of the probability of low < x < high for x ~ N(mean, covariance)."""
    return _truncated(mean, covariance, low, high)[0]


def _truncated(mean: Floats, covariance: Floats, low: Floats, high: Floats) -> tuple[float, Floats, Floats]:
    """`log_box`, and the mean and the covariance of x within the bounds.

    The bound that the mean is farthest beyond comes first: truncation there also brings correlated parameters back
    within theirs.
    """
    mean, covariance = mean.copy(), covariance.copy()
    total, remaining = 0.0, np.ones(len(mean), dtype=bool)
    while remaining.any():
        deviation = np.sqrt(np.diag(covariance))
        beyond = np.where(remaining, np.maximum(low - mean, mean - high) / deviation, -np.inf)
        index = int(np.argmax(beyond))
        if beyond[index] < -_NEAR:
            break
        remaining[index] = False
        sd = float(deviation[index])
        a, b = (low[index] - mean[index]) / sd, (high[index] - mean[index]) / sd
        if a > 0:  # the upper tail is mirrored: log Φ is accurate in the lower one
            a, b, sign = -b, -a, -1.0
        else:
            sign = 1.0
        log_mass = _log_between(a, b)
        total += log_mass
        # Mean and variance of the truncated normal, and those of the others given them
        density_a, density_b = (np.exp(-0.5 * x * x - 0.5 * np.log(2 * np.pi) - log_mass) for x in (a, b))
        first = density_a - density_b
        tail = (a * density_a if np.isfinite(a) else 0.0) - (b * density_b if np.isfinite(b) else 0.0)
        variance = float(np.clip(1 + tail - first**2, 1e-6, 1.0))
        gain = covariance[:, index] / sd
        mean = mean + gain * sign * first
        covariance = covariance - np.outer(gain, gain) * (1 - variance)
    return total, mean, covariance


def _log_between(a: float, b: float) -> float:
    """log(Φ(b) − Φ(a)), a < b and a ≤ 0."""
    upper, lower = log_ndtr(b), log_ndtr(a)
    return float(upper + np.log1p(-np.exp(min(lower - upper, -1e-15))))


def _held_points(held: Fitter, fit: Evidence, index: int, values: Floats) -> Points:
    """Points at which the held parameter, at an index, has these values, and the others their conditional means by the
    quadratic."""
    mean = fit.hypothesis.mean_indices
    mean_index = mean.index(index)
    slopes = fit.covariance[:, mean_index] / fit.covariance[mean_index, mean_index]
    coordinates = np.tile(fit.point.fit, (len(values), 1))
    coordinates[:, mean] += slopes * (values[:, None] - fit.point.fit[index])
    coordinates = np.clip(coordinates, held.low, held.high)
    coordinates[:, index] = values
    covariance, sensor_log_gain = (
        np.tile(level, (len(values), 1)) for level in (fit.point.covariance, fit.point.sensor_log_gain)
    )
    return Points(coordinates, covariance, sensor_log_gain)


_SPREAD_VALUES = 24  # of the sensors' spread or the scatter of gains, at equal distances between its bounds


def marginalise_sensor_spread(fitter: Fitter, at: Evaluated, index: int) -> list[NormalMixture] | None:
    """The posterior of the parameter at an index among the model's over all values of the sensors' spread, at each of
    several points of one hypothesis; None where the spread is not a parameter.

    The shares of each mixture sum to 1.
    """
    hypothesis = fitter.hypothesis
    spreads = [parameter for parameter in hypothesis.model.parameters if parameter.acts_on == "gain_spread"]
    if not spreads:
        return None
    column = [parameter.name for parameter in hypothesis.covariance].index(spreads[0].name)
    low, high = spreads[0].bounds
    grid = at[np.repeat(np.arange(len(at)), _SPREAD_VALUES)]
    covariance = grid.points.covariance.copy()
    covariance[:, column] = np.tile(low + (high - low) * (np.arange(_SPREAD_VALUES) + 0.5) / _SPREAD_VALUES, len(at))
    shifted = _with_levels(fitter, grid, covariance)
    values, means, covariances = mean_integrals(fitter, shifted)
    row = int(np.searchsorted(np.flatnonzero(fitter.free), index))
    mean = np.array([mean[row] for mean in means])
    deviation = np.sqrt([covariance[row, row] for covariance in covariances])
    return [
        NormalMixture(_shares(values[rows]), mean[rows], deviation[rows])
        for rows in (slice(first, first + _SPREAD_VALUES) for first in range(0, len(values), _SPREAD_VALUES))
    ]


_SMOOTH_STEPS = np.linspace(-3.0, 3.0, 7)  # standard deviations from the most probable logarithm of the smooth error


@cached_while_alive
def marginalise_curve_noise(evidence: Evidence, indices: tuple[int, ...]) -> NormalMixture:
    """The posterior of the sum of parameters of a model of curves over all values of gain scatter and smooth error.

    Few curves leave the scatter of their gains open, and the most probable one is too small: together with a modulus
    that all share, n curves have it at √((n − 1)/n) of their own scatter, one curve at the least usual value. At each
    node the mean and the deviation are those within the parameters' bounds.

    Parameters
    ----------
    evidence
        The fit.
    indices
        Of the parameters among the model's.

    Returns
    -------
    NormalMixture
        Of the sum of the parameters' fit coordinates; the shares sum to 1.
    """
    fitter, at = evidence.fitter, evidence.at
    gains, sizes = (evidence.hypothesis.covariance[column] for column in (Scatter.GAIN, Scatter.SMOOTH))
    smooth_sd = float(np.sqrt(levels_covariance(fitter.covariance_equations(at)[1][0])[Scatter.SMOOTH, Scatter.SMOOTH]))
    gain = gains.low + (gains.high - gains.low) * (np.arange(_SPREAD_VALUES) + 0.5) / _SPREAD_VALUES
    smooth = at.points.covariance[0, Scatter.SMOOTH] + smooth_sd * _SMOOTH_STEPS
    smooth = smooth[(smooth >= sizes.low) & (smooth <= sizes.high)]
    covariance = np.tile(at.points.covariance, (len(gain) * len(smooth), 1))
    covariance[:, [Scatter.GAIN, Scatter.SMOOTH]] = [*product(gain, smooth)]
    shifted = _with_levels(fitter, at[np.zeros(len(covariance), dtype=np.intp)], covariance)
    shifted = shifted[np.flatnonzero(shifted.cost < shifted.cost.min() + NEGLIGIBLE_NATS)]
    values, means, covariances = mean_integrals(fitter, shifted)
    free = np.flatnonzero(fitter.free)
    rows = np.searchsorted(free, indices)
    low, high = fitter.low[free], fitter.high[free]
    parts = [_truncated(mean, full, low, high)[1:] for mean, full in zip(means, covariances, strict=True)]
    return NormalMixture(
        _shares(values),
        np.array([mean[rows].sum() for mean, _ in parts]),
        np.sqrt([max(float(full[np.ix_(rows, rows)].sum()), 0.0) for _, full in parts]),
    )


def _with_levels(fitter: Fitter, at: Evaluated, covariance: Floats) -> Evaluated:
    """The same predictions with other covariance parameters (points, parameters)."""
    return fitter.weighed(fitter.with_covariance(at.points, covariance), at.products)


def _shares(values: Floats) -> Floats:
    share = np.exp(values - values.max())
    return np.asarray(share / share.sum())


_FALL = 1.92  # of the log posterior density at the ends: half the 95 % quantile of χ² with one degree of freedom
_STRIDES = 8


def profile_end(evidence: Evidence, index: int, limit: float) -> float | None:
    """The value between a limit and the most probable one at which the log posterior density has fallen by 1.92.

    Parameters
    ----------
    evidence
        The fit.
    index
        Of the parameter among the model's; the others are fitted again at each of its values.
    limit
        Fit coordinate.

    Returns
    -------
    float or None
        Fit coordinate; None where the density has not fallen that far at the limit: the interval extends beyond it.
    """
    parameter = evidence.hypothesis.model.parameters[index]
    mode = float(evidence.point.fit[index])
    values = np.linspace(np.clip(limit, *parameter.bounds), mode, _STRIDES, endpoint=False)
    held = Fitter(evidence.hypothesis, held=[index])
    initial = held.evaluate(_held_points(held, evidence, index, values))
    fitted = held.descend(held.update_noise_levels(initial, 1), 1)
    priors = np.array([parameter.log_prior(value) for value in values.tolist()])
    falls = np.append(fitted.cost - priors - evidence.cost, 0.0)
    beyond = np.flatnonzero(falls > _FALL)
    if not len(beyond):
        return None
    values = np.append(values, mode)
    last = int(beyond[-1])
    share = (falls[last] - _FALL) / (falls[last] - falls[last + 1])
    return float(values[last] + share * (values[last + 1] - values[last]))
