"""The evidence of hypotheses, and posteriors that no quadratic describes.

The evidence of one hypothesis by Laplace's method, with care for parameters at their bounds.

log Z = −cost* + (n/2) log 2π − ½ log|H| + log P(box). The cost is that of the quadratic's own minimum (which may lie
outside the bounds), H the information on the mean parameters and the Hessian in the covariance's, P(box) the
probability that a normal with this mean and H⁻¹ gives to the bounds: one bound after another, each with the moments
left by the ones before (exact for one bound; Mendell and Elston 1974).

The position scatter is integrated over: its prior is flat between two values, and often the recordings do not
determine it; the posterior of the gain scatter is then not Gaussian either. There Z is the integral over the logarithms
of both, at the most probable prediction, from which the quadratic of the mean parameters leads on: sums at equal
strides, as good as exact for what falls to nothing both ways.

Indentations determine E/(1 − ν²), so that E and ν trade along a ridge, which ν between its bounds cuts short: a
parameter that trades against one between bounds is integrated over that (`parts`). The posterior of a parameter over
all values of the sensors' spread, which two sensors leave open by a factor, is a mixture over a grid of that spread
(`marginalise_sensor_spread`). Where a parameter's 95 % interval reaches no effect, the profile of the posterior, which
need not be Gaussian, ends it (`profile_end`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.special import log_ndtr

from underskin.diagnosis.inference.fit import GAIN, POSITION, Fitter
from underskin.diagnosis.inference.gaussian import NormalMixture
from underskin.diagnosis.inference.hypothesis import Evaluated, FitPoint, Hypothesis, Likelihoods, Points, cell_response
from underskin.diagnosis.noise import NoiseLevels
from underskin.mechanisms.models.composed import Prediction
from underskin.mechanisms.models.frf import FrfModel
from underskin.mechanisms.parameter import Uniform
from underskin.units import Floats, Indices

_NEAR = 4.0  # standard deviations from a bound within which it counts
_POLISHING, _POLISHING_CURVES, _POLISHED = (
    4,
    12,
    0.05,
)  # steps at most, of curves as well, and the gain in log posterior below which it stops
_LEAST_COVARIANCE_CURVATURE = 0.3  # of logarithms of noise levels: their priors are not wider
_POLISHED_GAIN = 1.0  # gain in log posterior that polishing may leave
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
    log_slope_gradient: Floats | None = None  # (1, recordings, parameters), see Evaluated

    @cached_property
    def fitter(self) -> Fitter:
        """What evaluates points of this hypothesis."""
        return Fitter([self.hypothesis])

    @cached_property
    def at(self) -> Evaluated:
        """The most probable point, evaluated."""
        return replace(self.fitter.evaluate(self.fitter.at(self.point)), log_slope_gradient=self.log_slope_gradient)

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
    unknown = np.flatnonzero(~fitter.has_log_slope_gradient(at))
    if len(unknown):
        at = fitter.replaced(at, unknown, fitter.with_log_slope_gradient(at[unknown]))
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
        point = FitPoint(at.points.fit[number, :count], at.points.covariance[number], at.points.sensor_log_gain[number])
        log_slope_gradient = (
            None if at.log_slope_gradient is None else at.log_slope_gradient[number : number + 1, :, :count]
        )
        evidence.append(
            Evidence(float(value), hypothesis, point, float(at.cost[number]), covariance, log_slope_gradient)
        )
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
        if 0.5 * gradient[free] @ np.linalg.solve(information[np.ix_(free, free)], gradient[free]) > _POLISHED_GAIN:
            gradient = np.where(free, 0.0, gradient)
        covariance: Floats = np.linalg.inv(information).astype(np.float64)
        gain = 0.5 * gradient @ covariance @ gradient
        volume = 0.5 * len(fit) * np.log(2 * np.pi) - 0.5 * np.linalg.slogdet(information)[1]
        mean = (fit - covariance @ gradient).astype(np.float64)
        beyond = gain + log_box(mean, covariance, low, high)
        if not _ASTRAY < beyond < 2 * _POLISHED_GAIN:
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
        tried = fitter.update_noise_levels(fitter.evaluate(replace(part.points[trying], fit=moved)), 1)
        better = tried.cost < part.cost[trying] - 0.2 * _POLISHED
        log_slope_gradient = None if part.log_slope_gradient is None else part.log_slope_gradient[trying]
        at = fitter.replaced(at, moving[trying[better]], replace(tried, log_slope_gradient=log_slope_gradient)[better])
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


_GONE = 4.0  # nats below the greatest at which an integral ends
_LONGEST_STRIDE = 0.3  # of scatter's logarithm: twice the deviation with which its prior falls off
_GAIN_STRIDES = 8  # either way: 2.4 of the logarithm at most, and the prior's flat part is 1.6 wide
_SETTLING = 5  # steps of the other noise levels at each positioning scatter
_AT_ONCE = 2  # strides either way, before it is known whether more are needed


def laplace(fitter: Fitter, at: Evaluated) -> Evidence:
    """The evidence around the most probable point, over all values of what the lines leave loose."""
    return integrated(around(fitter, at))[0]


def integrated(evidence: Sequence[Evidence]) -> list[Evidence]:
    """Over all values of the position scatter, where there is one."""
    whole = list(evidence)
    for group in _alike(whole, [entry.hypothesis.has_position_scatter for entry in whole]):
        for number, entry in zip(group, _over_position([whole[number] for number in group]), strict=True):
            whole[number] = entry
    return whole


def _alike(evidence: Sequence[Evidence], chosen: Sequence[bool]) -> list[list[int]]:
    """Of those chosen, which can be evaluated together."""
    groups: dict[object, list[int]] = {}
    for number, entry in enumerate(evidence):
        if chosen[number]:
            groups.setdefault(entry.hypothesis.group(number), []).append(number)
    return list(groups.values())


@dataclass
class _Integral:
    """∫ Z(x) dx within bounds, from values at equal strides either way of `begin` until Z is gone.

    Each value counts for half the way to the next; the last before a bound for the way to the bound.
    """

    begin: float
    stride: float
    low: float
    high: float
    log_values: dict[float, float] = field(default_factory=dict)

    def missing(self) -> list[float]:
        """The values of x that are wanted next; none where Z is gone both ways."""
        if not self.log_values:
            steps = list(range(-_AT_ONCE, _AT_ONCE + 1))
            values = [self.begin + step * self.stride for step in steps]
        else:
            least = max(self.log_values.values()) - _GONE
            first, last = min(self.log_values), max(self.log_values)
            steps = list(range(1, _AT_ONCE + 1))
            below = [first - step * self.stride for step in steps] if self.log_values[first] > least else []
            above = [last + step * self.stride for step in steps] if self.log_values[last] > least else []
            values = below + above
        return [value for value in values if value == self.begin or self.low <= value <= self.high]

    @property
    def log_total(self) -> float:
        """The logarithm of the integral."""
        values = np.array(sorted(self.log_values))
        below, above = values[0] - self.low, self.high - values[-1]
        half = self.stride / 2
        edges = [values[0] - (below if below < self.stride else half), *((values[1:] + values[:-1]) / 2)]
        edges.append(values[-1] + (above if above < self.stride else half))
        logs = [self.log_values[value] for value in values.tolist()]
        return float(np.logaddexp.reduce(logs + np.log(np.maximum(np.diff(edges), 1e-300))))


def _work_out(integrals: Sequence[_Integral], log_values: Callable[[list[int], Floats], Floats]) -> None:
    """Fill the integrals: `log_values` of the integrals with these numbers at these values."""
    while True:
        wanted = [(number, value) for number, entry in enumerate(integrals) for value in entry.missing()]
        if not wanted:
            return
        numbers, values = [number for number, _ in wanted], np.array([value for _, value in wanted])
        for (number, value), log_value in zip(wanted, log_values(numbers, values).tolist(), strict=True):
            integrals[number].log_values[value] = log_value


def held_points(
    held: Fitter, evidence: Sequence[Evidence], places: Sequence[int], numbers: Sequence[int], values: Floats
) -> Points:
    """Where the held parameters have these values and the others follow as the quadratics say."""
    fits = np.zeros((len(numbers), held.low.shape[1]))
    for row, (number, value) in enumerate(zip(numbers, values.tolist(), strict=True)):
        entry, place = evidence[number], places[number]
        mean = entry.hypothesis.mean_indices
        index = mean.index(place)
        along = entry.covariance[:, index] / entry.covariance[index, index]
        fits[row, : len(entry.point.fit)] = entry.point.fit
        fits[row, mean] += along * (value - entry.point.fit[place])
        fits[row] = np.clip(fits[row], held.low[number], held.high[number])
        fits[row, place] = value
    covariance, sensor_log_gain = (
        np.array([getattr(evidence[number].point, name) for number in numbers])
        for name in ("covariance", "sensor_log_gain")
    )
    return Points(np.array(numbers, dtype=np.intp), fits, covariance, sensor_log_gain)


def _over_position(evidence: list[Evidence]) -> list[Evidence]:
    """With the integrals over log p in place of their normal approximation, p the positioning scatter."""
    fitter = Fitter([entry.hypothesis for entry in evidence])
    fits = np.zeros((len(evidence), fitter.low.shape[1]))
    for row, entry in zip(fits, evidence, strict=True):
        row[: len(entry.point.fit)] = entry.point.fit
    covariance, sensor_log_gain = (
        np.array([getattr(entry.point, name) for entry in evidence]) for name in ("covariance", "sensor_log_gain")
    )
    best = fitter.evaluate(Points(np.arange(len(evidence)), fits, covariance, sensor_log_gain))
    log_slope_gradient = np.full((len(evidence), fitter.lines.recordings, fits.shape[1]), np.nan)
    for row, entry in zip(log_slope_gradient, evidence, strict=True):
        if entry.log_slope_gradient is not None:
            row[:, : entry.log_slope_gradient.shape[-1]] = entry.log_slope_gradient[0]
            row[:, entry.log_slope_gradient.shape[-1] :] = 0.0
    best = replace(best, log_slope_gradient=log_slope_gradient)
    hessian = fitter.covariance_equations(best)[1]
    low, high = fitter.covariance[POSITION].low, fitter.covariance[POSITION].high
    integrals = [
        _Integral(float(entry.point.covariance[POSITION]), float(stride), low, high)
        for entry, stride in zip(evidence, _stride(hessian[:, POSITION, POSITION]), strict=True)
    ]

    def log_values(numbers: list[int], values: Floats) -> Floats:
        begin = best[np.array(numbers)]
        covariance = begin.points.covariance.copy()
        covariance[:, POSITION] = values
        moved = fitter.weighed(fitter.with_covariance(begin.points, covariance), begin.products)
        at = replace(
            fitter.update_noise_levels(moved, _SETTLING, held=POSITION), log_slope_gradient=begin.log_slope_gradient
        )
        return around_mean(fitter, at)[0] + _over_gain(fitter, at)

    _work_out(integrals, log_values)
    quadratic = around_mean(fitter, best)[0] + around_levels(fitter, best)
    return [
        replace(entry, log_evidence=entry.log_evidence + integral.log_total - whole)
        for entry, integral, whole in zip(evidence, integrals, quadratic.tolist(), strict=True)
    ]


def _over_gain(fitter: Fitter, at: Evaluated) -> Floats:
    """What the integrals over the noise levels but the position's add: sums over the gain's, the others following."""
    hessian = fitter.covariance_equations(at)[1]
    others = [place for place in range(hessian.shape[1]) if place not in (GAIN, POSITION)]
    curvature = hessian[:, others][:, :, others]
    stride = _stride(hessian[:, GAIN, GAIN])
    steps = stride[:, None] * np.arange(-_GAIN_STRIDES, _GAIN_STRIDES + 1)
    covariances = np.repeat(at.points.covariance[:, None], steps.shape[1], axis=1)
    covariances[..., GAIN] += steps
    follow = np.linalg.solve(curvature, hessian[:, others, GAIN][..., None])[..., 0]
    covariances[..., others] -= steps[..., None] * follow[:, None]
    entry = fitter.covariance[GAIN]
    within = (covariances[..., GAIN] >= entry.low) & (covariances[..., GAIN] <= entry.high)
    gains = np.where(within, at.cost[:, None] - fitter.costs(at, covariances), -np.inf)
    return np.asarray(np.logaddexp.reduce(gains, axis=1) + np.log(stride) + log_volume(curvature))


def _stride(curvature: Floats) -> Floats:
    """One standard deviation, or what resolves how the priors of scatter fall off."""
    return np.asarray(np.maximum(curvature, _LONGEST_STRIDE**-2) ** -0.5)


_OPEN = 0.3  # of the range between bounds: a uniform distribution has 0.29
_TRADED = 0.9  # correlation of two parameters that trade against each other
_CELLS = 5  # of the range, at whose middles the parameter is held


@dataclass(frozen=True)
class Part:
    """Of a posterior: its probability, and the normal distribution of the fit coordinates there."""

    share: float
    fit: Floats  # (parameters,)
    covariance: Floats  # (mean parameters, mean parameters)


def parts(evidence: Evidence, place: int) -> list[Part]:
    """The posterior of a parameter, by its place, and of all others.

    In one part, as the quadratic has it; or in as many as the range of the parameter that it trades against is divided
    into, where the recordings leave that parameter open between its bounds.
    """
    open_place = _traded(evidence, place)
    if open_place is None:
        return [Part(1.0, evidence.point.fit, evidence.covariance)]
    low, high = evidence.hypothesis.model.parameters[open_place].bounds
    values = low + (high - low) * (np.arange(_CELLS) + 0.5) / _CELLS
    found = _along(evidence, open_place, values)
    logs = np.array([entry.log_evidence for entry in found])
    shares = np.exp(logs - np.logaddexp.reduce(logs))
    mean_indices = np.array(evidence.hypothesis.mean_indices)
    free, cell = np.flatnonzero(mean_indices != open_place), int(np.flatnonzero(mean_indices == open_place)[0])
    each = []
    for share, entry in zip(shares.tolist(), found, strict=True):
        covariance = np.zeros_like(evidence.covariance)
        covariance[np.ix_(free, free)] = entry.covariance
        covariance[cell, cell] = ((high - low) / _CELLS) ** 2 / 12  # anywhere in its cell
        each.append(Part(share, entry.point.fit, covariance))
    return each


def _along(evidence: Evidence, place: int, values: Floats) -> list[Evidence]:
    """The evidence with a parameter held at each of these values, all others fitted again.

    From one value to the next, away from the most probable one: along a straight line, samples lose their contact.
    """
    held = Fitter([evidence.hypothesis], held=[(place,)])
    middle = float(evidence.point.fit[place])
    reached: dict[float, FitPoint] = {middle: evidence.point}
    found: dict[float, Evidence] = {}
    for value in sorted(values.tolist(), key=lambda value: abs(value - middle)):
        begin = held_points(held, [evidence], [place], [0], np.array([value]))
        if len(reached) > 1:
            near, far = sorted(reached, key=lambda other: abs(other - value))[:2]
            step = (reached[near].fit - reached[far].fit) * (value - near) / (near - far)
            begin = held.at(replace(reached[near], fit=np.clip(reached[near].fit + step, held.low[0], held.high[0])))
        (found[value],) = around(held, held.descend(held.update_noise_levels(held.evaluate(begin), 1), 1))
        reached[value] = found[value].point
    return [found[value] for value in values.tolist()]


def _traded(evidence: Evidence, place: int) -> int | None:
    """The place of the mechanisms' parameter between bounds alone that a parameter trades against; None for none."""
    hypothesis = evidence.hypothesis
    deviations = np.sqrt(np.diag(evidence.covariance))
    row = hypothesis.mean_indices.index(place)
    correlations = np.abs(evidence.covariance[row]) / (deviations[row] * deviations)
    for index, other in enumerate(hypothesis.mean_indices):
        entry = hypothesis.model.parameters[other]
        low, high = entry.bounds
        between = (
            other < hypothesis.mechanism_parameter_count
            and isinstance(entry.prior, Uniform)
            and entry.scale == "linear"
        )
        if between and correlations[index] > _TRADED and deviations[index] > _OPEN * (high - low):
            return other
    return None


