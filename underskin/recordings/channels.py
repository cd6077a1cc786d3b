"""The content of an instrument's file before a rig description maps its channels."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from underskin.recordings.readers.unit_labels import in_brackets, labelled_unit
from underskin.units import Floats, Indices

Values = Floats | NDArray[np.complex128]
FIRST_YEAR = 1970  # LabVIEW writes an unset clock as the beginning of 1904


@dataclass(frozen=True, eq=False)
class Channel:
    """One column: its name as written, its unit as labelled (empty without one), its values.

    `sample_rate_hz`, and `starts_s`, the time of its first sample after `recorded_at` of the block [s], where stated.
    """

    name: str
    unit: str
    values: Values
    sample_rate_hz: float | None = None
    starts_s: float = 0.0

    @property
    def label(self) -> str:
        """The unit as labelled, or in its name: `Force (lbs)`; empty without one."""
        return self.unit or labelled_unit(self.name)

    @property
    def is_complex(self) -> bool:
        """Whether its values are complex."""
        return np.iscomplexobj(self.values)


@dataclass(frozen=True, eq=False)
class TextColumn:
    """A column of words: its name, its different `texts`, and for each row the index of its text, (rows,)."""

    name: str
    texts: tuple[str, ...]
    codes: Indices


def text_left_out(name: str, example: str) -> str:
    """The message that a column of words is not used."""
    return f"column {name!r} holds text, such as {example[:_SHOWN]!r}, and is left out"


_SHOWN, _NAMED = 30, 5  # letters of a cell, and names, in a message
_Column = TypeVar("_Column", Channel, TextColumn)


@dataclass(frozen=True, eq=False)
class Block:
    """Channels acquired together; `sample_rate_hz` where all are evenly sampled at one rate, `recorded_at` the stated
    start of the acquisition (ISO 8601). `group_starts` are the first samples of groups of rows in a text, separated by
    blank or comment lines; empty for a single group. `texts` are its columns of words."""

    name: str
    channels: tuple[Channel, ...]
    sample_rate_hz: float | None = None
    recorded_at: str | None = None
    group_starts: tuple[int, ...] = ()
    texts: tuple[TextColumn, ...] = ()

    def channel(self, name: str) -> Channel | None:
        """The channel of that name, or None."""
        return next((channel for channel in self.channels if channel.name == name), None)

    def headed(self, name: str) -> Channel | None:
        """The channel of that name, or the only one whose heading is it with a unit in brackets: `Piezo [V]`."""
        return _headed(self.channels, name)

    def words(self, name: str) -> TextColumn | None:
        """The column of words of that name, as for `headed`."""
        return _headed(self.texts, name)

    def at(self, rows: slice | Indices, name: str) -> "Block":
        """These rows as a block of that name; a channel that ends before the others has fewer of them."""
        channels = tuple(replace(channel, values=_at(channel.values, rows)) for channel in self.channels)
        texts = tuple(replace(column, codes=_at(column.codes, rows)) for column in self.texts)
        return Block(name, channels, self.sample_rate_hz, self.recorded_at, texts=texts)


def _headed(columns: Sequence[_Column], name: str) -> _Column | None:
    exact = next((column for column in columns if column.name == name), None)
    named = [column for column in columns if (in_brackets(column.name) or ("",))[0] == name]
    return exact or (named[0] if len(named) == 1 else None)


def _at(values: Any, rows: slice | Indices) -> Any:
    return values[rows] if isinstance(rows, slice) else values[rows[rows < len(values)]]


@dataclass(frozen=True, eq=False)
class Contents:
    """A file: its blocks, its stated `properties`, `warnings` for the user, and how it was read where that had to be
    inferred (`layout`, in words)."""

    blocks: tuple[Block, ...]
    properties: Mapping[str, str | float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    layout: str = ""

    def described(self) -> str:
        """The columns of words, the channels and their units, for an error message."""
        units = [(channel.name, f"[{channel.unit or '?'}]") for block in self.blocks for channel in block.channels]
        names = [name if name.endswith(unit) else f"{name} {unit}" for name, unit in units]
        words = [f"{column.name} [words]" for block in self.blocks for column in block.texts]
        different = list(dict.fromkeys([*words, *names]))
        return ", ".join(different[:20]) + (", …" if len(different) > 20 else "") if different else "no channels"


@dataclass(frozen=True, eq=False)
class Document:
    """A file that holds a campaign: the document (`campaign/1`, not yet checked), and warnings."""

    campaign: Any
    warnings: tuple[str, ...] = ()


def together(tables: Mapping[str, Contents], place: str, warning: str) -> Contents:
    """Several tables of a file as its contents: a block is called by its table and its name, and a property by its
    block (`run 1.preload`); `place` and `warning` are the forms of a table's name, and of it and a warning."""
    blocks = tuple(
        replace(block, name=f"{name} {block.name}".strip()) for name, table in tables.items() for block in table.blocks
    )
    properties = {key: value for name, table in tables.items() for key, value in _by_block(name, table)}
    warnings = [warning.format(name, text) for name, table in tables.items() for text in table.warnings]
    layout = "; ".join(f"{place.format(name)}: {table.layout}" for name, table in tables.items())
    return Contents(blocks, properties, tuple(dict.fromkeys(warnings)), layout)


def _by_block(name: str, table: Contents) -> Iterator[tuple[str, str | float]]:
    """The properties of a table, each under the names of the blocks that it is about."""
    blocks = [f"{name} {block.name}".strip() for block in table.blocks]
    numbered = tuple(f"{block.name}." for block in table.blocks if block.name)
    for key, value in table.properties.items():
        about = [f"{name} {key}"] if numbered and key.startswith(numbered) else [f"{block}.{key}" for block in blocks]
        yield from ((by_block, value) for by_block in about)


def some_of(names: Sequence[str]) -> str:
    """The first of many names, with the count of the others."""
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return ", ".join(names[:_NAMED]) + more


def with_distinct_names(channels: list[Channel]) -> tuple[Channel, ...]:
    """The channels with repeated names numbered, `force (2)`."""
    seen: dict[str, int] = {}
    distinct = []
    for channel in channels:
        seen[channel.name] = count = seen.get(channel.name, 0) + 1
        name = channel.name if count == 1 else f"{channel.name} ({count})"
        distinct.append(replace(channel, name=name))
    return tuple(distinct)


def as_values(stored: NDArray[Any]) -> Values:
    """Stored numbers as float64, or complex128."""
    return stored.astype(np.complex128) if stored.dtype.kind == "c" else stored.astype(np.float64)
