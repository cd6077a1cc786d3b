"""The flat zone: the band of a campaign in which no recording shows a resonance (Seminara 2018, section 3.2.2).

Re FRF of each recording over its own level is gathered in bins of equal width in log f and averaged over the recordings
of one condition (indenter and preload: a contact resonance moves with both). The zone is the widest run of bins in
which no condition departs, beyond its noise, from a power law common to all (a sensor's relaxation, no resonance) by
more than `FLATNESS`. Outstanding lines at the mains and its harmonics and unused lines (`line_choice`) are left out. A
delay or a constant phase common to all recordings is removed before (`without_chain_phase`): Re FRF is the response
where the charge is in phase with the force. `reason_of` words why the zone ends where it does.

`roll_off` decides whether the band lies behind a high-pass or a low-pass. The magnitude over frequency, in bins over
all recordings and up to where a resonance lifts it, is fitted by a plateau with a slight power law and two filters,
    ln |FRF| = a − n ln f − ½ ln(1 + (f1/f)²) − (m/2) ln(1 + (f/f2)^(2k)),   0 ≤ n ≤ `STEEPEST`.
A filter counts where it explains the fall and the plateau lies beyond the band: then the band's average is no d33.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from scipy.ndimage import median_filter

from underskin.errors import too_few
from underskin.recordings.frf.estimation import common_delay, common_phase, without_delay
from underskin.recordings.frf.line_choice import (
    HARMONIC_WIDTH_HZ,
    bin_of,
    edges_over,
    near_mains,
)
from underskin.recordings.frf.spectra import Stack
from underskin.units import Floats, Indices, Mask

_PEAK = 1.3  # over the level: a resonance to be named
_NOT_EXCITED = "it was not excited: the charge hardly follows the force (low coherence), or the FRF is 0 there"


@dataclass(frozen=True)
class Idle:
    """Whether lines below and above a zone were not excited, and how many inside it."""

    below: bool
    above: bool
    inside: int


def reason_of(
    low_hz: float,
    high_hz: float,
    middle_hz: Floats,
    curves: Floats,
    conditions: Sequence[tuple[float, float]],
    bins: tuple[int, int],
    slope: float,
    left_out_hz: Sequence[float],
    idle: Idle,
    peaks_hz: Sequence[float],
) -> str:
    """The reason for a zone over `bins` (first, last) of the `curves` (conditions and all, bins) over `middle_hz`;
    `peaks_hz`: where each condition's magnitude is largest above the zone."""
    first, last = bins
    departure = curves / levels_of(curves[:, first : last + 1]) - 1
    parts = [f"{low_hz:.4g} to {high_hz:.4g} Hz: no resonance in any recording"]
    if last + 1 < len(middle_hz):
        parts.append(_above(high_hz, peaks_hz, departure, conditions, last))
    elif idle.above:
        parts.append(f"above {high_hz:.4g} Hz {_NOT_EXCITED}")
    if first > 0:
        parts.append(_below(low_hz, departure[-1, :first]))
    elif idle.below:
        parts.append(f"below {low_hz:.4g} Hz {_NOT_EXCITED}")
    if first == 0 and last + 1 == len(middle_hz) and not (idle.below or idle.above):
        parts.append("it is the whole recorded range")
    if abs(slope) > 0.005:
        parts.append(f"inside, all recordings fall alike, by {100 * (1 - 10**slope):.1f} % a decade")
    if idle.inside:
        parts.append(f"{idle.inside} lines inside it were not excited (low coherence) and are left out")
    if left_out_hz:
        parts.append(f"lines left out as mains pick-up: {', '.join(f'{line:g}' for line in left_out_hz)} Hz")
    return "; ".join(parts)


def levels_of(curves: Floats) -> Floats:
    """The mean of each curve over its bins, (curves, 1); NaN without any, and of a curve of zeros."""
    filled, total = np.isfinite(curves).sum(axis=1, keepdims=True), np.nansum(curves, axis=1, keepdims=True)
    return np.asarray(np.where(total == 0, np.nan, total) / np.where(filled, filled, np.nan))


