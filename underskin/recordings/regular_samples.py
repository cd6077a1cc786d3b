"""Channels brought to common samples, and lines of spectra and samples of time series made regular.

Channels are cut where they were started at different times (`aligned`), or joined one after the other where an
instrument writes the parts of a curve side by side (`with_joined`). The other functions make samples complete, sorted,
each frequency once, at one rate; each says in words what it changed (empty where nothing), or raises ValueError that
says why it cannot.
"""

import math
from collections.abc import Collection, Mapping
from dataclasses import replace
from datetime import datetime, timedelta
from operator import attrgetter

import numpy as np
from scipy.special import fdtrc

from underskin.errors import FileError
from underskin.recordings.channels import Block, Channel, Contents
from underskin.units import Complexes, Floats, Indices, Mask

OFF_SAMPLE = 0.05  # of a step: at half the rate a phase of 9°, and Re FRF 1.2 % too small
_LEAST_COMMON = 2  # samples in common
_ONE_GAIN = 0.05  # scatter of the gain of one contact on a poor rig (`mixed_model.GAIN_RANGE`)
_BY_CHANCE = 1e-6
_ROUNDING = 1e-9  # relative: no file has more digits
_TINY = float(np.finfo(float).tiny)


def aligned(contents: Contents, names: Collection[str], file: str) -> Contents:
    """The contents with the named channels cut to their common samples in every block, by the stated start times; with
    a warning.

    Raises FileError that names both channels where their rates differ, or their starts differ by fractions of a sample.
    """
    blocks, warnings = [], list(contents.warnings)
    for block in contents.blocks:
        used = {channel.name: channel for name in names if (channel := block.headed(name)) is not None}
        rate = _common_rate(list(used.values()), file)
        with_rate = block if rate is None else replace(block, sample_rate_hz=rate)
        if len({channel.starts_s for channel in used.values()}) < 2:
            blocks.append(with_rate)
            continue
        cut, cut_warnings = _cut_to_common(with_rate, used, file)
        blocks.append(cut)
        warnings += cut_warnings
    return replace(contents, blocks=tuple(blocks), warnings=tuple(dict.fromkeys(warnings)))


def _common_rate(used: list[Channel], file: str) -> float | None:
    sampled = {channel.sample_rate_hz: channel for channel in used if channel.sample_rate_hz is not None}
    if len(sampled) > 1:
        (first, channel), (second, later), *_ = sampled.items()
        reason = f"{channel.name!r} has {first:g} samples a second, {later.name!r} {second:g}: they must have one rate"
        raise FileError(file, "", reason)
    return next(iter(sampled), None)


def _cut_to_common(block: Block, used: dict[str, Channel], file: str) -> tuple[Block, list[str]]:
    """The block with the used channels cut, and a warning; unchanged where they start within one sample."""
    first, last = (end(used.values(), key=attrgetter("starts_s")) for end in (min, max))
    start_times = f"{first.name!r} starts at {_time(block, first)}, {last.name!r} at {_time(block, last)}"
    if block.sample_rate_hz is None:
        raise FileError(file, "", f"{start_times}, and no sample rate is stated by which to align them")
    late = {name: (last.starts_s - channel.starts_s) * block.sample_rate_hz for name, channel in used.items()}
    skipped = {name: round(samples) for name, samples in late.items()}
    odd = next((name for name in used if abs(late[name] - skipped[name]) > OFF_SAMPLE), None)
    if odd is not None:
        reason = f"that is {late[odd]:.4g} samples: they can be aligned by whole samples alone"
        raise FileError(file, "", f"{start_times}: {reason}; resample one of them, or correct the times")
    if not any(skipped.values()):
        return block, []
    count = min(len(channel.values) - skipped[name] for name, channel in used.items())
    if count < _LEAST_COMMON:
        raise FileError(file, "", f"{start_times}: they have no samples in common")
    channels = tuple(
        replace(channel, values=channel.values[skipped[channel.name] : skipped[channel.name] + count])
        if channel.name in used
        else channel
        for channel in block.channels
    )
    warning = f"{start_times}: they were aligned, with {count} samples in common"
    return replace(block, channels=channels), [warning]


