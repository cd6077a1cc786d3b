"""The flat zone: the band of a campaign in which no recording shows a resonance (Seminara 2018, section 3.2.2).

Re FRF of each recording, over its own level, is gathered in bins of equal width in log f and averaged over the
recordings of one condition (indenter and preload: a contact resonance moves with both). The zone is the widest run of
bins in which no condition leaves, beyond its noise, a power law common to all of them (a sensor's relaxation falls
slowly over the whole band and is no resonance) by more than `FLATNESS`. Lines at the mains and its harmonics that
stand out of their neighbours are left out, and so are lines that are not used (`line_choice`): noise that was not
excited there may be flat, too. A delay that all recordings share is taken off before (`delay`): Re FRF is the response
where the charge is in phase with the force.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

from underskin.errors import too_few
from underskin.recordings.frf.excitation import bin_of, edges_over
from underskin.recordings.frf.flat_zone_reason import Idle, levels_of, reason_of
from underskin.recordings.frf.mains import HARMONIC_WIDTH_HZ, HARMONICS, MAINS_HZ
from underskin.recordings.frf.stacks import Stack
from underskin.units import Floats, Mask

FLATNESS = 0.02
STEEPEST = 0.1  # fall of ln FRF with ln f that relaxation may have (a loss tangent of 0.16)
_BEYOND_NOISE = 3.0
_OUTSTANDING = 4.0  # scatter of a mains line over that of its neighbours
_NEIGHBOURS = 11

Condition = tuple[float, float]  # indenter radius [mm], preload [N]


@dataclass(frozen=True)
class FlatZone:
    """A band, limits included, the reason for it in words, and the lines inside it that are left out: those that mains
    spoil, and those that were not excited."""

    low_hz: float
    high_hz: float
    reason: str
    left_out_hz: tuple[float, ...] = ()
    idle_hz: tuple[float, ...] = ()
    chosen_by_user: bool = False

    def holds(self, frequency: Floats) -> Mask:
        """Which lines are averaged."""
        inside = (frequency >= self.low_hz) & (frequency <= self.high_hz)
        return inside & ~np.isin(np.round(frequency, 6), (*self.left_out_hz, *self.idle_hz))


def flat_zone(
    stacks: Sequence[Stack], conditions: Sequence[Condition], band_hz: tuple[float, float] | None = None
) -> FlatZone:
    """The flat zone of a campaign's recordings, or the user's band where given.

    Parameters
    ----------
    stacks : sequence of Stack
        The FRFs [C/N], put together where they have the same lines.
    conditions : sequence of (indenter radius [mm], preload [N])
        One for each recording.
    band_hz : (low, high), optional
        The user's band [Hz], limits included.

    Returns
    -------
    FlatZone
        The band [Hz] with the reason for it, and the lines in it that mains spoil.

    Raises
    ------
    InvalidInput
        No line lies in the user's band.

    Source
    ------
    Seminara 2018, section 3.2.2.
    """
    frequencies = np.unique(np.concatenate([stack.frequency for stack in stacks]))
    edges = edges_over(frequencies)
    followed = [stack.at(np.asarray(stack.used.any(axis=0))) for stack in stacks]
    excited = np.isin(frequencies, np.concatenate([stack.frequency for stack in followed]))
    mains = _mains_lines(followed)
    if band_hz is not None:
        inside = (frequencies >= band_hz[0]) & (frequencies <= band_hz[1])
        if not inside.any():
            allowed = f"must hold at least one line; they lie at {frequencies[0]:g} to {frequencies[-1]:g} Hz"
            raise too_few("band_hz", list(band_hz), allowed)
        return FlatZone(*band_hz, "the band given by the user", mains, chosen_by_user=True)
    ratio = _binned(followed, edges, mains)
    names, curves, noise = _by_condition(ratio, conditions)
    filled = np.flatnonzero(np.isfinite(curves).any(axis=0))
    if len(filled) < 2:
        reason = "the whole recorded range: too few lines to look for less"
        return FlatZone(frequencies[0], frequencies[-1], reason, mains)
    middle = np.sqrt(edges[1:] * edges[:-1])[filled]
    curves, noise = curves[:, filled], noise[:, filled]
    first, last, slope = _widest(np.log(middle), curves, noise)
    followed_hz = frequencies[excited]
    low = followed_hz[followed_hz >= edges[filled[first]] * (1 - 1e-12)][0]
    high = followed_hz[followed_hz <= edges[filled[last] + 1] * (1 + 1e-12)][-1]
    left_out = tuple(line for line in mains if low <= line <= high)
    idle_hz = frequencies[~excited]
    idle = Idle(
        bool((idle_hz < low).any()), bool((idle_hz > high).any()), int(((idle_hz > low) & (idle_hz < high)).sum())
    )
    reason = reason_of(low, high, middle, curves, names, (first, last), slope, left_out, idle)
    return FlatZone(float(low), float(high), reason, left_out, tuple(np.round(idle_hz, 6).tolist()))


def band_average(stacks: Sequence[Stack], zone: FlatZone) -> tuple[Floats, Floats, Floats]:
    """Re FRF averaged over the zone.

    Lines weigh by γ²/(1 − γ²) where their coherence γ² is known; of each recording those that stand out by 6 times its
    scatter are left out. The gain error that the lines share is not in the uncertainty: it belongs to the mixed model.

    Parameters
    ----------
    stacks : sequence of Stack
        The FRFs [C/N].
    zone : FlatZone
        The band, and the lines that are left out.

    Returns
    -------
    mean, uncertainty, scatter : (recordings,) arrays
        The average [C/N], its standard uncertainty by line noise [C/N], and the relative scatter of the lines; NaN
        where a recording has no line in the zone.
    """
    count = sum(len(stack.rows) for stack in stacks)
    mean, uncertainty, scatter = (np.full(count, np.nan) for _ in range(3))
    for stack in stacks:
        inside = zone.holds(stack.frequency)
        if not inside.any():
            continue
        real, used = stack.values.real[:, inside], stack.used[:, inside]
        typical = _medians(real, used)
        distance = np.abs(real - typical)
        near = distance <= 6 * 1.4826 * _medians(distance, used) + 1e-30
        weight = near * stack.weights[:, inside]
        total = weight.sum(axis=1)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            value = (weight * real).sum(axis=1) / total
            rest = real - value[:, None]
            effective = total**2 / (weight**2).sum(axis=1)
            unbiased = effective / (effective - 1)
            mean[stack.rows] = value
            # From the scatter itself, so that weights that are off cost accuracy and not honesty.
            uncertainty[stack.rows] = np.sqrt((weight**2 * rest**2).sum(axis=1) * unbiased) / total
            scatter[stack.rows] = np.sqrt((weight * rest**2).sum(axis=1) / total * unbiased) / np.abs(value)
    return mean, _where_one_line(mean, uncertainty, scatter), scatter


def _where_one_line(mean: Floats, uncertainty: Floats, scatter: Floats) -> Floats:
    """A recording of one line has no scatter of its own: it is given the others'."""
    alone = np.isfinite(mean) & ~np.isfinite(uncertainty)
    usual = float(np.nanmedian(scatter)) if np.isfinite(scatter).any() else 0.0
    return np.where(alone, usual * np.abs(mean), uncertainty)


