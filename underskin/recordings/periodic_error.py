"""An error of a force that is periodic in the travel: interference of light, a screw, an encoder; or hum."""

from dataclasses import dataclass

import numpy as np

from underskin.recordings.curve_course import turning_points
from underskin.units import Floats, Mask

_AIR, _ABOVE = 0.05, 2.5  # of the range of force, and standard deviations there: limits of means in air
_FEWEST = 24  # least number of samples in air
_PERIODS = 1.5  # least number of periods in air: fewer is a drift
_SHORTEST = 4.0  # least number of samples in a period
_OVER_RANGE = 6.0  # least number of periods in the range of travel: slower variations may be the contact's own
_SINE = 0.25  # largest ratio of the sums of squares with and without the sine
_LARGE, _LEAST_AMPLITUDE = 4.0, 2e-3  # least amplitude over the residual noise, and over the largest force
_AROUND = 0.8, 1.25  # times the period in air: range in which the period of the whole curve is sought
_OF_CYCLES, _FINER = 12, 25  # periods tried for each cycle in the range; and between two of them
_IN_AIR = 0.25  # of a cycle in air: step of the frequencies tried there
_MOST_SAMPLES = 1500  # samples from which a period is estimated
_KNOTS = 2.0  # periods between the knots of the splines that represent the contact


@dataclass(frozen=True)
class PeriodicError:
    """A sine over the travel, `cosine` cos(2πz/p) + `sine` sin(2πz/p) [N], of the `period` p [mm]."""

    period: float
    cosine: float
    sine: float

    @property
    def amplitude(self) -> float:
        """In N."""
        return float(np.hypot(self.cosine, self.sine))

    def at(self, travel: Floats) -> Floats:
        """The error of the force [N] at a travel [mm]."""
        phase = 2 * np.pi * travel / self.period
        return np.asarray(self.cosine * np.cos(phase) + self.sine * np.sin(phase))


def periodic_error(travel: Floats, force: Floats) -> PeriodicError | None:
    """A sine over the travel in the force, present in air as well as in contact; None without one.

    Its period is estimated in air, then by least squares over the whole curve together with a spline on each leg, which
    represents the contact whatever its law. Many samples are averaged, since hum above the Nyquist frequency of thinned
    samples would be aliased. Means over a part x of a period keep sin(πx)/(πx) of the amplitude; what hum remains in
    them is absent from the samples at that period.
    """
    samples, is_mean = (travel, force), len(travel) > _MOST_SAMPLES
    travel, force = _means(travel), _means(force)
    air = _in_air(travel, force)
    if air.sum() < _FEWEST or not np.ptp(force[air]):
        return None
    period_in_air = _period_in_air(travel[air], force[air])
    if period_in_air is None or period_in_air * _OVER_RANGE > np.ptp(travel):
        return None
    low, high = period_in_air * _AROUND[0], period_in_air * _AROUND[1]
    count = int(_OF_CYCLES * (high - low) / period_in_air * np.ptp(travel) / period_in_air) + 2
    step = (high - low) / (count - 1)
    coarse_period = _best_of(travel, force, np.linspace(low, high, count))[0].period
    error, residual, total = _best_of(travel, force, np.linspace(coarse_period - step, coarse_period + step, _FINER))
    noise = float(np.sqrt(residual / len(travel)))
    largest = float(np.abs(force - np.median(force[air])).max())
    if residual > _SINE * total or error.amplitude < max(_LARGE * noise, _LEAST_AMPLITUDE * largest):
        return None
    kept_by_means = float(np.sinc(np.median(np.abs(np.diff(travel))) / error.period)) if is_mean else 1.0
    error = PeriodicError(error.period, error.cosine / kept_by_means, error.sine / kept_by_means)
    return error if _amplitude(*samples, error.period, travel[air].max()) > error.amplitude / 2 else None


def _amplitude(travel: Floats, force: Floats, period: float, end: float) -> float:
    """Amplitude of a sine of this period, fitted with a line to the force of all samples in air, up to travel `end`."""
    air = travel <= end
    position, phase = travel[air] - travel[air].mean(), 2 * np.pi * travel[air] / period
    design = np.column_stack([np.ones_like(position), position, np.cos(phase), np.sin(phase)])
    fitted = np.linalg.lstsq(design, force[air], rcond=None)[0]
    return float(np.hypot(fitted[2], fitted[3]))


