"""d33 of an array over several dates: the level common to all sensors, their departures, and the changes of both.

ln |d33| of sensor s on date c is y_cs = a_c + μ_s + e_cs, e_cs ~ N(0, (f u_cs)²): a is the common level, u the standard
uncertainty, f the scatter of sensors from date to date relative to it. Departing sensors do not contribute to a.

The change between the first and the last date is that of a series with a gain error on each date,
    a_c = m + b t_c + w(t_c) + ε_c,    w a random walk, Var w(t) = q² t, ε_c ~ N(0, g²),
with t from 0 to 1 and flat priors of m and b; w is the departure from a straight line. g, the scatter of mounting and
amplifier common to all sensors of a date, is no change, and widens the interval. (q, g) are marginalised on a grid:
each is zero, or q half-Cauchy (Gelman 2006) and g half-normal. From two dates no scatter can be estimated: q = g = 0.
For few dates the change is a at the last less a at the first, ± √2 g, consistent with the stated values; for many,
where smoothing is more precise, b + w(1).
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, chdtri, ndtr, ndtri

from underskin.inversion.mixed_model import LEVEL, mixture_quantile
from underskin.units import Floats, Mask

BY_CHANCE = 0.05  # family-wise false-alarm probability
_OF_MEDIAN = np.pi / 2  # variance of a median of many over that of their mean


def threshold(count: int) -> float:
    """The threshold in standard deviations for each of `count` values: any exceeds it by chance with at most 5 %."""
    return float(ndtri(1 - BY_CHANCE / (2 * max(count, 1))))


def differ_from_zero(values: Floats, uncertainties: Floats) -> Mask:
    """Which values (n,) with standard uncertainties (n,), in the same unit, differ from 0; False for unknown ones."""
    with np.errstate(invalid="ignore"):
        return np.abs(values) > threshold(int(np.isfinite(values).sum())) * uncertainties


def differ_from_others(values: Floats, uncertainties: Floats) -> Mask:
    """Which values (n,) with standard uncertainties (n,), in the same unit, differ from the median of all, or of two
    from each other; False for unknown ones, and without another value."""
    valid = np.isfinite(values) & np.isfinite(uncertainties)
    count = int(valid.sum())
    differs = np.zeros(len(values), dtype=bool)
    if count == 2:
        differs[valid] = abs(np.diff(values[valid])) > threshold(1) * np.linalg.norm(uncertainties[valid])
    elif count > 2:
        variance = uncertainties[valid] ** 2
        of_median = _OF_MEDIAN * np.mean(variance) / count
        gap = np.abs(values[valid] - np.median(values[valid]))
        differs[valid] = gap > threshold(count) * np.sqrt(variance + of_median)
    return differs


FEWEST_DATES = 3  # needed to separate scatter from change
_SMOOTHED = 6  # dates: with five the smoothed change is at most a fourth more precise than the difference of the ends
FEWEST_SENSORS = 3  # needed to distinguish one from the others
_PRIOR_SENSORS = 4.0  # weight of the stated uncertainties against the observed scatter, in sensors
# Priors: the probability of none, and the scale. g: gains of single recordings scatter by 1 to 5 %, of which mounting
# and amplifier are a part (PHYSICS.md, section 8); a chain that stays as it was differs by a percent from date to date,
# seldom by three, so half-normal. q: as wide as the sensors of an array are spread (mixed_model), half-Cauchy.
_NO_GAIN, _GAIN_SCALE = 0.25, 0.0125
_NO_WALK, _WALK_SCALE = 0.6, 0.05
_NODES = np.concatenate([[0.0], np.geomspace(1e-3, 0.5, 12)])
_LEAST_DEVIATION = 1e-6  # relative: values without noise
_POLISHES = 60


@dataclass(frozen=True, eq=False)
class ArrayLevels:
    """Logarithms of d33 [C/N or pC/N, as given] of sensors over dates; NaN for unknown values.

    `level` and `deviation` (dates,): mean of the sensors `pooled` (sensors,) and its standard deviation; `departure`
    (sensors, dates): each sensor less the array and its own mean, `departure_deviation`: its standard deviation,
    scatter between dates included.
    """

    level: Floats
    deviation: Floats
    pooled: Mask
    departure: Floats
    departure_deviation: Floats


@dataclass(frozen=True, eq=False)
class Changes:
    """Changes (series,) between the first and the last date of each, as logarithms: mean, standard deviation, 95 %
    interval, and the two-sided p-value of no change; NaN for fewer than two dates."""

    value: Floats
    deviation: Floats
    low: Floats
    high: Floats
    p_value: Floats


def array_levels(value: Floats, deviation: Floats) -> ArrayLevels:
    """The two-way decomposition of ln |d33| with its standard deviations, both (sensors, dates).

    Levels start from medians, which are robust to a few changed sensors; significantly departing sensors are left out,
    and the weighted mean of the others is the array's. Dates that share no sensor with the others, directly or through
    other dates, have no level.
    """
    valid = np.isfinite(value) & np.isfinite(deviation)
    connected = _connected_dates(valid)
    valid &= connected & ((valid & connected).sum(axis=1) > 1)[:, None]
    u = np.where(valid, np.maximum(deviation, _LEAST_DEVIATION), 1.0)
    y = np.where(valid, value, 0.0)
    residual = _median_polished(y, valid, valid / u**2)
    score, freedom = (residual**2 * valid / u**2).sum(axis=1), valid.sum(axis=1) - 1
    scatter = _scatter_of_others(score, freedom)
    counted = freedom > 0
    departs = np.zeros(len(value), dtype=bool)
    if counted.sum() >= FEWEST_SENSORS:
        chance = chdtrc(np.maximum(freedom, 1), score / scatter**2)
        departs = counted & (chance < BY_CHANCE / counted.sum())
    pooled = counted & ~departs
    level, of_level = _weighted(y, valid & pooled[:, None], u * scatter[:, None])
    levelled = valid & np.isfinite(level)
    off = np.where(levelled, y - np.where(levelled, level, 0.0), 0.0)
    weight = levelled / u**2
    mean = (weight * off).sum(axis=1) / np.maximum(weight.sum(axis=1), 1e-300)
    total_deviation = np.hypot(u * scatter[:, None], np.where(levelled, of_level, 0.0))
    anchor = float(mean[pooled].mean()) if pooled.any() else 0.0
    return ArrayLevels(
        level + anchor,
        of_level,
        pooled,
        np.where(levelled, off - mean[:, None], np.nan),
        np.where(levelled, total_deviation, np.nan),
    )


def changes(time: Floats, value: Floats, deviation: Floats, *, gain_scatters: bool) -> Changes:
    """The changes of series (series, dates), NaN for missing values, with standard deviations; `time` (dates,) rises,
    in any unit. `gain_scatters`: whether dates have a gain error not in the deviations, as for an array; departures of
    sensors from the array have none.

    The random walk is a Kalman filter over y and the columns of m and b; the rest is generalised least squares.
    """
    valid = np.isfinite(value) & np.isfinite(deviation)
    first, last = np.argmax(valid, axis=1), valid.shape[1] - 1 - np.argmax(valid[:, ::-1], axis=1)
    determined = (valid.sum(axis=1) > 1) & (time[last] > time[first])
    span = np.where(determined, time[last] - time[first], 1.0)
    t = np.clip((time - time[first][:, None]) / span[:, None], 0.0, 1.0)
    y, u = np.where(valid, value, 0.0), np.where(valid, deviation, 1.0)
    gains = _NODES if gain_scatters else _NODES[:1]
    walk, gain = (grid.ravel() for grid in np.meshgrid(_NODES, gains, indexing="ij"))
    weights, *smoothed = _posterior(t, y, u, valid, walk, gain)
    rows = np.arange(len(value))
    difference = (y[rows, last] - y[rows, first])[:, None] + np.zeros(len(gain))
    differences = difference, np.sqrt((u[rows, last] ** 2 + u[rows, first] ** 2)[:, None] + 2 * gain**2)
    few = valid.sum(axis=1) < _SMOOTHED
    stated = np.where(few, *(_summary(weights, mean, spread) for mean, spread in (differences, smoothed)))
    return Changes(*(np.where(determined, column, np.nan) for column in stated))


def _summary(weights: Floats, mean: Floats, spread: Floats) -> Floats:
    """Mean, standard deviation, interval and p-value (5, series) of mixtures of normals (series, nodes)."""
    centre = (weights * mean).sum(axis=1)
    variance = (weights * (spread**2 + (mean - centre[:, None]) ** 2)).sum(axis=1)
    low, high = (mixture_quantile(weights, mean, spread, q) for q in ((1 - LEVEL) / 2, (1 + LEVEL) / 2))
    below = (weights * ndtr(-mean / spread)).sum(axis=1)
    return np.array([centre, np.sqrt(variance), low, high, 2 * np.minimum(below, 1 - below)])


def _connected_dates(valid: Mask) -> Mask:
    """The largest group of dates (dates,) connected by common sensors."""
    shared = (valid.astype(float).T @ valid.astype(float)) > 0
    remaining, largest = set(range(valid.shape[1])), np.zeros(valid.shape[1], dtype=bool)
    while remaining:
        group = np.zeros(valid.shape[1], dtype=bool)
        group[remaining.pop()] = True
        while (wider := group | shared[group].any(axis=0)).sum() > group.sum():
            group = wider
        remaining -= set(np.flatnonzero(group).tolist())
        largest = group if group.sum() > largest.sum() else largest
    return largest


def _median_polished(y: Floats, valid: Mask, weight: Floats) -> Floats:
    """The residual of y after each date's weighted median and each sensor's weighted mean (sensors, dates)."""
    residual = np.where(valid, y, 0.0)
    total = np.maximum(weight.sum(axis=1), 1e-300)
    for _ in range(_POLISHES):
        residual = np.where(valid, residual - ((weight * residual).sum(axis=1) / total)[:, None], 0.0)
        medians = np.array(
            [_median(residual[recorded, date], weight[recorded, date]) for date, recorded in enumerate(valid.T)]
        )
        residual = np.where(valid, residual - medians, 0.0)
        if np.abs(medians).max(initial=0.0) < _LEAST_DEVIATION:
            break
    return np.where(valid, residual - ((weight * residual).sum(axis=1) / total)[:, None], 0.0)


def _median(values: Floats, weights: Floats) -> float:
    """The weighted median, interpolated at half of the weight; 0 for no values."""
    if not len(values):
        return 0.0
    order = np.argsort(values)
    below = np.cumsum(weights[order]) - weights[order] / 2
    return float(np.interp(weights.sum() / 2, below, values[order]))


def _scatter_of_others(score: Floats, freedom: Floats) -> Floats:
    """The scatter of the other sensors from date to date relative to their uncertainties (sensors,), which assume the
    gain scatter of a usual rig. The median of squares is used, so that a second departing sensor has no effect."""
    counted = freedom > 0
    if counted.sum() < FEWEST_SENSORS:
        return np.ones(len(score))
    usual = np.where(counted, score / np.where(counted, chdtri(np.maximum(freedom, 1), 0.5), 1.0), np.nan)
    typical = np.array([np.nanmedian(np.delete(usual, sensor)) for sensor in range(len(score))])
    others = counted.sum() - 1
    return np.sqrt((_PRIOR_SENSORS + others * typical) / (_PRIOR_SENSORS + others))


def _weighted(y: Floats, valid: Mask, deviation: Floats) -> tuple[Floats, Floats]:
    """Each date's level, of mean 0 over dates, and its standard deviation by weighted least squares; NaN without a
    sensor."""
    weight = valid / deviation**2
    of_sensor = np.maximum(weight.sum(axis=1), 1e-300)
    information = np.diag(weight.sum(axis=0)) - weight.T @ (weight / of_sensor[:, None])
    mean = (weight * y).sum(axis=1) / of_sensor
    inverse = np.linalg.pinv(information, hermitian=True)
    level = inverse @ (weight * (y - mean[:, None])).sum(axis=0)
    total = weight.sum(axis=0)
    recorded_dates = np.flatnonzero(total > 0)
    with np.errstate(divide="ignore"):
        deviation_of_level = np.where(total > 0, total**-0.5, np.nan)
    if len(recorded_dates) > 1:  # as if dates were independent, with the contrast of the two ends as it is
        ends = recorded_dates[[0, -1]]
        contrast = float(np.array([-1.0, 1.0]) @ inverse[np.ix_(ends, ends)] @ np.array([-1.0, 1.0]))
        deviation_of_level *= np.sqrt(contrast / float((deviation_of_level[ends] ** 2).sum()))
    return np.where(total > 0, level, np.nan), deviation_of_level


def _posterior(
    t: Floats, value: Floats, deviation: Floats, valid: Mask, walk: Floats, gain: Floats
) -> tuple[Floats, Floats, Floats]:
    """Weight, mean and standard deviation of b + w(1) at each node of (q, g), (series, nodes) each."""
    columns = np.stack([value, np.ones_like(value), t], axis=2)
    series = len(value)
    at = np.zeros((series, len(walk), 3))
    variance, log_volume = np.zeros((series, len(walk))), np.zeros((series, len(walk)))
    products = np.zeros((series, len(walk), 3, 3))
    for date in range(value.shape[1]):
        if date:
            variance = variance + walk**2 * (t[:, date] - t[:, date - 1])[:, None]
        total = variance + gain**2 + np.maximum(deviation[:, [date]], _LEAST_DEVIATION) ** 2
        weight = valid[:, [date]] / total
        innovation = columns[:, date, None, :] - at
        products += (weight[..., None] * innovation)[..., None] * innovation[..., None, :]
        log_volume += valid[:, [date]] * np.log(total)
        towards = variance * weight
        at = at + towards[..., None] * innovation
        variance = variance * (1 - towards)
    information, moment = products[..., 1:, 1:] + 1e-9 * np.eye(2), products[..., 1:, 0]
    inverse = np.linalg.inv(information)
    line = np.einsum("snij,snj->sni", inverse, moment)
    contrast = np.array([0.0, 1.0]) - at[..., 1:]
    squares = products[..., 0, 0] - (moment * line).sum(axis=2)
    density = -0.5 * (log_volume + np.linalg.slogdet(information)[1] + squares) + _log_prior(walk, gain)
    plain = (walk == 0) & (gain == 0)
    density = np.where((valid.sum(axis=1) < FEWEST_DATES)[:, None] & ~plain, -np.inf, density)
    weights = np.exp(density - density.max(axis=1, keepdims=True))
    spread = variance + np.einsum("sni,snij,snj->sn", contrast, inverse, contrast)
    mean = at[..., 0] + (line * contrast).sum(axis=2)
    return weights / weights.sum(axis=1, keepdims=True), mean, np.sqrt(np.maximum(spread, 1e-18))


def _log_prior(walk: Floats, gain: Floats) -> Floats:
    """ln of the prior weight of each node, the cells of the grid included."""
    densities = 1 / (1 + (_NODES / _WALK_SCALE) ** 2), np.exp(-0.5 * (_NODES / _GAIN_SCALE) ** 2)
    total = np.zeros(len(walk))
    for at, density, none in zip((walk, gain), densities, (_NO_WALK, _NO_GAIN), strict=True):
        cells = np.gradient(_NODES) * density
        cells *= (1 - none) / cells[1:].sum()
        cells[0] = none
        total += np.log(np.maximum(cells[np.searchsorted(_NODES, at)], 1e-300))
    return total
