"""Channels that a file says were started at different times, brought to the samples that they have in common."""

from collections.abc import Collection
from dataclasses import replace
from datetime import datetime, timedelta

from underskin.errors import FileError
from underskin.recordings.channels import Block, Channel, Contents

_OFF_SAMPLE = 0.05  # of a step: at half the rate a phase of 9°, and Re FRF 1.2 % too small
_LEAST = 2  # samples in common


def aligned(contents: Contents, names: Collection[str], file: str) -> Contents:
    """The contents with the channels of some names cut to their common samples in every block, as the file states their
    starts; a warning says so.

    Raises FileError that names both channels where their rates differ, or their starts do so by parts of a sample.
    """
    blocks, warnings = [], list(contents.warnings)
    for block in contents.blocks:
        used = {one.name: one for name in names if (one := block.headed(name)) is not None}
        rate = _common_rate(list(used.values()), file)
        with_rate = block if rate is None else replace(block, sample_rate_hz=rate)
        if len({one.starts_s for one in used.values()}) < 2:
            blocks.append(with_rate)
            continue
        cut, told = _cut(with_rate, used, file)
        blocks.append(cut)
        warnings += told
    return replace(contents, blocks=tuple(blocks), warnings=tuple(dict.fromkeys(warnings)))


def _common_rate(used: list[Channel], file: str) -> float | None:
    sampled = {one.sample_rate_hz: one for one in used if one.sample_rate_hz is not None}
    if len(sampled) > 1:
        (first, one), (second, other), *_ = sampled.items()
        reason = f"{one.name!r} has {first:g} samples a second, {other.name!r} {second:g}: they must have one rate"
        raise FileError(file, "", reason)
    return next(iter(sampled), None)


def _cut(block: Block, used: dict[str, Channel], file: str) -> tuple[Block, list[str]]:
    """The block with the used channels cut, and in words how; as it is where they start within one sample."""
    first, last = min(used.values(), key=_starts_s), max(used.values(), key=_starts_s)
    apart = f"{first.name!r} starts at {_time(block, first)}, {last.name!r} at {_time(block, last)}"
    if block.sample_rate_hz is None:
        raise FileError(file, "", f"{apart}, and no sample rate is stated by which to align them")
    late = {name: (last.starts_s - one.starts_s) * block.sample_rate_hz for name, one in used.items()}
    skipped = {name: round(samples) for name, samples in late.items()}
    odd = next((name for name in used if abs(late[name] - skipped[name]) > _OFF_SAMPLE), None)
    if odd is not None:
        reason = f"that is {late[odd]:.4g} samples: they can be aligned by whole samples alone"
        raise FileError(file, "", f"{apart}: {reason}; resample one of them, or correct the times")
    if not any(skipped.values()):
        return block, []
    count = min(len(one.values) - skipped[name] for name, one in used.items())
    if count < _LEAST:
        raise FileError(file, "", f"{apart}: they have no samples in common")
    channels = tuple(
        replace(one, values=one.values[skipped[one.name] : skipped[one.name] + count]) if one.name in used else one
        for one in block.channels
    )
    told = f"{apart}: they were aligned, with {count} samples in common"
    return replace(block, channels=channels), [told]


def _starts_s(channel: Channel) -> float:
    return channel.starts_s


def _time(block: Block, channel: Channel) -> str:
    """When a channel starts, or how long after the first where the file does not say when that was."""
    if block.recorded_at is None:
        return f"{channel.starts_s:g} s"
    try:
        moment = datetime.fromisoformat(block.recorded_at) + timedelta(seconds=channel.starts_s)
    except OverflowError:
        return f"{channel.starts_s:g} s after {block.recorded_at}"
    return moment.isoformat().replace("+00:00", "Z")
