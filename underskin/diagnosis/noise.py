"""The noise of lines, curves, gains and positions, and its priors.

Priors that every hypothesis shares:

- gain scatter of a recording (standard deviation of its logarithm): log-uniform from 1 to 5 %, decreasing outside to
  a tenth at 0.3 and at 11 %: careful rigs are better than 1 %, poor ones worse than 5 %;
- positioning scatter, in x and y: zero with probability 0.7, else log-uniform from 0.05 to 0.3 mm, decreasing outside
  to a tenth at 0.02 and at 0.6 mm;
- line noise: its level as estimated from the lines' roughness, times a factor near 1.

Error that the samples of a curve share under every hypothesis. A cell has a zero F0 and a drift b in time (without
times, in the order of the samples) or along the travel (its gain is the recording's, as of FRFs): columns P with normal
coefficients, scaled to the prior's standard deviation. Where samples in the air show the zero, F0 is practically free;
else a tared cell is within a hundredth of the largest force. The drift over the curve is 2 % of the largest force, or a
larger one that the air shows; without air there is none. Of a cylinder, F0 is within a fiftieth of the largest force,
as for its modulus, and there is no drift. The position of the surface, friction in a stage and the idealisation of
every law also bend a curve a little. With s the force (at least 0.7 of the largest near the beginning of contact and
0.2 in the air), x the position along the curve (`path_fractions`) and η the size,

    ε ~ N(0, η² B + P Pᵀ),  B = s s' k(x − x'),

k the mean of Matérn-3/2 kernels of length 0.025 and 0.1 (the beginning of a contact, a grip that seats) and 0.4 (the
idealisation of a law). η is a parameter of every hypothesis: log-uniform from 0.1 to 1 %, decreasing outside, so that
3 % has 0.3 and 10 % 0.005 of that density: laws leave 0.3 to 5 % of the force of laboratories' elastomers.

Noise of single lines, from their roughness along frequency. Real and imaginary part each have variance
d² = rel(f)² A² + floor², A the recording's amplitude around the line. The part common to all recordings at a frequency
is subtracted, then each line is compared with its two neighbours,
    e_j = z_j − λ z_(j−1) − (1−λ) z_(j+1)   (linear in log f),   E|e_j|²/2 = d_j² + λ² d_(j−1)² + (1−λ)² d_(j+1)²,
which smooth misfit hardly affects. Steep changes, such as the flank of a resonance that moves with the preload, do:
where a law describes them, its prediction is subtracted too (`frf_problem`).
log rel² is piecewise linear in log f; it and the floor are fitted with Student's likelihood, so that outliers (mains, a
resonance between two lines) do not count, and the level is set by the median of |e|².
Where `coherence` γ² is given, (1 − γ²)/γ² is proportional to (d/A)² (with an unknown number of averages) and
stabilises it. It may miss noise that is not averaged, common to all recordings: many recordings carry little more
information on it than a few. Where lines are `uneven` (of a time series whose force has more power at one than at the
next), rel is larger by that factor.
"""

import itertools
import weakref
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import numpy as np
from scipy.optimize import minimize

from underskin.inversion.mixed_model import GAIN_RANGE, POSITION_RANGE
from underskin.mechanisms.base import Kind
from underskin.recordings.curve_course import LEAST_CONTACT, CurveLandmarks, back_in_air, leaves_line
from underskin.units import Complexes, Floats, Indices

GAIN_FALL = (0.6, 0.35)  # sd of the logarithm below and above
POSITION_FALL = (0.4, 0.3)  # the same of positions