def _above(
    high_hz: float,
    peaks_hz: Sequence[float],
    departure: Floats,
    conditions: Sequence[tuple[float, float]],
    last: int,
) -> str:
    beyond = departure[:-1, last + 1 :]
    peaks = {
        index: peaks_hz[index]
        for index, row in enumerate(beyond)
        if np.isfinite(row).any()
        and np.nanmax(row) > _PEAK - 1
        and np.nanargmax(row) < np.flatnonzero(np.isfinite(row))[-1]
    }
    if peaks:
        lowest, highest = min(peaks, key=lambda index: peaks[index]), max(peaks.values())
        radius, preload = conditions[lowest]
        where = f"{peaks[lowest]:.3g} Hz" + (
            f" to {highest:.3g} Hz, moving with the contact" if highest > 1.2 * peaks[lowest] else ""
        )
        return (
            f"above, the response rises to a resonance (peak at {where}; lowest with the sphere of {radius:g} mm "
            f"radius at {preload:g} N)"
        )
    side = "rises" if float(departure[-1, last + 1]) > 0 else "falls"
    return f"above {high_hz:.4g} Hz the response {side} or scatters by more than 2 %, without a peak in range"


def _below(low_hz: float, departure: Floats) -> str:
    """By the departures of the bins below: a high-pass lowers each more than the next."""
    falls = bool(departure[-1] < 0)
    if falls and len(departure) > 1 and not (np.diff(departure) <= 0).any():
        return f"below {low_hz:.4g} Hz the response falls off, as behind a high-pass"
    return f"below {low_hz:.4g} Hz the response {'falls' if falls else 'rises'} or scatters by more than 2 %"


FLATNESS = 0.02
STEEPEST = 0.1  # fall of ln FRF with ln f that relaxation may have (a loss tangent of 0.16)
_BEYOND_NOISE = 3.0
SUPPORTED_NATS = 3.0  # as of a law without a free parameter in a diagnosis
_COURSE = 4  # degree of the course through the neighbours of a mains line
_EACH_SIDE, _FEWEST_EACH_SIDE = 6, 2  # lines
_WIDTHS = 4.0  # widths of a harmonic that its neighbours span on each side

Condition = tuple[float, float]  # indenter radius [mm], preload [N]


@dataclass(frozen=True)
class FlatZone:
    """A band, limits included, the reason for it in words, and the lines left out inside it: `left_out_hz` near mains,
    `idle_hz` not excited."""

    low_hz: float
    high_hz: float
    reason: str
    left_out_hz: tuple[float, ...] = ()
    idle_hz: tuple[float, ...] = ()
    chosen_by_user: bool = False

    @property
    def middle_hz(self) -> float:
        """The middle of the band in ln f."""
        return float(np.sqrt(self.low_hz * self.high_hz))

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
    excited_stacks = [stack.at(np.asarray(stack.used.any(axis=0))) for stack in stacks]
    excited = np.isin(frequencies, np.concatenate([stack.frequency for stack in excited_stacks]))
    mains = mains_lines(excited_stacks)
    if band_hz is not None:
        inside = (frequencies >= band_hz[0]) & (frequencies <= band_hz[1])
        if not inside.any():
            allowed = f"must hold at least one line; they lie at {frequencies[0]:g} to {frequencies[-1]:g} Hz"
            raise too_few("band_hz", list(band_hz), allowed)
        return FlatZone(*band_hz, "the band given by the user", mains, chosen_by_user=True)
    ratio = _binned(excited_stacks, edges, mains)
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
    mains_in_band = tuple(line for line in mains if low <= line <= high)
    idle_hz = frequencies[~excited]
    idle = Idle(
        bool((idle_hz < low).any()), bool((idle_hz > high).any()), int(((idle_hz > low) & (idle_hz < high)).sum())
    )
    peaks = [_peak_hz(excited_stacks, [condition == name for condition in conditions], high) for name in names]
    reason = reason_of(low, high, middle, curves, names, (first, last), slope, mains_in_band, idle, peaks)
    return FlatZone(float(low), float(high), reason, mains_in_band, tuple(np.round(idle_hz, 6).tolist()))


def _peak_hz(stacks: Sequence[Stack], chosen: Sequence[bool], above_hz: float) -> float:
    """The line above a frequency at which the mean magnitude of the chosen recordings is largest; NaN without one."""
    peaks = [(0.0, np.nan)]
    for stack in stacks:
        rows, beyond = np.array(chosen)[stack.rows], stack.frequency > above_hz
        if rows.any() and beyond.any():
            size = np.nan_to_num(np.abs(stack.values[rows][:, beyond])).mean(axis=0)
            peaks.append((float(size.max()), float(stack.frequency[beyond][size.argmax()])))
    return max(peaks, key=lambda peak: peak[0])[1]