def _time(block: Block, channel: Channel) -> str:
    """The start time of a channel, or its delay after the first where the file states no time."""
    if block.recorded_at is None:
        return f"{channel.starts_s:g} s"
    try:
        moment = datetime.fromisoformat(block.recorded_at) + timedelta(seconds=channel.starts_s)
    except OverflowError:
        return f"{channel.starts_s:g} s after {block.recorded_at}"
    return moment.isoformat().replace("+00:00", "Z")


def with_joined(contents: Contents, joined: Mapping[str, tuple[str, ...]], file: str) -> Contents:
    """The contents with channels that hold several channels one after the other, in the blocks that have them all.

    Raises FileError that names the channels where their units differ.
    """
    blocks = []
    for block in contents.blocks:
        channels = list(block.channels)
        for name, parts in joined.items():
            found = [channel for part in parts if (channel := block.headed(part)) is not None]
            if len(found) < len(parts):
                continue
            if len({channel.label for channel in found}) > 1:
                units = ", ".join(f"{channel.name!r} in {channel.label or 'no unit'}" for channel in found)
                raise FileError(file, f"channel {name!r}", f"joins channels of different units: {units}")
            values = np.concatenate([channel.values for channel in found])
            channels.append(Channel(name, found[0].label, values))
        blocks.append(replace(block, channels=tuple(channels)))
    return replace(contents, blocks=tuple(blocks))


Columns = Mapping[str, Floats]

_JITTER = 0.01  # of a step: less has no effect on a spectrum
_FINE = 0.2  # of a step: a clock's last digit that still tells a lost sample from rounding
_COARSE = (
    "the last digit of the clock is up to {:.2g} times a step: the rate is that of the line through all times, and a "
    "lost sample would not show"
)
_AS_COARSE_AS_A_STEP = (
    "samples are not evenly spaced by their times, of which the last digit is as coarse as a step, so that neither the "
    "rate nor lost samples show: write the times with more digits, or state sample_rate_hz in the rig description"
)
_REPEATED = (
    2  # steps of a last digit from which on times repeat; below, down to half, rounding looks like a lost sample
)
_KNOWN_RATE = 1e-3  # relative: less has no effect on a spectrum
_FEWEST_DIGITS, _MOST_DIGITS = 3, 9  # significant ones that instruments print; double precision has 16
_ROUNDING = 1e-9  # of a decade
_RESAMPLED = 0.1  # rms, of a step: more is no clock with jitter
_HALF = 0.5  # of a step, between neighbours; of a series, the part that must be complete


def mean_step(time: Floats) -> float:
    """The mean step between samples, in the unit of `time`."""
    with np.errstate(all="ignore"):
        return float((time[-1] - time[0]) / max(len(time) - 1, 1))


def even_rate(time: Floats) -> float | None:
    """Samples per unit of `time`; None where it is not evenly spaced and rising, but for the rounding of its digits."""
    step = mean_step(time)
    with np.errstate(all="ignore"):
        jitter = np.abs(time - (time[0] + step * np.arange(len(time)))).max()
    if step > 0 and jitter <= _JITTER * step:
        return 1 / step
    rounded = _rounded_clock(time)
    return None if rounded is None or _hides_gaps(*rounded) else 1 / rounded[0]


def _rounded_clock(time: Floats) -> tuple[float, float] | None:
    """The step between even samples whose printed times are `time`, and the coarsest last digit; None where no even
    clock has these times, or where they leave its rate open but for the samples that it may hide (`_hides_gaps`).

    The times have one number of decimals, or of significant digits. Step and start are those of the line through them,
    weighted by their digits; each time is within its last digit of the line.
    """
    for digit in (_last_decimal(time), _last_significant(time)):
        if digit is None:
            continue
        digits = np.broadcast_to(digit, time.shape)
        start, step, spread = _line_through(time, (digits.min() / digits) ** 2)
        coarsest, uncertainty = float(digits.max()), float(digits.min()) / math.sqrt(12 * spread)  # of rounded numbers
        with np.errstate(all="ignore"):
            off = np.abs(time - start - step * np.arange(len(time)))
            jumps = np.abs(np.diff(time) - step) / np.maximum(digits[1:], digits[:-1])
        fits = step > 0 and (off <= digits).all() and (jumps <= 1 + _JITTER).all()
        if fits and (_hides_gaps(step, coarsest) or uncertainty <= _KNOWN_RATE * step):
            return step, coarsest
    return None