@dataclass(frozen=True)
class Plateau:
    """A density of a logarithm: constant between two values, decreasing as half Gaussians outside.

    Normal where the two values are equal; uniform where `area`, the integral with height 1, counts only the range.
    """

    low: float
    high: float
    fall_low: float
    fall_high: float
    area: float

    @classmethod
    def of(cls, limits: tuple[float, float], falls: tuple[float, float]) -> "Plateau":
        """From the values, not their logarithms."""
        low, high = np.log(limits).tolist()
        return cls(low, high, *falls, high - low + float(np.sqrt(np.pi / 2)) * sum(falls))

    @classmethod
    def normal(cls, mean: float, sd: float) -> "Plateau":
        """A normal density."""
        return cls(mean, mean, sd, sd, sd * float(np.sqrt(2 * np.pi)))

    @property
    def middle(self) -> float:
        """The middle of the constant part."""
        return (self.low + self.high) / 2

    @property
    def row(self) -> tuple[float, float, float, float, float]:
        """Its numbers, with the logarithm of the area, for compiled functions."""
        return self.low, self.high, self.fall_low, self.fall_high, float(np.log(self.area))

    def log_density(self, x: Floats | float) -> Floats:
        """The logarithm of the density."""
        outside = np.maximum((self.low - x) / self.fall_low, 0.0) + np.maximum((x - self.high) / self.fall_high, 0.0)
        return np.asarray(-0.5 * outside**2 - np.log(self.area))


START_GAIN = 0.03  # scatter of gains before any fit
GAIN_PRIOR = Plateau.of(GAIN_RANGE, GAIN_FALL)
POSITION_PRIOR = Plateau.of(POSITION_RANGE, POSITION_FALL)


def level_prior(log_level_sd: float) -> Plateau:
    """Prior of the factor on the lines' deviations; wider than the estimate's own error, as noise is not exactly
    normal."""
    return Plateau.normal(0.0, float(np.hypot(log_level_sd, 0.05)))


@dataclass(frozen=True)
class NoiseLevels:
    """`gain` s, `level` κ, `position` p [m] (0: none), `spread` τ, `pickup` the distinct q, `smooth` η."""

    gain: float
    level: float
    position: float
    spread: float
    pickup: Floats | None = None
    smooth: float = 0.0  # of curves


@dataclass(frozen=True)
class SeveralLevels:
    """Sets of noise levels (…, 1); `pickup` has the distinct deviations (…, distinct)."""

    gain: Floats
    level: Floats
    position: Floats
    spread: Floats
    pickup: Floats | None
    smooth: Floats

    @property
    def first(self) -> NoiseLevels:
        """The first set, as numbers."""
        gain, level, position, spread, smooth = (
            float(values.flat[0]) for values in (self.gain, self.level, self.position, self.spread, self.smooth)
        )
        pickup = None if self.pickup is None else self.pickup.reshape(-1, self.pickup.shape[-1])[0]
        return NoiseLevels(gain, level, position, spread, pickup, smooth)


USUAL = Plateau.of((1e-3, 1e-2), (1.0, 0.7))
DISCREPANCY = Plateau.of((3e-2, 3.0), (0.5, 1.0))  # of a law that is missing
TYPICAL = 3e-3
_LENGTHS = (0.025, 0.1, 0.4)
USUAL_DRIFT = 0.02  # of the largest force, over the curve
_COLUMNS = 3