def band_average(stacks: Sequence[Stack], zone: FlatZone) -> tuple[Floats, Floats, Floats]:
    """Re FRF averaged over the zone.

    Lines are weighted by γ²/(1 − γ²) where the coherence γ² is known; lines of a recording beyond 6 times its scatter
    are left out. The common gain error of the lines is not in the uncertainty: it belongs to the mixed model.

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
            # From the observed scatter, so that wrong weights cost accuracy but the uncertainty stays valid.
            uncertainty[stack.rows] = np.sqrt((weight**2 * rest**2).sum(axis=1) * unbiased) / total
            scatter[stack.rows] = np.sqrt((weight * rest**2).sum(axis=1) / total * unbiased) / np.abs(value)
    return mean, _with_usual_scatter(mean, uncertainty, scatter), scatter


def _with_usual_scatter(mean: Floats, uncertainty: Floats, scatter: Floats) -> Floats:
    """The uncertainty, for a recording of one line, which has no scatter, by the median scatter of the others."""
    single_line = np.isfinite(mean) & ~np.isfinite(uncertainty)
    usual = float(np.nanmedian(scatter)) if np.isfinite(scatter).any() else 0.0
    return np.where(single_line, usual * np.abs(mean), uncertainty)


def _medians(values: Floats, used: Mask) -> Floats:
    """The median over the used lines of each recording (recordings, 1); NaN without any."""
    if used.all():
        return np.asarray(np.median(values, axis=1, keepdims=True))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of recordings without a line
        return np.asarray(np.nanmedian(np.where(used, values, np.nan), axis=1, keepdims=True))


def _of_the_largest(real: Floats, used: Mask) -> Floats:
    """The median of the largest quarter of each recording's lines (recordings,), since behind a low-pass most lines
    show no response; NaN without a used line."""
    largest = np.full(len(real), np.nan)
    for row, lines in enumerate(used):
        if lines.any():
            by_size = real[row, lines][np.argsort(np.abs(real[row, lines]))]
            largest[row] = np.median(by_size[-(len(by_size) // 4 + 1) :])
    return largest


def mains_lines(stacks: Sequence[Stack]) -> tuple[float, ...]:
    """Lines near mains harmonics that a smooth course through their neighbours does not explain.

    The course of a line is the polynomial of fourth degree in ln f through the lines around it that are near no
    harmonic, on both sides, by least squares for each recording. With R the power of what it leaves over ν degrees of
    freedom and D that of the line's departures over n recordings, each over its own variance for one noise, a noise of
    the line's own gains
        (ν + n) ln((R + D)/(ν + n)) − ν ln(R/ν) − n ln(D/n)
    nats of likelihood (complex normal). One of m lines gains ln m by chance; where the lines near no harmonic gain
    more than that, as those of blows do, whose noise is neither even over frequency nor normal, all gains are reduced
    alike. More than those of a choice among all lines near a harmonic leave a line out.
    """
    lines_hz: set[float] = set()
    for stack in stacks:
        near = near_mains(stack.frequency)
        required = SUPPORTED_NATS + np.log(max(int(near.sum()), 1))
        gains = _gains(stack, np.flatnonzero(near), ~near)
        if max(gains.values(), default=0.0) > required:
            plain = list(_gains(stack, np.flatnonzero(~near), ~near).values())
            required *= max(max(plain, default=0.0) / np.log(len(plain) + 2.0), 1.0)
        lines_hz |= {round(float(stack.frequency[line]), 6) for line, gain in gains.items() if gain > required}
    return tuple(sorted(lines_hz))


def _gains(stack: Stack, lines: Indices, plain: Mask) -> dict[int, float]:
    """`_departure_nats` of each of the lines that has enough plain ones around it, a harmonic's width away: the noise
    of neighbouring lines may be the same."""
    gains = {}
    for line in lines.tolist():
        away = np.abs(stack.frequency - stack.frequency[line]) > HARMONIC_WIDTH_HZ
        around = _around(stack.frequency, line, plain & away)
        if around is not None:
            gains[line] = _departure_nats(stack, line, around)
    return gains


def without_mains(stacks: Sequence[Stack]) -> list[Stack]:
    """The stacks without the lines that `mains_lines` names; as they are where nothing else would be left."""
    spoilt = mains_lines(stacks)
    plain = [~np.isin(np.round(stack.frequency, 6), spoilt) for stack in stacks]
    return [stack.at(lines) if lines.any() else stack for stack, lines in zip(stacks, plain, strict=True)]


def _around(frequency: Floats, line: int, plain: Mask) -> Indices | None:
    """The plain lines nearest to a line on each side, as many as make the course certain across the width of a
    harmonic; None where either side has too few."""
    reach = _WIDTHS * HARMONIC_WIDTH_HZ
    below, above = (side[plain[side]] for side in (np.arange(line)[::-1], np.arange(line + 1, len(frequency))))
    sides = [
        side[: max(_EACH_SIDE, int((np.abs(frequency[side] - frequency[line]) <= reach).sum()))]
        for side in (below, above)
    ]
    enough = min(map(len, sides)) >= _FEWEST_EACH_SIDE and sum(map(len, sides)) > _COURSE + 1
    return np.sort(np.concatenate(sides)) if enough else None


def _departure_nats(stack: Stack, line: int, around: Indices) -> float:
    """The log likelihood that a line gains by a noise of its own beside that of the lines around it."""
    x = np.log(stack.frequency[around] / stack.frequency[line])
    course, triangle = np.linalg.qr(np.vander(x / np.abs(x).max(), _COURSE + 1))
    at_line = np.linalg.solve(triangle.T, np.eye(_COURSE + 1)[-1])  # the course at x = 0 is at_line · courseᵀ y
    values = stack.values[:, around]
    fitted = values @ course
    left = float((np.abs(values - fitted @ course.T) ** 2).sum())
    off = float((np.abs(stack.values[:, line] - fitted @ at_line) ** 2).sum()) / (1 + float(at_line @ at_line))
    recordings = len(stack.rows)
    degrees = recordings * (len(around) - _COURSE - 1)
    if not off / recordings > left / degrees > 0:
        return 0.0
    common = (left + off) / (degrees + recordings)
    return float(
        (degrees + recordings) * np.log(common)
        - degrees * np.log(left / degrees)
        - recordings * np.log(off / recordings)
    )


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
        not_mains = ~np.isin(np.round(stack.frequency, 6), mains)
        bins = bin_of(stack.frequency, edges)
        for bin_index in np.unique(bins[not_mains]):
            lines = np.ix_(plain, not_mains & (bins == bin_index))
            ratio[stack.rows[plain], bin_index] = _medians(real[lines] / level[plain, None], used[lines])[:, 0]
    return ratio


def _by_condition(ratio: Floats, conditions: Sequence[Condition]) -> tuple[list[Condition], Floats, Floats]:
    """The conditions, the median curve of each (conditions, bins) and its noise; the last row is that of all."""
    names = sorted(set(conditions))
    member = np.array([names.index(condition) for condition in conditions])
    groups = [ratio[member == index] for index in range(len(names))]
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
    """Noise of one recording in each bin, from its departure from the mean of its neighbours."""
    filled = np.isfinite(ratio).any(axis=0)
    filled_ratio = ratio[:, filled]
    sigma = np.zeros(ratio.shape[1])
    if filled_ratio.shape[1] < 3:
        return sigma
    departure = np.abs(filled_ratio[:, 1:-1] - (filled_ratio[:, :-2] + filled_ratio[:, 2:]) / 2)
    departure = departure[np.isfinite(departure).all(axis=1)]
    if len(departure) == 0:
        return sigma
    inner = 1.4826 * np.median(departure, axis=0) / np.sqrt(1.5)
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


_FEWEST_BINS = 6
_CORNERS = 60  # corner frequencies tried for each filter
_BELOW, _ABOVE = 30.0, 10.0  # range of corner frequencies, as factors on the ends of the band
_LOW_PASSES = ((1, 1), (2, 1), (4, 1), (1, 2), (2, 2), (1, 4))  # k and m: Butterworth's of order k, m times in a row
_HIGH_PASSES = ((1, 1), (2, 1), (1, 2))
_FIRST_ORDER = (1, 1)
_LEAST_NOISE = 0.003  # of a bin's magnitude
_SEVERAL, _USUAL_NOISE = 4, 0.02  # lines of a bin that determine its scatter, and the default scatter
_LIFTED = 1.05  # of the plateau: a resonance
_LEAST_SHARE = 0.02  # least reported loss, of the plateau
_SPEAKS = 25.0  # least reduction of χ² by a filter
_EXPLAINED = 0.2  # largest remaining rms, of that about a plateau


@dataclass(frozen=True)
class RollOff:
    """The filters, and the loss of the band's level relative to the plateau."""

    filters: "Filters"
    share: float

    @property
    def arguments(self) -> dict[str, float]:
        """The corners and the loss as findings state them."""
        corners = {"high_pass_hz": self.filters.high_hz, "low_pass_hz": self.filters.low_hz}
        return {**corners, "percent": 100 * self.share}


