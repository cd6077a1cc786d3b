"""The evidence of one hypothesis by Laplace's method, with care for parameters at their bounds.

log Z = −cost* + (n/2) log 2π − ½ log|H| + log P(box). The cost is that of the quadratic's own minimum (which may lie
outside the bounds), H the information on the mean parameters and the Hessian in the covariance's, P(box) the
probability that a normal with this mean and H⁻¹ gives to the bounds: one bound after another, each with the moments
left by the ones before (exact for one bound; Mendell and Elston 1974).
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import log_ndtr

from underskin.diagnosis.inference.curve_nuisances import cell_response
from underskin.diagnosis.inference.hypothesis import FitPoint, Hypothesis
from underskin.diagnosis.inference.likelihood import Likelihoods
from underskin.diagnosis.inference.optimizer import Evaluated, Fitter
from underskin.diagnosis.noise.noise_levels import NoiseLevels
from underskin.mechanisms.models.composed import Prediction
from underskin.mechanisms.models.frf import FrfModel
from underskin.units import Floats, Indices

_NEAR = 4.0  # standard deviations from a bound within which it counts
_POLISHING, _POLISHING_CURVES, _POLISHED = (
    4,
    12,
    0.05,
)  # steps at most, of curves as well, and the gain in log posterior below which it stops
_LEAST_COVARIANCE_CURVATURE = 0.3  # of logarithms of noise levels: their priors are not wider
_TRUSTED = 1.0  # gain in log posterior that polishing may leave
_ASTRAY = -50.0  # nats: bounds take less from an integral around a point within them, and add nothing
_LEAST_EIGENVALUE = 1e-11  # of the correlations' information
_FLAT = 1e-3  # least standard deviations of the quadratic within a parameter's bounds: keeps H invertible


@dataclass(frozen=True)
class Evidence:
    """log Z up to what all hypotheses share, the most probable point, and the parameters' covariance there."""

    log_evidence: float
    hypothesis: Hypothesis
    point: FitPoint
    cost: float
    covariance: Floats  # (mean parameters, mean parameters), of the quadratic, bounds not counted
    growth: Floats | None = None  # (1, recordings, parameters), see Evaluated

    @cached_property
    def fitter(self) -> Fitter:
        """What evaluates points of this hypothesis."""
        return Fitter([self.hypothesis])

    @cached_property
    def at(self) -> Evaluated:
        """The most probable point, evaluated."""
        return replace(self.fitter.evaluate(self.fitter.at(self.point)), growth=self.growth)

    @cached_property
    def marginal(self) -> Likelihoods:
        """The likelihood there."""
        return self.fitter.marginal(self.at)

    @cached_property
    def prediction(self) -> Prediction:
        """The model's prediction there, on the rows of the hypothesis: of FRFs without derivatives, of curves with what
        the cell adds."""
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

    @cached_property
    def levels(self) -> NoiseLevels:
        """The noise levels there, as numbers."""
        return self.fitter.levels(self.point.covariance).first

    @property
    def sensor_gains(self) -> Floats:
        """The most probable log gain of each sensor (sensors,)."""
        return self.marginal.sensor_gains[0]

    @property
    def pickup_variance(self) -> Floats:
        """Of real and of imaginary part of each row [(C/N)²]."""
        pickup, found = self.hypothesis.model.pickup, self.levels.pickup
        on_rows = None if pickup is None or found is None else pickup.on_rows(found)
        return replace(self.prediction, pickup=on_rows).pickup_variance


def around(fitter: Fitter, at: Evaluated) -> list[Evidence]:
    """By the quadratics around most probable points, which are first brought to where their whole gradients vanish."""
    unknown = np.flatnonzero(~fitter.grown(at))
    if len(unknown):
        at = fitter.replaced(at, unknown, fitter.with_growth(at[unknown]))
    moving = np.arange(len(at))
    for _ in range(_POLISHING_CURVES if fitter.lines.curves else _POLISHING):
        moving, at = _polish(fitter, at, moving)
        if not len(moving):
            break
    values, covariances = around_mean(fitter, at)
    volumes = around_levels(fitter, at)
    evidence = []
    for number, (value, covariance) in enumerate(zip(values + volumes, covariances, strict=True)):
        hypothesis = fitter.hypotheses[at.points.owner[number]]
        count = len(hypothesis.model.parameters)
        point = FitPoint(at.points.fit[number, :count], at.points.covariance[number], at.points.bend[number])
        growth = None if at.growth is None else at.growth[number : number + 1, :, :count]
        evidence.append(Evidence(float(value), hypothesis, point, float(at.cost[number]), covariance, growth))
    return evidence