@dataclass(frozen=True)
class CurveError:
    """The error that samples share, for all rows of a campaign's curves, one curve after another."""

    scale: Floats  # (rows,) [N]: the deviation is η times this
    path_fraction: Floats  # (rows,) along the curve, 0 to 1
    columns: Floats  # (rows, columns) [N] of each curve's own coefficients
    count: Floats  # (rows,) raw samples that each row is the mean of
    slope: Floats  # (rows,) [N per sample] of the straight line through these
    about_line: Floats  # (rows,) [N²] the sum of their squares about it
    slow: Floats  # (rows,) [N] the noise of its curve that neighbouring samples share, as the air shows it

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Of several curves."""
        columns = [part.columns for part in parts] or [np.zeros((0, 0))]

        def of(name: str) -> Floats:
            return np.concatenate([*(getattr(part, name) for part in parts), np.zeros(0)])

        return cls(
            of("scale"),
            of("path_fraction"),
            np.concatenate(columns),
            *map(of, ("count", "slope", "about_line", "slow")),
        )

    def part(self, order: Indices) -> Self:
        """Of some of the rows."""
        rows = (self.scale, self.path_fraction, self.columns, self.count, self.slope, self.about_line, self.slow)
        return type(self)(*(values[order] for values in rows))

    def within(self, force: Floats, curves: Sequence[slice]) -> float:
        """The sum of squares [N²] of raw samples about a law beyond that of their means, for complete curves.

        The law's force (rows,) is taken as straight between rows, as are the samples of a row apart from their noise.
        """
        middle = np.cumsum(self.count) - self.count / 2
        slope = np.concatenate([np.gradient(force[span], middle[span]) for span in curves])
        square = self.count * (self.count**2 - 1) / 12
        return float((self.about_line + square * (self.slope - slope) ** 2).sum())

    def covariance(self, size: float) -> Floats:
        """Covariance of rows of one curve, with η = `size` (rows, rows)."""
        return np.asarray(size**2 * np.outer(self.scale, self.scale) * _correlation(self.path_fraction))


def instrument_columns(displacement: Floats, time: Floats, zero: float, drift: float) -> Floats:
    """P of one curve (rows, 3): zero, drift in time, drift along the travel; `zero` and `drift` are deviations [N]."""
    columns = np.zeros((len(displacement), _COLUMNS))
    columns[:, 0] = zero
    for column, axis in ((1, time), (2, displacement)):
        if np.ptp(axis) > 0:
            columns[:, column] = drift * ((axis - axis[0]) / np.ptp(axis))
    return columns


class Whitening:
    """κ² D + η² B as κ² times a diagonal matrix: each curve's rows divided by d and rotated to the eigenvectors of
    B."""

    def __init__(self, error: CurveError, deviation: Floats, recording: Indices) -> None:
        """Compute the eigenvectors of each curve; `deviation` is D's square root (rows,)."""
        self._deviation = deviation
        edges = np.flatnonzero(np.diff(recording, prepend=-1, append=-1))
        self._spans = [slice(low, high) for low, high in pairwise(edges)]
        self._turns, sizes = [], []
        for span in self._spans:
            relative = error.scale[span] / deviation[span]
            size, turn = np.linalg.eigh(relative[:, None] * _correlation(error.path_fraction[span]) * relative)
            self._turns.append(turn.T)
            sizes.append(np.maximum(size, 0.0))
        self.size = np.concatenate(sizes)  # (rows,) η² B over κ² D, at η = κ
        self.columns = self.turned(error.columns.T)  # (columns, rows)

    def weight(self, ratio: Floats) -> Floats:
        """Weights of products of transformed rows at ratios η/κ (…, 1): (…, rows)."""
        return np.asarray(1 / (1 + ratio**2 * self.size))

    def turned(self, rows: Floats) -> Floats:
        """The rows (…, rows), forces, transformed so that their covariance is κ² diag(1/weight)."""
        scaled = rows / self._deviation
        parts = [scaled[..., span] @ turn.T for span, turn in zip(self._spans, self._turns, strict=True)]
        return np.concatenate(parts, axis=-1)


def _correlation(path_fraction: Floats) -> Floats:
    """k between all positions along a curve."""
    total = np.zeros((len(path_fraction), len(path_fraction)))
    for length in _LENGTHS:
        distance = np.sqrt(3.0) * np.abs(path_fraction[:, None] - path_fraction) / length
        total += (1 + distance) * np.exp(-distance) / len(_LENGTHS)
    return total


_COARSE, _BEYOND_NOISE = 240, 4.0  # samples at which a way is summed, standard deviations of noise
_RADIUS_SHARE = 0.7  # of the way along a curve, that of the contact radius