def roll_off(stacks: Sequence[Stack], zone: FlatZone, level: Floats) -> RollOff | None:
    """The filters that attenuate the band; None where it reaches their plateau. `level` (recordings,): the average over
    the zone [C/N]."""
    frequency, magnitude, noise = _curve(stacks, level)
    inside = (frequency >= zone.low_hz) & (frequency <= zone.high_hz)
    lifted = np.flatnonzero(magnitude > _LIFTED * np.median(magnitude[inside])) if inside.any() else np.zeros(0, int)
    lifted = lifted[frequency[lifted] > zone.high_hz]
    if len(lifted) and magnitude[-1] >= 0.8 * magnitude[lifted[0] :].max():
        lifted = lifted[:0]  # no peak: a high-pass that goes on rising
    end = int(lifted[0]) if len(lifted) else len(frequency)
    if end < _FEWEST_BINS:
        return None
    curve = _Curve(np.log(frequency[:end]), np.log(magnitude[:end]), noise[:end] ** -2.0, np.log(zone.middle_hz))
    plain = curve.fitted(Filters())[0]
    if plain < _SPEAKS:
        return None
    highs = np.geomspace(frequency[0] / _BELOW, frequency[end - 1] * _ABOVE, _CORNERS)
    lows = np.geomspace(frequency[0] / _ABOVE, frequency[end - 1] * _BELOW, _CORNERS)
    single = [Filters(high_hz=high, high_pass=kind) for high in highs.tolist() for kind in _HIGH_PASSES]
    single += [Filters(low_hz=low, low_pass=kind) for low in lows.tolist() for kind in _LOW_PASSES]
    pairs = [Filters(high, low) for high, low in product(highs[::2].tolist(), lows[::2].tolist()) if high < low]
    best, both = (curve.refined(min(every, key=lambda filters: curve.fitted(filters)[0])) for every in (single, pairs))
    if curve.fitted(best)[0] - curve.fitted(both)[0] > _SPEAKS:
        best = both
    misfit, plateau = curve.fitted(best)
    share = 1 - float(np.exp(-plateau))
    is_explained = plain - misfit >= _SPEAKS and misfit <= _EXPLAINED**2 * plain + len(curve.x)
    return RollOff(best, share) if is_explained and share >= _LEAST_SHARE else None