def _hides_gaps(step: float, digit: float) -> bool:
    """Whether a lost sample looks like the rounding of a clock to its last digit."""
    return _HALF * step < digit < _REPEATED * step


def _line_through(time: Floats, weights: Floats) -> tuple[float, float, float]:
    """Start and step of the line through the weighted times of all samples, and the weighted square spread of their
    numbers; step 0 where there is none."""
    with np.errstate(all="ignore"):
        total = float(weights.sum())
        centred = np.arange(len(time)) - float(weights @ np.arange(len(time))) / total
        spread = max(float(weights @ centred**2), 1.0)
        step = float((weights * centred) @ time) / spread
        start = float(weights @ time) / total + step * float(centred[0])
    return (start, step, spread) if np.isfinite(step) and np.isfinite(start) else (0.0, 0.0, spread)


def _last_decimal(time: Floats) -> float | None:
    """The power of ten that all times are multiples of, within what doubles resolve; None where there is none."""
    with np.errstate(all="ignore"):
        span = float(np.ptp(time))
    if not 0 < span < np.inf:
        return None
    exponent = math.floor(math.log10(span))
    digits = (10.0**power for power in range(exponent, exponent - _MOST_DIGITS, -1))
    return next((digit for digit in digits if _are_multiples(time, digit)), None)


def _last_significant(time: Floats) -> Floats | None:
    """The last digit of each time (samples,) where all have the same number of significant digits; None where they have
    not. That of 0 is the finest."""
    size = np.abs(time)
    if not np.isfinite(size).all() or not size.any():
        return None
    decades = np.floor(np.log10(np.where(size > 0, size, size[size > 0].min())) + _ROUNDING)
    for digits in range(_FEWEST_DIGITS, _MOST_DIGITS):
        last = 10.0 ** (decades - digits + 1)
        if _are_multiples(time, last):
            return np.asarray(last)
    return None


def _are_multiples(time: Floats, digit: Floats | float) -> bool:
    with np.errstate(all="ignore"):
        counts = time / digit
        return bool(np.abs(counts - np.rint(counts)).max() < _JITTER)


def evenly_sampled(columns: Columns, time: Floats) -> tuple[dict[str, Floats], float, str]:
    """The columns at even times, samples per unit of `time`, and what was done.

    A clock with jitter has its rate by regression, and the columns are interpolated by cubic splines. Of one that
    misses samples the longest part without a gap is used. Raises ValueError where that is less than half, where the
    clock varies by more, or where its last digit is as coarse as a step, except where it has a part without a gap so
    long that its rate is known all the same.
    """
    ends, rounded = _gaps(time), _rounded_clock(time)
    too_coarse = rounded is not None and _hides_gaps(*rounded)
    if len(ends):
        part, note = _longest_without(ends, time, too_coarse)
        whole, sampled, further = evenly_sampled({name: column[part] for name, column in columns.items()}, time[part])
        return whole, sampled, "; ".join(filter(None, (note, further)))
    rate = even_rate(time)
    if rate is not None:
        coarse = rounded is not None and rounded[1] > _FINE * rounded[0]
        return dict(columns), rate, _COARSE.format(rounded[1] * rate) if rounded and coarse else ""
    if too_coarse:
        raise ValueError(_AS_COARSE_AS_A_STEP)
    start, step, _ = _line_through(time, np.ones(len(time)))
    with np.errstate(all="ignore"):
        off = time - (start + step * np.arange(len(time)))
        is_clock = step > 0 and np.abs(np.diff(time) - step).max() < _HALF * step and off.std() <= _RESAMPLED * step
    if not is_clock:
        raise ValueError("samples are not evenly spaced")
    even = start + step * np.arange(len(time))
    even = even[(even >= time[0]) & (even <= time[-1])]
    if not all(np.isfinite(column).all() for column in columns.values()):
        raise ValueError("samples are not evenly spaced, and a channel holds no finite number in some")
    from scipy.interpolate import CubicSpline  # takes 0.4 s to load, which few need

    with np.errstate(all="ignore"):
        resampled = {name: np.asarray(CubicSpline(time, column)(even)) for name, column in columns.items()}
    jitter = f"{100 * off.std() / step:.2g} % of a step rms"
    return resampled, 1 / step, f"the clock varies by {jitter}: the samples were interpolated at even times"


