"""The curves of a file, where a rig description says what one is: all of the file, a group of rows, or what a channel
tells apart."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from underskin.errors import FileError
from underskin.recordings.channels import Block, Contents
from underskin.recordings.rig_description import CurveChannel

_MOST_CURVES = 1000  # of a block
_LEAST_SAMPLES = 2  # of a curve


def curve_parts(blocks: Sequence[Block], curves: str | CurveChannel | None, file: str) -> list[tuple[Block, str]]:
    """The curves of the blocks that hold a rig's channels, as `curves` of the rig description has it, each with the
    name of the block that it was in.

    Raises FileError where a channel changes too often to tell curves apart.
    """
    if curves == "file":
        return [(_joined(blocks), blocks[0].name)]
    return [(part, block.name) for block in blocks for part in _parts(block, curves, file)]


def _parts(block: Block, curves: str | CurveChannel | None, file: str) -> list[Block]:
    if curves is None:
        return [block]
    if isinstance(curves, str):
        return list(_cut(block, block.group_starts or (0,), []))
    name = curves.channel or curves.segments or ""
    channel = block.headed(name)
    assert channel is not None
    values = channel.values.real
    changed = np.diff(values) < 0 if curves.channel is None else np.diff(values) != 0
    starts = (0, *(np.flatnonzero(changed) + 1).tolist())
    ends = (*starts[1:], len(values))
    short = min(end - start for start, end in zip(starts, ends, strict=True)) < _LEAST_SAMPLES
    if short or len(starts) > _MOST_CURVES:
        reason = (
            f"changes {len(starts) - 1} times in {len(values)} samples: it must tell up to {_MOST_CURVES} curves of at "
            f"least {_LEAST_SAMPLES} samples apart"
        )
        raise FileError(file, f"channel {name!r}", reason)
    names = [f"{values[start]:g}" for start in starts] if curves.channel is not None else []
    return list(_cut(block, starts, names if len(set(names)) == len(names) else []))


def _cut(block: Block, starts: Sequence[int], names: Sequence[str]) -> Iterator[Block]:
    """The block from each start to the next; named, or else numbered."""
    for number, start in enumerate(starts):
        end = starts[number + 1] if number + 1 < len(starts) else None
        own = names[number] if names else str(number + 1)
        name = f"{block.name} {own}".strip() if len(starts) > 1 else block.name
        channels = tuple(replace(channel, values=channel.values[start:end]) for channel in block.channels)
        yield Block(name, channels, block.sample_rate_hz, block.recorded_at)


def _joined(blocks: Sequence[Block]) -> Block:
    """One block of all, with the channels that every one has in one unit, in their order."""
    first = blocks[0]
    channels = []
    for channel in first.channels:
        alike = [block.channel(channel.name) for block in blocks]
        whole = [one for one in alike if one is not None and one.unit == channel.unit]
        if len(whole) == len(blocks):
            values = np.concatenate([one.values for one in whole])
            channels.append(replace(channel, values=values))
    return Block(first.name, tuple(channels), first.sample_rate_hz, first.recorded_at)


def doubts(contents: Contents, curves: str | CurveChannel | None) -> list[str]:
    """What the user should know of groups of rows that are read as one curve although nobody said so."""
    most = max((len(block.group_starts) for block in contents.blocks), default=0)
    if curves is not None or most < 2:
        return []
    question = "say curves: groups if each is one, or curves: file"
    return [f"{most} groups of rows, which blank or comment lines part, are read as one curve: {question}"]
