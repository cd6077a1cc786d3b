"""Defects of a curve's channels that have nothing to do with the sample: a force that saturates, and one that carries
an error that is periodic in the travel.

Compression and depth are positive here, see curve_signs.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from underskin.recordings.curve_signs import TRAVEL, falling, turning_points
from underskin.units import Floats, Indices, Mask

_EQUAL = 5  # samples in a row, at least, that read the same where a force saturates
_MOVED = 0.02  # of the range of travel, at least, over which they do
_LONGER = 4.0  # times as far as any other value is read on end: steps of a converter are as long everywhere
_MOST_OF_WAY, _PACE = 0.75, 0.5  # of the way at the limit, and of the stage's pace, at least: creep is slower by then
_DEEP = 0.8  # of the other samples lie less deep than those that saturate
_SHALLOW = 0.05  # of the samples, the shallowest, whose median is what the air reads
_AIR, _ABOVE = 0.05, 2.5  # of the range of force, and standard deviations there, up to which means lie in the air
_FEWEST = 24  # samples there at least
_PERIODS = 1.5  # in the air, at least: less is a drift
_SHORTEST = 4.0  # samples in a period, at least
_OVER_RANGE = 6.0  # periods in the range of travel, at least: what is slower may be the contact's own
_SINE = 0.25  # of the squares, at most, that a sine leaves of what else is left
_LARGE, _LEAST = 4.0, 2e-3  # amplitude over the noise beside it, and over the largest force
_AROUND = 0.8, 1.25  # times the period in the air, between which that of the whole curve is sought
_OF_CYCLES, _FINER = 12, 25  # periods tried for each cycle in the range; and between two of them
_IN_AIR = 0.25  # of a cycle in the air, between the frequencies tried there
_MOST_SAMPLES = 1500  # by which a period is told
_KNOTS = 2.0  # periods between the knots of the splines that stand for the contact


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
        """What it adds to the force [N] at a travel [mm]."""
        phase = 2 * np.pi * travel / self.period
        return np.asarray(self.cosine * np.cos(phase) + self.sine * np.sin(phase))


def saturated(travel: Floats, force: Floats, *, sphere: bool) -> Mask:
    """Which samples (samples,) read the largest, or the least, force of all while a sphere or a platen moves on, and
    lie deeper than the others: the air may read one value as well, and a load that is held as the sample creeps."""
    found = np.zeros(len(force), dtype=bool)
    if not np.ptp(force) or not np.ptp(travel):
        return found
    runs = _runs(travel, force)
    extremes = float(force.max()), float(force.min())
    between = ~np.isin(force, extremes)
    sign = -1.0 if TRAVEL in falling(force[between], travel[between], sphere=sphere) else 1.0
    depth = sign * travel
    air = float(np.quantile(force[depth <= np.quantile(depth, _SHALLOW)], 0.5, method="nearest"))
    usual = max((moved for rows, moved in runs if force[rows[0]] not in (*extremes, air)), default=0.0)
    for extreme in extremes:
        at_limit = force == extreme
        there = [run for run in runs if force[run[0][0]] == extreme]
        longest, moved = max(there, key=lambda run: run[1], default=(np.zeros(0, dtype=np.intp), 0.0))
        if moved < max(_MOVED * np.ptp(travel), _LONGER * usual) or (~at_limit).sum() < _EQUAL:
            continue
        is_deep = np.median(depth[at_limit]) > np.quantile(depth[~at_limit], _DEEP)
        if is_deep and _goes_on(travel, longest):
            found |= at_limit
    return found


def _goes_on(travel: Floats, rows: Indices) -> bool:
    """Whether the travel keeps its pace where these samples begin to read the limit, or up to where they end."""
    first, last = int(rows[0]), int(rows[-1])
    return _keeps_pace(travel[rows], travel[first::-1]) or _keeps_pace(travel[rows[::-1]], travel[last:])


def _keeps_pace(inside: Floats, outside: Floats) -> bool:
    """Whether the travel at the limit, from its edge on, goes as fast as beside it, away from the edge.

    Over the samples that most of the way at the limit takes, so that a hold of the stage at its end does not count.
    """
    gone = np.abs(inside - inside[0])
    count = int(np.argmax(gone >= _MOST_OF_WAY * gone.max()))
    beside = min(count, len(outside) - 1)
    return beside > 0 and bool(gone[count] / count > _PACE * abs(outside[beside] - outside[0]) / beside)


def _runs(travel: Floats, force: Floats) -> list[tuple[Indices, float]]:
    """The samples in a row that read the same force, where there are enough, and how far they go."""
    starts = np.flatnonzero(np.append(True, np.diff(force) != 0))
    ends = np.append(starts[1:], len(force))
    long = ends - starts >= _EQUAL
    rows = [np.arange(first, end) for first, end in zip(starts[long].tolist(), ends[long].tolist(), strict=True)]
    return [(own, float(np.ptp(travel[own]))) for own in rows]


def periodic_error(travel: Floats, force: Floats) -> PeriodicError | None:
    """A sine over the travel in the force that the air shows as well as the contact; None where there is none.

    Its period is told in the air, and then where it leaves least of the whole curve beside a spline on each way, which
    stands for the contact whatever its law. Of many samples means are taken: single ones would show hum of a frequency
    above half of theirs as a slow change. Means over a part x of a period show sin(πx)/(πx) of the amplitude; and what
    is left in them of hum, the samples do not show at that period.
    """
    samples, is_mean = (travel, force), len(travel) > _MOST_SAMPLES
    travel, force = _means(travel), _means(force)
    air = _in_air(travel, force)
    if air.sum() < _FEWEST:
        return None
    first = _period_in_air(travel[air], force[air])
    if first is None or first * _OVER_RANGE > np.ptp(travel):
        return None
    low, high = first * _AROUND[0], first * _AROUND[1]
    count = int(_OF_CYCLES * (high - low) / first * np.ptp(travel) / first) + 2
    step = (high - low) / (count - 1)
    near = _best_of(travel, force, np.linspace(low, high, count))[0].period
    error, left, without = _best_of(travel, force, np.linspace(near - step, near + step, _FINER))
    noise = float(np.sqrt(left / len(travel)))
    largest = float(np.abs(force - np.median(force[air])).max())
    if left > _SINE * without or error.amplitude < max(_LARGE * noise, _LEAST * largest):
        return None
    shown = float(np.sinc(np.median(np.abs(np.diff(travel))) / error.period)) if is_mean else 1.0
    error = PeriodicError(error.period, error.cosine / shown, error.sine / shown)
    return error if _amplitude(*samples, error.period, travel[air].max()) > error.amplitude / 2 else None


def _amplitude(travel: Floats, force: Floats, period: float, end: float) -> float:
    """Of a sine of this period beside a line in the force of all samples of the air, up to the travel `end`."""
    air = travel <= end
    place, phase = travel[air] - travel[air].mean(), 2 * np.pi * travel[air] / period
    design = np.column_stack([np.ones_like(place), place, np.cos(phase), np.sin(phase)])
    fitted = np.linalg.lstsq(design, force[air], rcond=None)[0]
    return float(np.hypot(fitted[2], fitted[3]))


def _means(column: Floats) -> Floats:
    """Over at most so many blocks of samples."""
    starts = np.unique(np.linspace(0, len(column), min(len(column), _MOST_SAMPLES), endpoint=False).astype(np.intp))
    return np.asarray(np.add.reduceat(column, starts) / np.diff(np.append(starts, len(column))))


def _best_of(travel: Floats, force: Floats, periods: Floats) -> tuple[PeriodicError, float, float]:
    """Of these periods, see _beside_spline."""
    return min((_beside_spline(travel, force, period) for period in periods.tolist()), key=lambda one: one[1])


def _in_air(travel: Floats, force: Floats) -> Mask:
    """The samples at less travel than where means over the travel leave the level of the shallowest."""
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
    """The period of the sine that leaves least of samples in the air beside a straight line, where that is plain."""
    span = float(np.ptp(travel))
    step = span / (len(travel) / max(len(turning_points(travel)) - 1, 1))
    if not step > 0 or span < 2 * _PERIODS * _SHORTEST * step:
        return None
    place = (travel - travel.mean()) / span
    line = np.column_stack([np.ones_like(place), place])
    beside_line = force - line @ np.linalg.lstsq(line, force, rcond=None)[0]
    frequencies = np.arange(_PERIODS, span / (_SHORTEST * step), _IN_AIR)
    left = []
    for frequency in frequencies.tolist():
        phase = 2 * np.pi * frequency * place
        design = np.column_stack([line, np.cos(phase), np.sin(phase)])
        rest = force - design @ np.linalg.lstsq(design, force, rcond=None)[0]
        left.append(float(rest @ rest))
    best = int(np.argmin(left))
    if left[best] > _SINE * float(beside_line @ beside_line):
        return None
    return span / float(frequencies[best])


def _beside_spline(travel: Floats, force: Floats, period: float) -> tuple[PeriodicError, float, float]:
    """The sine of a period beside a cubic spline on each way, and the squares that are left with and without it."""
    turns = turning_points(travel)
    phase = 2 * np.pi * travel / period
    sine = np.column_stack([np.cos(phase), np.sin(phase)])
    rest, force_rest = sine.copy(), force.copy()
    for first, last in zip(turns[:-1].tolist(), turns[1:].tolist(), strict=True):
        rows = np.arange(first, last + (last == len(travel) - 1))
        basis = _splines(travel[rows], _KNOTS * period)
        both = np.column_stack([sine[rows], force[rows]])
        left = both - basis @ np.linalg.lstsq(basis, both, rcond=None)[0]
        rest[rows], force_rest[rows] = left[:, :2], left[:, 2]
    amplitudes = np.linalg.lstsq(rest, force_rest, rcond=None)[0]
    left = force_rest - rest @ amplitudes
    found = PeriodicError(period, float(amplitudes[0]), float(amplitudes[1]))
    return found, float(left @ left), float(force_rest @ force_rest)


def _splines(travel: Floats, apart: float) -> Floats:
    """Cubic B-splines over a way, with knots so far apart (samples, splines)."""
    low, high = float(travel.min()), float(travel.max())
    count = max(int(np.ceil((high - low) / apart)), 1)
    inner = np.linspace(low, high, count + 1)
    knots = np.concatenate([np.full(3, low), inner, np.full(3, high)])
    return np.asarray(BSpline.design_matrix(travel, knots, 3).toarray())