def path_fractions(displacement: Floats, force: Floats, seen: CurveLandmarks, kind: Kind) -> Floats:
    """The position x of each sample along the curve, by which the error of a law is smooth; about 0 to 1.

    Of a sphere mostly the way of its contact radius a, over twice the largest one: laws of contact idealise by a/R and
    a/h, and a surface or tip that is not smooth shows while the contact is small. Of a cylinder the way of its force.
    Shares of displacement and of samples give the air and a hold a length.
    """
    if kind == "indentation":
        share, changed, whole = _RADIUS_SHARE, np.abs(np.diff(_contact_radius(displacement, force, seen))), 2.0
    else:
        coarse = _evenly(len(force))
        steps = np.maximum(np.abs(np.diff(force[coarse])) - _BEYOND_NOISE * seen.noise, 0.0)
        changed = np.diff(np.interp(np.arange(len(force)), coarse, np.concatenate([[0.0], np.cumsum(steps)])))
        share, whole = 1 / 3, float(changed.sum())
    moved = np.abs(np.diff(displacement))
    parts = (
        (share, changed, whole),
        ((1 - share) / 2, moved, float(moved.sum())),
        ((1 - share) / 2, np.ones(len(moved)), float(len(moved))),
    )
    ways = [(weight, weight * np.cumsum(steps) / unit) for weight, steps, unit in parts if unit > 0]
    total = sum(way for _, way in ways) / sum(weight for weight, _ in ways) if ways else np.zeros(len(moved))
    return np.concatenate([[0.0], total])


def contact_samples(displacement: Floats, force: Floats, seen: CurveLandmarks) -> tuple[int, int]:
    """The first sample of an indentation's contact, and the one after its last.

    Contact ends with a visible pull-off; else not where the force passes zero, below which the sphere may still stick,
    but where it joins the straight line on which it stays: the zero on the way back may be another one than before.
    """
    without = np.flatnonzero(force[: seen.turn] <= max(_BEYOND_NOISE * seen.noise, LEAST_CONTACT * np.abs(force).max()))
    first = seen.snap_in if seen.snap_in is not None else (int(without[-1]) + 1 if len(without) else 0)
    if seen.pull_off is not None:
        return first, seen.pull_off
    air = back_in_air(displacement, force, seen.turn, seen.noise)
    if air is None:
        return first, len(force)
    end, away = air
    off = leaves_line(away, seen.noise, 0.0)
    return first, end + int(off[-1] + 2 if len(off) else 0)


def _contact_radius(displacement: Floats, force: Floats, seen: CurveLandmarks) -> Floats:
    """The contact radius over the largest one by Hertz's depth (samples,), 0 in the air.

    The depth on each way is that from where its contact begins or ends, as a share of the deepest; after a snap-in it
    begins as wide as it is there on the way back.
    """
    first, end = contact_samples(displacement, force, seen)
    coarse = _evenly(len(force))
    share = np.zeros(len(force))
    deepest = float(displacement[first:end].max())
    least = float(displacement[first:end].min())
    for way, lowest in (
        (
            slice(first, seen.turn),
            least if seen.snap_in is not None else float(displacement[first : seen.turn + 1].min()),
        ),
        (slice(seen.turn, end), float(displacement[seen.turn : end].min())),
    ):
        share[way] = np.clip((displacement[way] - lowest) / ((deepest - lowest) or 1.0), 0.0, 1.0)
    return np.sqrt(np.interp(np.arange(len(force)), coarse, share[coarse]))


def _evenly(samples: int) -> Indices:
    """At most `_COARSE` of the samples, evenly: the way along them does not grow with their noise."""
    return np.linspace(0, samples - 1, min(samples, _COARSE)).round().astype(np.intp)


_KNOTS_PER_DECADE = 2.0
_SMOOTH = 1.0  # sd of the second difference of log rel² between knots
_FREEDOM = 6.0
_TYPICAL, _TYPICAL_SD = 1e-4, 3.0  # rel², and the sd of its logarithm: prior where lines carry little information
_SHARED = 8  # least recordings at a frequency whose common part is subtracted
_WINDOW = 5
_BLOCK = 10_000  # windows that are copied at once


@dataclass(frozen=True)
class LineNoise:
    """`deviation` (rows,) of real and imaginary part [C/N], and the uncertainty of its level (sd of its logarithm)."""

    deviation: Floats
    log_level_sd: float
    floor: float