def _gaps(time: Floats) -> Indices:
    """The last samples before the gaps of a clock: steps of two or more of its usual steps, where all are whole
    numbers of them, within a quarter; empty where they are not."""
    with np.errstate(all="ignore"):
        steps = np.diff(time) / np.median(np.diff(time)) if len(time) > 1 else np.zeros(0)
        is_clock = bool((np.abs(steps - np.rint(steps)) < _HALF**2).all() and (steps > _HALF).all())
    return np.flatnonzero(steps > 2 - _HALF) if is_clock else np.zeros(0, dtype=np.intp)


def _longest_without(ends: Indices, time: Floats, too_coarse: bool) -> tuple[slice, str]:
    """The longest part between the gaps after these samples, and a note; raises ValueError where that is too short.

    What looks like lost samples of a clock that is `too_coarse` may be its rounding.
    """
    usual = float(np.median(np.diff(time)))
    missing = int(np.rint(np.diff(time)[ends] / usual - 1).sum())
    starts, stops = np.append(0, ends + 1), np.append(ends + 1, len(time))
    longest = int(np.argmax(stops - starts))
    part = slice(int(starts[longest]), int(stops[longest]))
    if too_coarse and part.stop - part.start < max(_HALF * len(time), 1 / _KNOWN_RATE):
        raise ValueError(_AS_COARSE_AS_A_STEP)
    gaps = (
        f"the clock misses {missing} {'sample' if missing == 1 else 'samples'}, the first after {time[ends[0]]:.6g} s"
    )
    whole = f"the longest part without a gap has {part.stop - part.start} of {len(time)}"
    if part.stop - part.start < _HALF * len(time):
        raise ValueError(f"{gaps}; {whole}, less than half: record again without losing samples")
    return part, f"{gaps}: {whole}, which alone is used"


def complete_lines(columns: Columns) -> tuple[dict[str, Floats], str]:
    """The columns without the lines in which one has NaN."""
    missing = _missing(columns)
    if not missing.any():
        return dict(columns), ""
    note = f"{missing.sum()} of {len(missing)} lines without a number in {_lacking(columns)} are left out"
    return {name: column[~missing] for name, column in columns.items()}, note


def longest_complete(columns: Columns) -> tuple[dict[str, Floats], str]:
    """The longest part of the series without NaN; raises ValueError where that is less than half."""
    missing = _missing(columns)
    if not missing.any():
        return dict(columns), ""
    ends = np.flatnonzero(np.append(missing, True))
    starts = np.append(0, ends[:-1] + 1)
    longest = int(np.argmax(ends - starts))
    first, last = int(starts[longest]), int(ends[longest])
    gaps = f"{missing.sum()} of {len(missing)} samples hold no number in {_lacking(columns)}"
    part = f"the longest part without such samples has {last - first}"
    if last - first < _HALF * len(missing):
        raise ValueError(f"{gaps}; {part}, less than half: record again within the range of the instrument")
    return {name: column[first:last] for name, column in columns.items()}, f"{gaps}: {part}, which alone is used"


def _missing(columns: Columns) -> Mask:
    """Which lines have NaN in a column; none where the columns differ in length, which is refused later."""
    if len({len(column) for column in columns.values()}) != 1:
        return np.zeros(0, bool)
    return np.asarray(np.isnan(np.stack([*columns.values()])).any(axis=0))


def _lacking(columns: Columns) -> str:
    return ", ".join(name for name, column in columns.items() if np.isnan(column).any())


