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

import numpy as np
from scipy.interpolate import CubicSpline

from underskin.errors import FileError
from underskin.recordings.channels import Block, Channel, Contents
from underskin.units import Floats, Mask

_OFF_SAMPLE = 0.05  # of a step: at half the rate a phase of 9°, and Re FRF 1.2 % too small
_LEAST_COMMON = 2  # samples in common


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
    first, last = min(used.values(), key=_starts_s), max(used.values(), key=_starts_s)
    start_times = f"{first.name!r} starts at {_time(block, first)}, {last.name!r} at {_time(block, last)}"
    if block.sample_rate_hz is None:
        raise FileError(file, "", f"{start_times}, and no sample rate is stated by which to align them")
    late = {name: (last.starts_s - channel.starts_s) * block.sample_rate_hz for name, channel in used.items()}
    skipped = {name: round(samples) for name, samples in late.items()}
    odd = next((name for name in used if abs(late[name] - skipped[name]) > _OFF_SAMPLE), None)
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


def _starts_s(channel: Channel) -> float:
    return channel.starts_s


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
    start, step = _regression(time)
    if not 0 < step < np.inf:
        return None
    digit = _last_digit(time, step)
    off = np.abs(time - (start + step * np.arange(len(time)))).max()
    is_rounded = digit <= _FINE * step and off <= digit and np.abs(np.diff(time) - step).max() <= 2 * digit
    return 1 / step if is_rounded else None


def _regression(time: Floats) -> tuple[float, float]:
    """Start and step of the line through the times of all samples; step 0 where there is none."""
    index = np.arange(len(time)) - (len(time) - 1) / 2
    with np.errstate(all="ignore"):
        step = float(index @ time / max(float(index @ index), 1.0))
        start = float(time.mean()) + step * float(index[0])
    return (start, step) if np.isfinite(step) and np.isfinite(start) else (0.0, 0.0)


def _last_digit(time: Floats, step: float) -> float:
    """The power of ten that all times are multiples of, within what doubles resolve; 0 where there is none near the
    step."""
    exponent = math.ceil(math.log10(step))
    for digit in (10.0**power for power in range(exponent, exponent - 6, -1)):
        counts = time / digit
        if np.abs(counts - np.rint(counts)).max() < _JITTER:
            return digit
    return 0.0


def evenly_sampled(columns: Columns, time: Floats) -> tuple[dict[str, Floats], float, str]:
    """The columns at even times, samples per unit of `time`, and what was done.

    A clock with jitter has its rate by regression, and the columns are interpolated by cubic splines. Raises ValueError
    where the clock misses samples or varies by more.
    """
    rate = even_rate(time)
    if rate is not None:
        return dict(columns), rate, ""
    start, step = _regression(time)
    with np.errstate(all="ignore"):
        off = time - (start + step * np.arange(len(time)))
        is_clock = step > 0 and np.abs(np.diff(time) - step).max() < _HALF * step and off.std() <= _RESAMPLED * step
    if not is_clock:
        raise ValueError("samples are not evenly spaced")
    even = start + step * np.arange(len(time))
    even = even[(even >= time[0]) & (even <= time[-1])]
    if not all(np.isfinite(column).all() for column in columns.values()):
        raise ValueError("samples are not evenly spaced, and a channel holds no finite number in some")
    with np.errstate(all="ignore"):
        resampled = {name: np.asarray(CubicSpline(time, column)(even)) for name, column in columns.items()}
    jitter = f"{100 * off.std() / step:.2g} % of a step rms"
    return resampled, 1 / step, f"the clock varies by {jitter}: the samples were interpolated at even times"


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
    again: these may be several recordings.
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
        notes.append(f"{(counts > 1).sum()} frequencies have several readings, up to {counts.max()}: averaged")
    averaged = {
        name: distinct if name == "frequency_hz" else np.bincount(index, column) / counts
        for name, column in columns.items()
    }
    return averaged, notes