def line_noise(
    value: Complexes,
    frequency: Floats,
    recording: Indices,
    coherence: Floats,
    uneven: Floats,
    predicted: Complexes | None = None,
) -> LineNoise:
    """The noise of the rows, which are sorted by recording and by frequency within each; the changes with frequency
    that a law has `predicted` (rows,) are no noise."""
    from underskin.diagnosis.kernels import roughness_cost

    if len(value) == 0:
        return LineNoise(np.zeros(0), 1.0, 0.0)
    amplitude = local_amplitude(value, recording)
    residual = value if predicted is None else value - predicted
    middle, share, rough = _roughness(_without_shared(value, frequency, recording, residual), frequency, recording)
    distinct, line = np.unique(frequency, return_inverse=True)
    knots = _knots(np.log(distinct))
    hats = _hats(np.log(distinct), knots)
    scale = float(np.median(amplitude))
    rough /= scale**2
    size2 = (amplitude / scale) ** 2
    weighed2 = size2 * uneven**2
    has_coherence = np.isfinite(coherence) & (coherence > 0) & (coherence < 1)
    from_coherence = np.log((1 - coherence[has_coherence]) / coherence[has_coherence]) if has_coherence.any() else None
    certainty = 1 / (
        _COHERENCE_VARIANCE + _OF_ALL_VARIANCE * np.bincount(line[has_coherence], minlength=1)[line[has_coherence]]
    )

    def variance(p: Floats) -> Floats:
        return np.exp(hats @ p[:-2])[line] * weighed2 + np.exp(p[-2])

    def objective(p: Floats) -> tuple[float, Floats]:
        relative, floor = np.exp(hats @ p[:-2])[line] * weighed2, np.exp(p[-2])
        d2 = relative + floor
        by_d2 = np.zeros(len(d2))
        cost = roughness_cost(d2, middle, share, rough, _FREEDOM, by_d2)
        if from_coherence is not None:
            # Noisy, with an unknown number of averages n: wide Gaussians; p[-1] is log(1/2n).
            gap = np.log(d2[has_coherence] / size2[has_coherence]) - from_coherence - p[-1]
            cost += 0.5 * np.sum(certainty * gap**2)
            by_d2[has_coherence] += certainty * gap / d2[has_coherence]
        second_difference = np.diff(p[:-2], 2) / _SMOOTH
        cost += 0.5 * second_difference @ second_difference + 0.5 * np.sum(
            ((p[:-2] - np.log(_TYPICAL)) / _TYPICAL_SD) ** 2
        )
        cost += 0.5 * ((p[-2] - np.log(_TYPICAL)) / _TYPICAL_SD) ** 2 + 0.5 * (p[-1] + 3.5) ** 2
        by_p = np.zeros(len(p))
        by_p[:-2] = (
            hats.T @ np.bincount(line, by_d2 * relative, len(distinct)) + (p[:-2] - np.log(_TYPICAL)) / _TYPICAL_SD**2
        )
        by_p[:-2] += np.convolve(second_difference, [1, -2, 1]) / _SMOOTH if len(second_difference) else 0.0
        by_p[-2] = by_d2.sum() * floor + (p[-2] - np.log(_TYPICAL)) / _TYPICAL_SD**2
        by_p[-1] = (p[-1] + 3.5) - (certainty @ gap if from_coherence is not None else 0.0)
        return float(cost), by_p

    level = np.log(max(float(np.median(rough)), 1e-14)) if len(middle) else np.log(_TYPICAL)
    start = np.concatenate([np.full(len(knots), level - 1.0), [level - 2.0, -3.5]])
    # SciPy leaves cycles that hold the function, and all arrays with it.
    p = minimize(weakref.proxy(objective), start, jac=True, method="L-BFGS-B", options={"maxiter": 200}).x
    d2 = variance(p)
    freedom = len(middle) / 1.5  # neighbouring differences share lines
    if len(middle) > 10:
        of_rough = d2[middle] + share**2 * d2[middle - 1] + (1 - share) ** 2 * d2[middle + 1]
        median = float(np.median(rough / of_rough))
        d2 = d2 * (median / np.log(2.0)) ** (freedom / (freedom + 30.0))
    d2 = np.maximum(d2, (1e-5) ** 2 * size2)
    sd = float(np.hypot(0.03, 1.0 / np.sqrt(1.0 + 2.0 * freedom)))
    return LineNoise(scale * np.sqrt(d2), sd, float(scale * np.exp(p[-2] / 2)))