def _medians(values: Floats, used: Mask) -> Floats:
    """The median over the lines that are used of each recording (recordings, 1); NaN where there are none."""
    if used.all():
        return np.asarray(np.median(values, axis=1, keepdims=True))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of recordings without a line
        return np.asarray(np.nanmedian(np.where(used, values, np.nan), axis=1, keepdims=True))


def _of_the_largest(real: Floats, used: Mask) -> Floats:
    """The median of the largest quarter of each recording's lines (recordings,): of those behind a low-pass most have
    none; NaN where no line is used."""
    largest = np.full(len(real), np.nan)
    for row, lines in enumerate(used):
        if lines.any():
            by_size = real[row, lines][np.argsort(np.abs(real[row, lines]))]
            largest[row] = np.median(by_size[-(len(by_size) // 4 + 1) :])
    return largest


def _mains_lines(stacks: Sequence[Stack]) -> tuple[float, ...]:
    """Lines at mains harmonics that scatter far more about their neighbours than those do."""
    harmonics = np.outer(MAINS_HZ, HARMONICS).ravel()
    lines_hz: set[float] = set()
    for stack in stacks:
        near = np.abs(stack.frequency[:, None] - harmonics).min(axis=1) <= HARMONIC_WIDTH_HZ
        if not near.any() or len(near) < _NEIGHBOURS:
            continue
        real, imaginary = (
            median_filter(part, (1, _NEIGHBOURS), mode="nearest") for part in (stack.values.real, stack.values.imag)
        )
        scatter = np.median(np.abs(stack.values - (real + 1j * imaginary)), axis=0)
        beside = median_filter(np.where(near, np.median(scatter[~near]), scatter), _NEIGHBOURS, mode="nearest")
        few = 1 + 1.5 / np.sqrt(len(stack.rows))  # scatter over few recordings is itself unsure
        lines = stack.frequency[near & (scatter > _OUTSTANDING * few * beside)]
        lines_hz.update(np.round(lines, 6).tolist())
    return tuple(sorted(lines_hz))


def _binned(stacks: Sequence[Stack], edges: Floats, mains: tuple[float, ...]) -> Floats:
    """Median of Re FRF over each recording's level in each bin (recordings, bins); NaN without a line or a level."""
    ratio = np.full((sum(len(stack.rows) for stack in stacks), len(edges) - 1), np.nan)
    for stack in stacks:
        if not len(stack.frequency):
            continue
        real, used = stack.values.real, stack.used
        level, noise = _medians(real, used)[:, 0], np.zeros(len(real))
        if real.shape[1] > 1:
            noise = _medians(np.abs(np.diff(real, axis=1)), used[:, 1:] & used[:, :-1])[:, 0]
        level = np.where(np.abs(level) > 2 * noise, level, _of_the_largest(real, used))
        plain = np.abs(level) > 2 * noise  # a dead sensor has no level
        kept = ~np.isin(np.round(stack.frequency, 6), mains)
        bins = bin_of(stack.frequency, edges)
        for number in np.unique(bins[kept]):
            lines = np.ix_(plain, kept & (bins == number))
            ratio[stack.rows[plain], number] = _medians(real[lines] / level[plain, None], used[lines])[:, 0]
    return ratio


def _by_condition(ratio: Floats, conditions: Sequence[Condition]) -> tuple[list[Condition], Floats, Floats]:
    """The conditions, the median curve of each (conditions, bins) and its noise; the last row is that of all."""
    names = sorted(set(conditions))
    member = np.array([names.index(condition) for condition in conditions])
    groups = [ratio[member == number] for number in range(len(names))]
    sigma = _noise(ratio)
    curves, noise = [], []
    for group in [*groups, ratio]:
        counts = np.isfinite(group).sum(axis=0)
        curve = np.full(ratio.shape[1], np.nan)
        curve[counts > 0] = np.nanmedian(group[:, counts > 0], axis=0)
        curves.append(curve)
        noise.append(sigma * 1.25 / np.sqrt(np.maximum(counts, 1)))
    return names, np.array(curves), np.array(noise)


def _noise(ratio: Floats) -> Floats:
    """Noise of one recording in each bin, from how far a bin lies from the middle of its neighbours."""
    filled = np.isfinite(ratio).any(axis=0)
    known = ratio[:, filled]
    sigma = np.zeros(ratio.shape[1])
    if known.shape[1] < 3:
        return sigma
    bend = np.abs(known[:, 1:-1] - (known[:, :-2] + known[:, 2:]) / 2)
    bend = bend[np.isfinite(bend).all(axis=1)]
    if len(bend) == 0:
        return sigma
    inner = 1.4826 * np.median(bend, axis=0) / np.sqrt(1.5)
    inner = median_filter(inner, 3, mode="nearest")
    sigma[filled] = np.concatenate([inner[:1], inner, inner[-1:]])
    return sigma


def _widest(log_frequency: Floats, curves: Floats, noise: Floats) -> tuple[int, int, float]:
    """First and last bin of the widest flat run, and the exponent of the common power law in it."""
    best, width = (0, 0, 0.0), -1.0
    bins = len(log_frequency)
    for first in range(bins):
        for last in range(bins - 1, first - 1, -1):
            if log_frequency[last] - log_frequency[first] <= width:
                break
            part = slice(first, last + 1)
            slope = _slope(log_frequency[part], curves[-1, part])
            if _is_flat(log_frequency[part], curves[:, part], noise[:, part], slope):
                best, width = (first, last, slope), float(log_frequency[last] - log_frequency[first])
                break
    if width > 0 or bins < 2:
        return best
    flattest = int(np.nanargmin(np.abs(np.diff(curves[-1]) / curves[-1, 1:])))  # of a flank
    return flattest, flattest + 1, 0.0


def _slope(log_frequency: Floats, curve: Floats) -> float:
    if len(log_frequency) < 3:
        return 0.0
    slope = float(np.polyfit(log_frequency, curve / curve.mean(), 1)[0])
    return float(np.clip(slope, -STEEPEST, 0.0))


def _is_flat(log_frequency: Floats, curves: Floats, noise: Floats, slope: float) -> bool:
    law = 1 + slope * (log_frequency - log_frequency.mean())
    shape = curves / law
    departure = np.abs(shape / levels_of(shape) - 1) - _BEYOND_NOISE * noise
    return not bool(np.any(departure > FLATNESS))
