"""Channels brought to common samples: cut where they were started at different times (`aligned`), or joined one after
the other where an instrument writes the parts of a curve side by side (`with_joined`)."""

from collections.abc import Collection, Mapping
from dataclasses import replace
from datetime import datetime, timedelta

import numpy as np

from underskin.errors import FileError
from underskin.recordings.channels import Block, Channel, Contents

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