_COHERENCE_VARIANCE = 0.5  # of the logarithm of one recording's coherence estimate
_OF_ALL_VARIANCE = 0.1  # and of the part common to all at a frequency


def local_amplitude(value: Complexes, recording: Indices) -> Floats:
    """|FRF| around each line: the median over five neighbours, or its own where that is larger (a sharp peak)."""
    size = np.abs(value)
    smooth = size.copy()
    half = _WINDOW // 2
    if len(size) >= _WINDOW:
        windows = np.lib.stride_tricks.sliding_window_view(size, _WINDOW)
        for low in range(0, len(windows), _BLOCK):
            batch = windows[low : low + _BLOCK]
            smooth[half + low : half + low + len(batch)] = np.partition(batch, half, axis=1)[:, half]
    edges = np.flatnonzero(np.diff(recording, prepend=-1, append=-1))
    for low, high in itertools.pairwise(edges.tolist()):
        if high - low < _WINDOW:
            smooth[low:high] = np.median(size[low:high])
        else:  # windows lie within a recording; its ends have the next one's
            smooth[low : low + half], smooth[high - half : high] = smooth[low + half], smooth[high - half - 1]
    return np.maximum(size, smooth)


def _interior(recording: Indices, frequency: Floats) -> Indices:
    """Rows with a lower and a higher neighbour in their own recording."""
    inner = np.arange(1, len(recording) - 1)
    same = (recording[inner - 1] == recording[inner]) & (recording[inner + 1] == recording[inner])
    increasing = (frequency[inner] > frequency[inner - 1]) & (frequency[inner + 1] > frequency[inner])
    return inner[same & increasing & (frequency[inner - 1] > 0)]


def _roughness(z: Complexes, frequency: Floats, recording: Indices) -> tuple[Indices, Floats, Floats]:
    """The rows j with two neighbours, λ and |e_j|²/2 of each."""
    middle = _interior(recording, frequency)
    log_f = np.log(frequency)
    share = (log_f[middle + 1] - log_f[middle]) / (log_f[middle + 1] - log_f[middle - 1])
    return middle, share, np.abs(z[middle] - share * z[middle - 1] - (1 - share) * z[middle + 1]) ** 2 / 2


def _without_shared(value: Complexes, frequency: Floats, recording: Indices, residual: Complexes) -> Complexes:
    """The `residual` of the lines (rows,) minus each recording's level times the part common to all recordings at that
    frequency, where there are at least `_SHARED`."""
    edges = np.flatnonzero(np.diff(recording, prepend=-1, append=-1))
    level = np.array([np.median(value.real[low:high]) for low, high in itertools.pairwise(edges.tolist())])
    ratio = residual / np.where(level == 0, 1.0, level)[recording]
    _, line, count = np.unique(np.round(frequency, 9), return_inverse=True, return_counts=True)
    if count[line].min() < _SHARED:
        return residual
    shared = np.empty(len(count), dtype=complex)
    strong = np.abs(level)[recording] > 0.3 * np.median(np.abs(level))
    for number, rows in enumerate(np.split(np.argsort(line, kind="stable"), np.cumsum(count)[:-1])):
        chosen = ratio[rows[strong[rows]]]
        chosen = chosen if len(chosen) else ratio[rows]
        shared[number] = np.median(chosen.real) + 1j * np.median(chosen.imag)
    return residual - level[recording] * shared[line]


def _knots(log_f: Floats) -> Floats:
    low, high = float(log_f.min()), float(log_f.max())
    count = max(1, int(np.ceil((high - low) / np.log(10.0) * _KNOTS_PER_DECADE)))
    return np.linspace(low, high, count + 1) if high > low else np.array([low])


def _hats(log_f: Floats, knots: Floats) -> Floats:
    """The piecewise linear functions (rows, knots) that are 1 at one knot and 0 at the others."""
    if len(knots) == 1:
        return np.ones((len(log_f), 1))
    position = (log_f - knots[0]) / (knots[1] - knots[0])
    return np.clip(1 - np.abs(position[:, None] - np.arange(len(knots))), 0, None)