_PLACES = 24


def marginalise_sensor_spread(fitter: Fitter, at: Evaluated, place: int) -> list[NormalMixture] | None:
    """The parameter at a place among the model's, around each of several points of one hypothesis; None where that has
    no free spread.

    The shares of each sum to 1.
    """
    hypothesis = fitter.hypotheses[0]
    spreads = [entry for entry in hypothesis.model.parameters if entry.acts_on == "gain_spread"]
    if not spreads:
        return None
    column = [entry.name for entry in hypothesis.covariance].index(spreads[0].name)
    low, high = spreads[0].bounds
    several = at[np.repeat(np.arange(len(at)), _PLACES)]
    covariance = several.points.covariance.copy()
    covariance[:, column] = np.tile(low + (high - low) * (np.arange(_PLACES) + 0.5) / _PLACES, len(at))
    moved = fitter.weighed(fitter.with_covariance(several.points, covariance), several.products)
    moved = replace(moved, log_slope_gradient=several.log_slope_gradient)
    values, covariances = around_mean(fitter, moved)
    free = np.flatnonzero(fitter.free[0])
    index = int(np.searchsorted(free, place))
    information, gradient = fitter.posterior_equations(moved)
    step = np.linalg.solve(information[:, free[:, None], free], gradient[:, free, None])[:, index, 0]
    mean = moved.points.fit[:, place] + step
    deviation = np.sqrt([covariance[index, index] for covariance in covariances])
    return [
        NormalMixture(_shares(values[own]), mean[own], deviation[own])
        for own in (slice(first, first + _PLACES) for first in range(0, len(values), _PLACES))
    ]


