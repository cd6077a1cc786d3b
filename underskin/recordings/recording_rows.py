"""The rows of a file's blocks that belong to one recording: curves one after another, and tables with a row a line."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from underskin.errors import FileError
from underskin.recordings.channels import Block, TextColumn
from underskin.recordings.rig_description import CurveChannel, RigDescription, SignalMapping
from underskin.units import Indices

_MOST_CURVES = 1000  # of a block
_LEAST_OF_CURVE = 2  # of a curve


def curve_parts(blocks: Sequence[Block], curves: str | CurveChannel | None, file: str) -> list[tuple[Block, str]]:
    """The curves of the blocks that hold a rig's channels, by `curves` of the rig description, each with the name of
    its block.

    Raises FileError where a channel changes too often to separate curves.
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
    short = min(end - start for start, end in zip(starts, ends, strict=True)) < _LEAST_OF_CURVE
    if short or len(starts) > _MOST_CURVES:
        reason = (
            f"changes {len(starts) - 1} times in {len(values)} samples: it must tell up to {_MOST_CURVES} curves of at "
            f"least {_LEAST_OF_CURVE} samples apart"
        )
        raise FileError(file, f"channel {name!r}", reason)
    names = [f"{values[start]:g}" for start in starts] if curves.channel is not None else []
    return list(_cut(block, starts, names if len(set(names)) == len(names) else []))


def _cut(block: Block, starts: Sequence[int], names: Sequence[str]) -> Iterator[Block]:
    """The parts of the block from each start to the next; named, or else numbered."""
    for index, start in enumerate(starts):
        end = starts[index + 1] if index + 1 < len(starts) else None
        suffix = names[index] if names else str(index + 1)
        name = f"{block.name} {suffix}".strip() if len(starts) > 1 else block.name
        yield block.at(slice(start, end), name)


def rows_of_recordings(rig: RigDescription, block: Block, file: str) -> list[Block]:
    """The rows of each recording, in the order of their first rows: those with the same values in all columns that hold
    fields of the recording.

    Raises FileError where a column has too many values to tell recordings apart.
    """
    held = [block.words(signal.channel) for signal in rig.row_fields]
    texts = (_filled(column) if any(column is words for words in held) else column for column in block.texts)
    block = replace(block, texts=tuple(texts))
    columns = {signal.channel: _codes(block, signal.channel) for signal in rig.row_fields}
    if not columns:
        return [block]
    rows = min(map(len, columns.values()))
    if rows == 0:
        raise FileError(file, ", ".join(map(repr, columns)), "holds no values")
    codes = np.stack([column[:rows] for column in columns.values()])
    _, first, index = np.unique(codes, axis=1, return_index=True, return_inverse=True)
    if len(first) > max(1, rows / _LEAST_OF_CURVE):
        without = [np.delete(codes, row, axis=0) for row in range(len(codes) if len(codes) > 1 else 0)]
        fewest = np.argmin([np.unique(others, axis=1).shape[1] for others in without]) if without else 0
        most = list(columns)[int(fewest)]
        values = len(np.unique(columns[most]))
        reason = f"has {values} values in {rows} rows, which makes {len(first)} recordings of them"
        raise FileError(file, f"column {most!r}", f"{reason}: a field of the recording has one value for all its rows")
    order = np.argsort(first)
    named = rig.recording.get("sensor")
    sensors = block.words(named.channel) if isinstance(named, SignalMapping) else None
    parts = np.split(np.argsort(index.ravel(), kind="stable"), np.cumsum(np.bincount(index.ravel()))[:-1])
    return [
        block.at(parts[group], f"{sensors.texts[sensors.codes[first[group]]] if sensors else ''} {number}".strip())
        for number, group in enumerate(order.tolist(), start=1)
    ]


def _filled(column: TextColumn) -> TextColumn:
    """A column of words in which an empty cell repeats the one above."""
    filled = np.array([bool(text) for text in column.texts])[column.codes]
    above = np.maximum.accumulate(np.where(filled, np.arange(len(filled)), 0))
    return replace(column, codes=column.codes[above])


def _codes(block: Block, name: str) -> Indices:
    """The rows of a column, (rows,), as the indices of their different values."""
    words, channel = block.words(name), block.headed(name)
    if words is not None:
        return words.codes
    assert channel is not None
    return np.unique(channel.values, return_inverse=True)[1]


def _joined(blocks: Sequence[Block]) -> Block:
    """All blocks as one, with the channels that every block has in the same unit, in their order."""
    first = blocks[0]
    channels = []
    for channel in first.channels:
        namesakes = [block.channel(channel.name) for block in blocks]
        same_unit = [namesake for namesake in namesakes if namesake is not None and namesake.unit == channel.unit]
        if len(same_unit) == len(blocks):
            values = np.concatenate([namesake.values for namesake in same_unit])
            channels.append(replace(channel, values=values))
    return Block(first.name, tuple(channels), first.sample_rate_hz, first.recorded_at)
