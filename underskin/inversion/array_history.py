"""The history of an array's d33 over several dates: the level common to all sensors, their departures and deaths, the
changes of both, and the sentences on them; and the drift of one repeatedly measured quantity (`trend`).

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

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtrc, chdtri, ndtr, ndtri

from underskin.inversion.mixed_model import LEVEL, mixture_quantile
from underskin.inversion.sensor_flags import error_from_median, is_alive
from underskin.units import Floats, Indices, Mask

FEWEST = 3  # two points always lie on a line
SIGNIFICANT = 0.05


@dataclass(frozen=True)
class Trend:
    """A straight line through the values; `p_value` is that of the slope if there were no drift."""

    slope: float  # unit of the values per unit of time
    slope_uncertainty: float  # one standard deviation
    p_value: float


def trend(time: ArrayLike, value: ArrayLike, uncertainty: ArrayLike) -> Trend | None:
    """A straight line by weighted least squares, weights 1/u².

    Where the values scatter more than by u, the uncertainty grows by the Birge ratio √(χ²/(n−2)); it never shrinks.
    The slope is tested two-sided against Student's t with n−2 degrees of freedom.

    Parameters
    ----------
    time, value, uncertainty : (n,) arrays
        Times, values and their standard uncertainties u, in any units.

    Returns
    -------
    Trend or None
        None for fewer than three values, or times that do not differ.
    """
    from scipy.special import stdtr

    t, y, u = (np.asarray(given, dtype=float) for given in (time, value, uncertainty))
    if len(t) < FEWEST or np.ptp(t) == 0:
        return None
    weights = 1 / np.square(np.maximum(u, 1e-6 * np.abs(y).max() + np.finfo(float).tiny))
    total = weights.sum()
    centred = t - (weights @ t) / total
    spread = weights @ centred**2
    slope = float(weights @ (centred * y) / spread)
    residuals = y - (weights @ y) / total - slope * centred
    freedom = len(t) - 2
    birge = max(1.0, float(weights @ residuals**2) / freedom)
    error = float(np.sqrt(birge / spread))
    return Trend(slope, error, float(2 * stdtr(freedom, -abs(slope / error))))


def interval(slope: float, slope_uncertainty: float, count: int) -> tuple[float, float]:
    """The slope's 95 % interval through `count` values, by Student's t of count − 2 degrees of freedom."""
    from scipy.special import stdtrit

    half = float(stdtrit(count - 2, 1 - SIGNIFICANT / 2)) * slope_uncertainty
    return slope - half, slope + half


def holm(p_values: Sequence[float]) -> list[float]:
    """The p-values adjusted for their number, in the order given (Holm 1979)."""
    order = np.argsort(p_values, kind="stable")
    adjusted = np.empty(len(p_values))
    factors = np.arange(len(p_values), 0, -1)
    adjusted[order] = np.minimum(1.0, np.maximum.accumulate(np.asarray(p_values)[order] * factors))
    return adjusted.tolist()


BY_CHANCE = 0.05  # family-wise false-alarm probability


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
        gap = np.abs(values[valid] - np.median(values[valid]))
        differs[valid] = gap > threshold(count) * error_from_median(uncertainties[valid])
    return differs


FEWEST_DATES = 3  # needed to separate scatter from change
_SMOOTHED = 6  # dates: with five the smoothed change is at most a fourth more precise than the difference of the ends
FEWEST_SENSORS = 3  # needed to distinguish one from the others
PRIOR_SENSORS = 4.0  # weight of the stated uncertainties against the observed scatter, in sensors
# Priors: the probability of none, and the scale. g: gains of single recordings scatter by 1 to 5 %, of which mounting
# and amplifier are a part (PHYSICS.md, section 8); a chain that stays as it was differs by a percent from date to date,
# seldom by three, so half-normal. q: as wide as the sensors of an array are spread (mixed_model), half-Cauchy.
_NO_GAIN, GAIN_SCALE = 0.25, 0.0125
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
    counted, departs = freedom > 0, np.zeros(len(value), dtype=bool)
    scatter = _scatter_of_others(score, freedom, departs)
    if counted.sum() >= FEWEST_SENSORS:
        chance = chdtrc(np.maximum(freedom, 1), score / scatter**2)
        departs = counted & (chance < BY_CHANCE / counted.sum())
    pooled = counted & ~departs
    if departs.any():  # the scatter of all contains theirs
        scatter = _scatter_of_others(score, freedom, departs)
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


def _scatter_of_others(score: Floats, freedom: Floats, departs: Mask) -> Floats:
    """The scatter of the other sensors from date to date relative to their uncertainties (sensors,), which assume the
    gain scatter of a usual rig. The median of squares is used, so that a second departing sensor has no effect. Of two
    sensors the scatter is unknown, as both depart from their mean by the same: but not of two beside departing ones,
    whose residuals are from the median of all."""
    counted = (freedom > 0) & ~departs
    if counted.sum() < FEWEST_SENSORS - int(departs.any()):
        return np.ones(len(score))
    usual = np.where(counted, score / np.where(counted, chdtri(np.maximum(freedom, 1), 0.5), 1.0), np.nan)
    typical = np.array([np.nanmedian(np.delete(usual, sensor)) for sensor in range(len(score))])
    others = counted.sum() - 1
    return np.sqrt((PRIOR_SENSORS + others * typical) / (PRIOR_SENSORS + others))


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
    densities = 1 / (1 + (_NODES / _WALK_SCALE) ** 2), np.exp(-0.5 * (_NODES / GAIN_SCALE) ** 2)
    total = np.zeros(len(walk))
    for at, density, none in zip((walk, gain), densities, (_NO_WALK, _NO_GAIN), strict=True):
        cells = np.gradient(_NODES) * density
        cells *= (1 - none) / cells[1:].sum()
        cells[0] = none
        total += np.log(np.maximum(cells[np.searchsorted(_NODES, at)], 1e-300))
    return total


TWO_DATES = (
    "two dates do not tell this from another gain of the chain, amplifier or mounting, which would look the same and "
    "is not in the interval"
)

_MOST_NAMED = 5  # sensors of each sort


def array_change_in_words(
    value: float, low: float, high: float, d33: Sequence[float], between: str, days: int | None, by: str = ""
) -> str:
    """ "d33 of the array fell by 7.8 % (95 %: 7.1 to 8.5) in 182 days, between 2017-05-02 and … (14.29, … pC/N)".

    `value` with the 95 % interval `low` to `high` is relative; `d33` [pC/N] is that of each date, `by` what
    it is calculated with beside the declared skin, in words.
    """
    span = between if days is None else f"in {days} day{'' if days == 1 else 's'}, {between}"
    values = f"{', '.join(f'{level:.4g}' for level in d33)} pC/N{f' with {by}' if by else ''}"
    if low * high <= 0:
        sizes = f"{100 * value:+z.1f} % (95 %: {100 * low:+z.1f} to {100 * high:+z.1f})"
        return f"d33 of the array did not change beyond chance {span}: by {sizes}, {values}"
    way = "fell" if value < 0 else "rose"
    least, most = sorted((abs(100 * low), abs(100 * high)))
    return f"d33 of the array {way} by {abs(100 * value):.1f} % (95 %: {least:.1f} to {most:.1f}) {span} ({values})"


def departures_in_words(
    of_array: str,
    departures: Sequence[tuple[str, float, float, float]],
    dead: Mapping[str, str],
    *,
    few_dates: bool,
) -> str:
    """The clause on the array, then the departing sensors (relative change, low, high), and those dead since a date."""
    departing = [sensor for sensor, *_ in departures]
    without = f" without {', '.join(departing[:_MOST_NAMED])}" if 0 < len(departing) <= _MOST_NAMED else ""
    parts = [of_array.replace("d33 of the array", f"d33 of the array{without}", 1)]
    if few_dates:
        parts.append(TWO_DATES)
    parts += [
        f"{sensor} changed by {100 * value:+z.1f} % ({100 * low:+z.1f} to {100 * high:+z.1f}) relative to the others"
        for sensor, value, low, high in departures[:_MOST_NAMED]
    ]
    parts += [f"{sensor} is dead since {date}" for sensor, date in list(dead.items())[:_MOST_NAMED]]
    more = sum(max(len(sensors) - _MOST_NAMED, 0) for sensors in (departures, dead))
    return "; ".join([*parts, *([f"and {more} more sensors"] if more else [])])


_DAY_S = 86400.0


@dataclass(frozen=True)
class Departure:
    """The change of a sensor's d33 relative to the array's between its first and last campaign, with its 95 % interval;
    whether it is significant over all sensors (Holm)."""

    sensor: str
    value: float
    low: float
    high: float
    significant: bool


@dataclass(frozen=True, eq=False)
class ArrayHistory:
    """`d33` [pC/N] of the array on each of `dates`, with the standard uncertainty between dates, over the sensors
    `pooled`; `value` with `low` and `high` is its relative change from the first to the last in `days`."""

    dates: tuple[int, ...]  # numbers of the campaigns
    d33: Floats
    uncertainty: Floats
    pooled: tuple[str, ...]
    days: int
    value: float
    low: float
    high: float
    departures: tuple[Departure, ...]
    dead_since: dict[str, int]  # by sensor, the number of the campaign
    statement: str

    @property
    def significant(self) -> bool:
        """Whether the interval of the change excludes 0."""
        return self.low * self.high > 0


def array_history(
    sensors: Sequence[str], moments: Sequence[datetime], d33: Floats, uncertainty: Floats
) -> ArrayHistory | None:
    """The history from d33 with its standard uncertainty [pC/N] (sensors, campaigns), campaigns in order of time, NaN
    for missing values; None where fewer than two campaigns, at least a day apart, share a responding sensor.

    A sensor without charge beyond noise is excluded from the array from then on.
    """
    if len(moments) < 2:
        return None
    alive = _alive(d33, uncertainty)
    with np.errstate(divide="ignore", invalid="ignore"):
        value = np.where(alive, np.log(np.abs(d33)), np.nan)
        deviation = np.where(alive, uncertainty / np.abs(d33), np.nan)
    levels = array_levels(value, deviation)
    dated = np.flatnonzero(np.isfinite(levels.level))
    times = np.array([moment.timestamp() for moment in moments]) / _DAY_S
    if len(dated) < 2 or times[dated[-1]] - times[dated[0]] < 1:
        return None
    change = changes(times[dated], levels.level[None, dated], levels.deviation[None, dated], gain_scatters=True)
    size, low, high = (float(np.expm1(part[0])) for part in (change.value, change.low, change.high))
    departures = _departures(sensors, times, levels.departure, levels.departure_deviation)
    dead = _dead_since(sensors, alive, np.isfinite(d33))
    of_array = np.exp(levels.level[dated])
    days = round(float(times[dated[-1]] - times[dated[0]]))
    first, last = (moments[date].strftime("%Y-%m-%d") for date in dated[[0, -1]])
    array_clause = array_change_in_words(size, low, high, of_array.tolist(), f"between {first} and {last}", days)
    significant = [
        (departure.sensor, departure.value, departure.low, departure.high)
        for departure in departures
        if departure.significant
    ]
    died = {sensor: moments[number].strftime("%Y-%m-%d") for sensor, number in dead.items()}
    return ArrayHistory(
        tuple(dated.tolist()),
        of_array,
        of_array * levels.deviation[dated],
        tuple(name for name, counts in zip(sensors, levels.pooled, strict=True) if counts),
        days,
        size,
        low,
        high,
        departures,
        dead,
        departures_in_words(array_clause, significant, died, few_dates=len(dated) < FEWEST_DATES and low * high > 0),
    )


def _alive(d33: Floats, uncertainty: Floats) -> Mask:
    """Which sensors respond (sensors, campaigns), compared with those of the same campaign."""
    columns = [is_alive(value, of_value) for value, of_value in zip(d33.T, uncertainty.T, strict=True)]
    return np.array(columns, dtype=bool).T.reshape(d33.shape)


def _dead_since(sensors: Sequence[str], alive: Mask, recorded: Mask) -> dict[str, int]:
    """The sensors that are dead in their last campaign, with the first campaign of that state."""
    dead_since: dict[str, int] = {}
    for name, alive_dates, recorded_dates in zip(sensors, alive, recorded, strict=True):
        present: Indices = np.flatnonzero(recorded_dates)
        responded = np.flatnonzero(alive_dates & recorded_dates)
        if len(present) and not alive_dates[present[-1]]:
            after = present if not len(responded) else present[present > responded[-1]]
            dead_since[name] = int(after[0])
    return dead_since


def _departures(sensors: Sequence[str], times: Floats, value: Floats, deviation: Floats) -> tuple[Departure, ...]:
    """The departures of sensors with at least two campaigns; empty with fewer than FEWEST_SENSORS of them."""
    estimates = changes(times, value, deviation, gain_scatters=False)
    rows = np.flatnonzero(np.isfinite(estimates.value)).tolist()
    if len(rows) < FEWEST_SENSORS:
        return ()
    adjusted = holm(estimates.p_value[rows].tolist())
    ends = np.expm1(np.column_stack([estimates.value, estimates.low, estimates.high])[rows]).tolist()
    return tuple(
        Departure(sensors[row], value, low, high, chance < SIGNIFICANT)
        for row, (value, low, high), chance in zip(rows, ends, adjusted, strict=True)
    )