def sorted_spectrum(columns: Columns) -> tuple[dict[str, Floats], list[str]]:
    """The lines of a spectrum by rising `frequency_hz`; several readings of a frequency are averaged.

    Readings of a frequency follow each other, or come from a sweep up and down. Raises ValueError where a sweep starts
    again, or where the readings differ alike at all frequencies: these may be several recordings.
    """
    frequency = columns["frequency_hz"]
    rises = np.diff(frequency)
    if len({len(column) for column in columns.values()}) != 1 or not np.isfinite(frequency).all() or (rises > 0).all():
        return dict(columns), []
    directions = np.sign(rises[rises != 0])
    distinct, index, counts = np.unique(frequency, return_inverse=True, return_counts=True)
    is_repeated = len(distinct) < len(frequency)
    if is_repeated and np.count_nonzero(np.diff(directions)) > 1:
        again = int(np.flatnonzero(np.diff(directions))[1])
        at = frequency[np.flatnonzero(rises != 0)[again] + 1]
        reason = f"the frequencies start again at {at:g} Hz and repeat: these are several sweeps"
        raise ValueError(f"{reason}, which may be several recordings; one recording may sweep up and down once")
    notes = ["the frequencies do not rise: the lines were sorted"] if (rises < 0).any() else []
    if is_repeated:
        spread = _spread_of_readings(columns, index, counts)
        notes.append(f"{(counts > 1).sum()} frequencies have several readings, up to {counts.max()}: averaged{spread}")
    averaged = {
        name: distinct if name == "frequency_hz" else np.bincount(index, column) / counts
        for name, column in columns.items()
    }
    return averaged, notes


def _spread_of_readings(columns: Columns, index: Indices, counts: Indices) -> str:
    """How the readings of one frequency scatter, in words; `index` (readings,) is each one's frequency, of which there
    are `counts` (frequencies,).

    With e the departure of a reading from the mean of its frequency, relative to the root mean square there, and b the
    mean of e over the first readings of all frequencies, over the second ones and so on, noise makes the quotient of
    the squares that b explains and of the rest one of Fisher's F: a change of the gain moves all frequencies alike.
    """
    if not {"frf_re_pc_per_n", "frf_im_pc_per_n"} <= columns.keys():
        return ""
    response = columns["frf_re_pc_per_n"] + 1j * columns["frf_im_pc_per_n"]
    several = (counts > 1) & (np.bincount(index, ~np.isfinite(response)) == 0)
    if not several.any():
        return ""
    order = np.argsort(index, kind="stable")
    order = order[several[index[order]]]
    line, turn = index[order], np.concatenate([np.arange(count) for count in counts[several]])
    values = response[order]
    size = np.sqrt(np.bincount(line, np.abs(values) ** 2, len(counts)) / counts)[line]
    off = (values - _mean_of(values, line)[line]) / np.where(size > 0, size, 1.0)
    alike = _mean_of(off, turn)
    explained, rest = (float((np.abs(part) ** 2).sum()) for part in (alike[turn], off - alike[turn]))
    free, freedom = int((counts[several] - 1).sum()), len(alike) - 1
    scatter = math.sqrt((explained + rest) / free)
    if scatter < _ROUNDING:
        return ", all equal"
    words = f"; they scatter by {100 * scatter:.2g} % (rms)"
    by_noise = max(rest / max(free - freedom, 1), _ROUNDING**2)
    if free == freedom or fdtrc(2 * freedom, 2 * (free - freedom), explained / freedom / by_noise) > _BY_CHANCE:
        return words
    number = int(np.abs(alike - alike[0]).argmax())
    other = values[turn == number]
    first = values[(turn == 0) & np.isin(line, line[turn == number])]
    ratio = float((np.conj(first) * other).real.sum() / max((np.abs(first) ** 2).sum(), _TINY))
    differ = f"differ alike at all of them: number {number + 1} is {ratio:.3g} times the first"
    if math.sqrt(explained / free) > _ONE_GAIN:
        reason = f"the readings of single frequencies {differ}; these may be several recordings (another sensor, place"
        raise ValueError(f"{reason}, day or range), and one recording is needed for each, or a column that says which")
    return f"{words}, and {differ}"


def _mean_of(values: Complexes, group: Indices) -> Complexes:
    """The mean of the values of each group; 0 of an empty one."""
    sums = np.bincount(group, values.real) + 1j * np.bincount(group, values.imag)
    return np.asarray(sums / np.maximum(np.bincount(group), 1))