def without_chain_phase(stacks: Sequence[Stack], conditions: Sequence[Condition]) -> tuple[list[Stack], float, float]:
    """The FRFs without the phase of the charge's chain; the delay [s] and the constant phase [rad] that were removed.

    A phase that all lines of the magnitude's flat zone have in common, and that is larger than that of any loss, is
    constant. Where the phases turn over frequency, they are those of the filters that `roll_off` finds, if any: two
    poles of a high-pass make half a turn from the plateau to the lowest lines, which resembles a delay of the force and
    would hide the polarity. Otherwise, and for what the filters leave, they are those of the common delay.
    """
    constant = _constant_phase(without_mains(stacks), conditions)
    if constant:
        return [replace(stack, values=stack.values * np.exp(-1j * constant)) for stack in stacks], 0.0, constant
    delay = common_delay(without_mains(stacks))
    if delay:
        undelayed = [stack.at(stack.frequency > 0) for stack in without_delay(stacks, delay)]
        lowest = float(np.concatenate([stack.frequency for stack in undelayed]).min())
        behind = roll_off(undelayed, flat_zone(undelayed, conditions), _magnitude(undelayed, len(conditions)))
        if behind is not None:
            turns = [np.exp(-1j * behind.filters.phase(np.maximum(stack.frequency, lowest))) for stack in stacks]
            stacks = [replace(stack, values=stack.values * turn) for stack, turn in zip(stacks, turns, strict=True)]
            delay = common_delay(without_mains(stacks))
    return without_delay(stacks, delay), delay, 0.0