def _shares(values: Floats) -> Floats:
    share = np.exp(values - values.max())
    return np.asarray(share / share.sum())


_FALL = 1.92  # of the log posterior density at the ends: half of the 95 % quantile of χ² with one degree of freedom
_STRIDES = 8


def profile_end(evidence: Evidence, place: int, limit: float) -> float | None:
    """Where between a limit and the most probable value the log posterior density has fallen by 1.92.

    Parameters
    ----------
    evidence
        The fit.
    place
        Of the parameter among the model's; the others are fitted anew at each of its values.
    limit
        Fit coordinate.

    Returns
    -------
    float or None
        Fit coordinate; None where the density has not fallen that far at the limit: the interval goes beyond it.
    """
    entry = evidence.hypothesis.model.parameters[place]
    middle = float(evidence.point.fit[place])
    values = np.linspace(np.clip(limit, *entry.bounds), middle, _STRIDES, endpoint=False)
    held = Fitter([evidence.hypothesis], held=[(place,)])
    begun = held.evaluate(held_points(held, [evidence], [place], [0] * _STRIDES, values))
    fitted = held.descend(held.update_noise_levels(begun, 1), 1)
    priors = np.array([entry.log_prior(value) for value in values.tolist()])
    fallen = np.append(fitted.cost - priors - evidence.cost, 0.0)
    beyond = np.flatnonzero(fallen > _FALL)
    if not len(beyond):
        return None
    values = np.append(values, middle)
    last = int(beyond[-1])
    share = (fallen[last] - _FALL) / (fallen[last] - fallen[last + 1])
    return float(values[last] + share * (values[last + 1] - values[last]))