def _means(column: Floats) -> Floats:
    """Means over at most `_MOST_SAMPLES` blocks."""
    starts = np.unique(np.linspace(0, len(column), min(len(column), _MOST_SAMPLES), endpoint=False).astype(np.intp))
    return np.asarray(np.add.reduceat(column, starts) / np.diff(np.append(starts, len(column))))


def _best_of(travel: Floats, force: Floats, periods: Floats) -> tuple[PeriodicError, float, float]:
    """The fit with the least sum of squares among these periods; see `_sine_beside_spline`."""
    return min((_sine_beside_spline(travel, force, period) for period in periods.tolist()), key=lambda fit: fit[1])


def _in_air(travel: Floats, force: Floats) -> Mask:
    """The samples at less travel than that at which means over the travel leave the level of the shallowest samples."""
    order = np.argsort(travel, kind="stable")
    count = max(len(order) // 40, 1)
    starts = np.arange(0, len(order), count)
    means = np.add.reduceat(force[order], starts) / np.diff(np.append(starts, len(order)))
    first = means[: max(2, len(means) // 10)]
    least = max(_AIR * float(np.ptp(force)), _ABOVE * float(np.std(first)))
    risen = np.flatnonzero(np.abs(means - first.mean()) > least)
    end = starts[risen[0]] if len(risen) else len(order)
    air = np.zeros(len(order), dtype=bool)
    air[order[:end]] = True
    return air


def _period_in_air(travel: Floats, force: Floats) -> float | None:
    """The period of the best-fitting sine with a straight line in air; None where it does not explain enough."""
    span = float(np.ptp(travel))
    step = span / (len(travel) / max(len(turning_points(travel)) - 1, 1))
    if not step > 0 or span < 2 * _PERIODS * _SHORTEST * step:
        return None
    position = (travel - travel.mean()) / span
    line = np.column_stack([np.ones_like(position), position])
    detrended = force - line @ np.linalg.lstsq(line, force, rcond=None)[0]
    frequencies = np.arange(_PERIODS, span / (_SHORTEST * step), _IN_AIR)
    misfits = []
    for frequency in frequencies.tolist():
        phase = 2 * np.pi * frequency * position
        design = np.column_stack([line, np.cos(phase), np.sin(phase)])
        residual = force - design @ np.linalg.lstsq(design, force, rcond=None)[0]
        misfits.append(float(residual @ residual))
    best = int(np.argmin(misfits))
    if misfits[best] > _SINE * float(detrended @ detrended):
        return None
    return span / float(frequencies[best])


def _sine_beside_spline(travel: Floats, force: Floats, period: float) -> tuple[PeriodicError, float, float]:
    """The sine of a period fitted with a cubic spline on each leg, and the sums of squares with and without it."""
    turns = turning_points(travel)
    phase = 2 * np.pi * travel / period
    sine = np.column_stack([np.cos(phase), np.sin(phase)])
    sine_residual, force_rest = sine.copy(), force.copy()
    for first, last in zip(turns[:-1].tolist(), turns[1:].tolist(), strict=True):
        rows = np.arange(first, last + (last == len(travel) - 1))
        basis = _splines(travel[rows], _KNOTS * period)
        both = np.column_stack([sine[rows], force[rows]])
        residual = both - basis @ np.linalg.lstsq(basis, both, rcond=None)[0]
        sine_residual[rows], force_rest[rows] = residual[:, :2], residual[:, 2]
    amplitudes = np.linalg.lstsq(sine_residual, force_rest, rcond=None)[0]
    residual = force_rest - sine_residual @ amplitudes
    error = PeriodicError(period, float(amplitudes[0]), float(amplitudes[1]))
    return error, float(residual @ residual), float(force_rest @ force_rest)


def _splines(travel: Floats, apart: float) -> Floats:
    """Cubic B-splines over a leg, with knots `apart` in travel (samples, splines)."""
    low, high = float(travel.min()), float(travel.max())
    count = max(int(np.ceil((high - low) / apart)), 1)
    inner = np.linspace(low, high, count + 1)
    knots = np.concatenate([np.full(3, low), inner, np.full(3, high)])
    from scipy.interpolate import BSpline  # takes 0.4 s to load, which few need

    return np.asarray(BSpline.design_matrix(travel, knots, 3).toarray())