def _constant_phase(stacks: Sequence[Stack], conditions: Sequence[Condition]) -> float:
    """The phase [rad] of the magnitude's flat zone, where it is the same at all lines; 0 where it is no more than the
    steepest relaxation has, n π/2 for f⁻ⁿ (Bode), or where the zone is a filter's flank."""
    sizes = [replace(stack, values=np.abs(stack.values) + 0j).at(stack.frequency > 0) for stack in stacks]
    zone = flat_zone(sizes, conditions)
    inside = [stack.at(lines) for stack in stacks if (lines := zone.holds(stack.frequency)).any()]
    constant = common_phase(inside)
    if abs(constant) <= STEEPEST * np.pi / 2 or roll_off(sizes, zone, _magnitude(sizes, len(conditions))) is not None:
        return 0.0
    return constant


def _magnitude(stacks: Sequence[Stack], count: int) -> Floats:
    """The median magnitude of each recording's lines (count,)."""
    level = np.zeros(count)
    for stack in stacks:
        level[stack.rows] = _medians(np.abs(stack.values), stack.used)[:, 0]
    return level


@dataclass(frozen=True)
class Filters:
    """Corner frequencies [Hz], 0 and ∞ without one, and kinds (k, m) of a high-pass and a low-pass."""

    high_hz: float = 0.0
    low_hz: float = np.inf
    high_pass: tuple[int, int] = _FIRST_ORDER
    low_pass: tuple[int, int] = _FIRST_ORDER

    def log_gain(self, frequency: Floats) -> Floats:
        """ln of the filters' magnitude at these frequencies [Hz]."""
        (high_order, high_times), (low_order, low_times) = self.high_pass, self.low_pass
        return -0.5 * (
            high_times * np.log1p((self.high_hz / frequency) ** (2 * high_order))
            + low_times * np.log1p((frequency / self.low_hz) ** (2 * low_order))
        )

    def phase(self, frequency: Floats) -> Floats:
        """The filters' phase [rad] at these frequencies [Hz], 0 on the plateau."""
        return _lag(self.high_hz / frequency, *self.high_pass) - _lag(frequency / self.low_hz, *self.low_pass)


def _lag(ratio: Floats, order: int, times: int) -> Floats:
    """The lag [rad] of Butterworth's low-pass, so many times in a row, at these multiples of its corner."""
    poles = np.exp(0.5j * np.pi * (2 * np.arange(order) + order + 1) / order)
    return np.asarray(times * np.angle(1j * ratio[:, None] - poles).sum(axis=1))


@dataclass(frozen=True)
class _Curve:
    """ln f `x`, ln of the magnitude `y` and its `weight` (bins,), and ln of the frequency `at` which the plateau is
    stated."""

    x: Floats
    y: Floats
    weight: Floats
    at: float

    def fitted(self, filters: Filters) -> tuple[float, float]:
        """χ² of the best plateau and slope behind these filters, and the logarithm of the plateau at `at`."""
        total, middle, x, variance = self._centred
        y = self.y - filters.log_gain(self._frequency)
        level = float((y * self.weight).sum() / total)
        slope = float(np.clip((self.weight * x * y).sum() / variance, -STEEPEST, 0.0))
        return float((self.weight * (y - level - slope * x) ** 2).sum()), level + slope * (self.at - middle)

    @cached_property
    def _frequency(self) -> Floats:
        return np.exp(self.x)

    @cached_property
    def _centred(self) -> tuple[float, float, Floats, float]:
        """Sum of the weights, weighted mean of `x`, `x` less it, and its weighted sum of squares."""
        total = float(self.weight.sum())
        middle = float((self.x * self.weight).sum() / total)
        x = self.x - middle
        return total, middle, x, float((self.weight * x**2).sum())

    def refined(self, filters: Filters) -> Filters:
        """The filters with the corners that fit best near their own."""
        from scipy.optimize import minimize  # takes 0.3 s to load, which few need

        names = [name for name in ("high_hz", "low_hz") if 0 < getattr(filters, name) < np.inf]
        start: Floats = np.log(np.array([getattr(filters, name) for name in names], dtype=np.float64))

        def moved(corners: Floats) -> Filters:
            return replace(filters, **dict(zip(names, np.exp(corners).tolist(), strict=True)))

        def misfit(corners: Floats) -> float:
            return self.fitted(moved(corners))[0]

        near = start[:, None] + np.log(_BELOW) * np.array([-1.0, 1.0])
        return moved(np.asarray(minimize(misfit, start, method="Nelder-Mead", bounds=near).x, dtype=np.float64))