def around_mean(fitter: Fitter, at: Evaluated) -> tuple[Floats, list[Floats]]:
    """The logs of the integrals over the mean parameters, the covariance's held, and the quadratics' covariances."""
    values, covariances = [], []
    for number, (information, gradient) in enumerate(zip(*_equations(fitter, at), strict=True)):
        owner = at.points.owner[number]
        places = np.flatnonzero(fitter.free[owner])
        fit, low, high = at.points.fit[number, places], fitter.low[owner, places], fitter.high[owner, places]
        information, gradient = _definite(information[np.ix_(places, places)]), gradient[places]
        # Towards a bound the gradient stays; elsewhere, where polishing left much of it, the fit hangs at a kink, and
        # what a smooth cost would still gain there is not to be had.
        free = ~(((fit <= low) & (gradient > 0)) | ((fit >= high) & (gradient < 0)))
        if 0.5 * gradient[free] @ np.linalg.solve(information[np.ix_(free, free)], gradient[free]) > _TRUSTED:
            gradient = np.where(free, 0.0, gradient)
        covariance: Floats = np.linalg.inv(information).astype(np.float64)
        gain = 0.5 * gradient @ covariance @ gradient
        volume = 0.5 * len(fit) * np.log(2 * np.pi) - 0.5 * np.linalg.slogdet(information)[1]
        mean = (fit - covariance @ gradient).astype(np.float64)
        beyond = gain + log_box(mean, covariance, low, high)
        if not _ASTRAY < beyond < 2 * _TRUSTED:
            # Truncating one bound after another fails where a quadratic leads far out of several.
            deviation = np.where(free, 0.0, np.diag(information) ** -0.5)
            beyond = log_box(fit, covariance, low, high) - float(np.log1p(np.abs(gradient) * deviation).sum())
        values.append(float(-at.cost[number] + volume + beyond))
        covariances.append(covariance)
    return np.array(values), covariances


def _definite(information: Floats) -> Floats:
    """With eigenvalues above 0, which rounding may have taken from nearly singular ones."""
    scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    if values[0] > _LEAST_EIGENVALUE:
        return information
    return np.asarray((vectors * np.maximum(values, _LEAST_EIGENVALUE)) @ vectors.T * np.outer(scale, scale))


def around_levels(fitter: Fitter, at: Evaluated) -> Floats:
    """What the integrals over the covariance's parameters add to the logs at their modes (points,)."""
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
    owner = at.points.owner
    span, every = (fitter.high - fitter.low)[owner], np.arange(fitter.low.shape[1])
    information[:, every, every] += np.where(span > 0, _FLAT / np.where(span > 0, span, 1.0), 0.0) ** 2
    return information, -ascent


def _polish(fitter: Fitter, at: Evaluated, moving: Indices) -> tuple[Indices, Evaluated]:
    """Newton steps of some points with the whole gradient, within the bounds; and which of them gained."""
    part = at[moving]
    information, gradient = _equations(fitter, part)
    owner, fit = part.points.owner, part.points.fit
    low, high = fitter.low[owner], fitter.high[owner]
    free = fitter.free[owner] & ~(((fit <= low) & (gradient > 0)) | ((fit >= high) & (gradient < 0)))
    both = free[:, :, None] & free[:, None, :]
    matrix = np.where(both, information, 0.0)
    every = np.arange(fit.shape[1])
    matrix[:, every, every] = np.where(free, matrix[:, every, every], 1.0)
    step = -np.linalg.solve(matrix, np.where(free, gradient, 0.0)[..., None])[..., 0]
    trying = np.flatnonzero(-0.5 * (gradient * step).sum(axis=1) >= _POLISHED)
    gained: list[Indices] = []
    for _ in range(5):
        if not len(trying):
            break
        moved = np.clip(fit[trying] + step[trying], low[trying], high[trying])
        tried = fitter.settle(fitter.evaluate(replace(part.points[trying], fit=moved)), 1)
        better = tried.cost < part.cost[trying] - 0.2 * _POLISHED
        growth = None if part.growth is None else part.growth[trying]
        at = fitter.replaced(at, moving[trying[better]], replace(tried, growth=growth)[better])
        gained.append(moving[trying[better]])
        trying = trying[~better]
        step = step / 3
    return np.sort(np.concatenate([*gained, np.zeros(0, dtype=np.intp)])), at


def log_box(mean: Floats, covariance: Floats, low: Floats, high: Floats) -> float:
    """The logarithm of the probability of low < x < high for x ~ N(mean, covariance).

    The bound that the mean is farthest beyond comes first: what goes with it beyond others comes back within them.
    """
    mean, covariance = mean.copy(), covariance.copy()
    total, left = 0.0, np.ones(len(mean), dtype=bool)
    while left.any():
        deviation = np.sqrt(np.diag(covariance))
        beyond = np.where(left, np.maximum(low - mean, mean - high) / deviation, -np.inf)
        place = int(np.argmax(beyond))
        if beyond[place] < -_NEAR:
            break
        left[place] = False
        sd = float(deviation[place])
        a, b = (low[place] - mean[place]) / sd, (high[place] - mean[place]) / sd
        if a > 0:  # the far tail is computed on the side where it is small
            a, b, sign = -b, -a, -1.0
        else:
            sign = 1.0
        log_mass = _log_between(a, b)
        total += log_mass
        # Mean and variance of the truncated normal, and what they do to the others
        density_a, density_b = (np.exp(-0.5 * x * x - 0.5 * np.log(2 * np.pi) - log_mass) for x in (a, b))
        first = density_a - density_b
        tail = (a * density_a if np.isfinite(a) else 0.0) - (b * density_b if np.isfinite(b) else 0.0)
        variance = float(np.clip(1 + tail - first**2, 1e-6, 1.0))
        gain = covariance[:, place] / sd
        mean = mean + gain * sign * first
        covariance = covariance - np.outer(gain, gain) * (1 - variance)
    return total


def _log_between(a: float, b: float) -> float:
    """log(Φ(b) − Φ(a)), a < b and a ≤ 0."""
    upper, lower = log_ndtr(b), log_ndtr(a)
    return float(upper + np.log1p(-np.exp(min(lower - upper, -1e-15))))