def _curve(stacks: Sequence[Stack], level: Floats) -> tuple[Floats, Floats, Floats]:
    """For non-empty bins of equal width in ln f: the middle of its lines [Hz], the median over recordings of the
    magnitude over their level, and its relative noise."""
    lines = [stack.frequency[stack.used.any(axis=0)] for stack in stacks]
    edges = edges_over(np.unique(np.concatenate(lines)))
    cells: list[list[Floats]] = [[] for _ in edges[1:]]  # (recordings, 4): middle, magnitude, scatter, lines
    for stack in stacks:
        bins, own_level = bin_of(stack.frequency, edges), level[stack.rows]
        known = np.isfinite(own_level) & (own_level != 0)
        size, used = np.abs(stack.values[known]) / np.abs(own_level[known, None]), stack.used[known]
        for bin_index in np.unique(bins).tolist() if known.any() else ():
            inside = np.flatnonzero(bins == bin_index)
            choices, choice_of_row = np.unique(used[:, inside], axis=0, return_inverse=True)  # mostly all lines
            choice_of_row = choice_of_row.reshape(-1)  # NumPy 2.0 returns (rows, 1)
            for number in np.flatnonzero(choices.any(axis=1)).tolist():
                of_choice = inside[choices[number]]
                chosen = size[np.ix_(choice_of_row == number, of_choice)]
                middle_hz = np.median(stack.frequency[of_choice])
                columns = middle_hz, np.median(chosen, axis=1), np.std(chosen, axis=1), len(of_choice)
                cells[bin_index].append(np.stack(np.broadcast_arrays(*columns), axis=1).astype(np.float64))
    tables = [np.concatenate(of_bin).T for of_bin in cells if of_bin]
    several = np.concatenate([scatter[count >= _SEVERAL] for _, _, scatter, count in tables]) if tables else np.zeros(0)
    usual = float(np.median(several)) if len(several) else _USUAL_NOISE
    filled = [part for part in tables if np.median(part[1]) > 0]
    middle, magnitude = np.array([np.median(part[:2], axis=1) for part in filled]).reshape(-1, 2).T
    # Of a median over recordings; with few lines their deviation is at least the usual one
    errors = [np.maximum(part[2], np.where(part[3] < _SEVERAL, usual, 0.0)) / np.sqrt(part[3]) for part in filled]
    noise = np.array([_OF_A_MEDIAN * float(np.median(error)) / len(error) ** 0.5 for error in errors])
    return middle, magnitude, np.maximum(noise / magnitude, _LEAST_NOISE)


_HALVES_BEYOND_NOISE = 3.0
_LEAST_CHANGE = 0.003
_OF_A_MEDIAN = 1.25  # its standard error over that of a mean


def lower_half(stacks: Sequence[Stack], zone: FlatZone, level: Floats, noise: Floats) -> str:
    """The difference of d33 over the lower half of the zone, in log f, in words; empty within the noise.

    A contact resonance above the zone raises its upper end first, and a high-pass lowers its lower end. `level` and
    `noise` (recordings,) are those of the whole zone, as `band_average` has them.
    """
    half = replace(zone, high_hz=zone.middle_hz)
    lower, lower_noise, _ = band_average(stacks, half)
    with np.errstate(divide="ignore", invalid="ignore"):  # of a dead sensor
        change, relative_noise = lower / level - 1, np.hypot(noise, lower_noise) / np.abs(level)
    valid = np.isfinite(change) & np.isfinite(relative_noise)
    if not valid.any():
        return ""
    typical = float(np.median(change[valid]))
    by_noise = _OF_A_MEDIAN * float(np.median(relative_noise[valid])) / np.sqrt(valid.sum())
    if abs(typical) < max(_HALVES_BEYOND_NOISE * by_noise, _LEAST_CHANGE):
        return ""
    direction = "higher" if typical > 0 else "lower"
    return f"; averaged over its lower half alone, d33 would be {100 * abs(typical):.1f} % {direction}"
