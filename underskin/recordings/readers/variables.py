"""Named arrays and structures, as MATLAB, NumPy and HDF5 files hold them, as blocks of channels.

Vectors are channels, `name`; a matrix is one channel a column, `name(:,1)`, a table of records one channel a field.
Vectors of texts are columns of words, single numbers and texts properties. A structure is a block named after its path,
`run.sensor`; an array of structures is `run(1)`, `run(2)`. Signals that Siemens Testlab exports are told by their
`x_values` and `y_values`: those with one abscissa are a block, evenly sampled over time. What holds no numbers is left
out with a warning.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from underskin.errors import FileError
from underskin.recordings.channels import (
    Block,
    Channel,
    Contents,
    TextColumn,
    as_values,
    some_of,
    with_distinct_names,
)
from underskin.recordings.readers.unit_labels import unit

MOST_COLUMNS = 1000  # of a matrix
_DEEPEST = 8  # structures in structures
_NUMBERS = "iufc"


@dataclass(frozen=True)
class Labelled:
    """An array and its unit as stated."""

    values: Any
    unit: str


@dataclass
class _Found:
    """What the structures hold, in their order; `left_out`: the names of other variables."""

    blocks: list[Block] = field(default_factory=list)
    properties: dict[str, str | float] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)
    signals: dict[tuple[float, float, int, str], list[tuple[str, Channel]]] = field(default_factory=dict)


def contents(variables: Mapping[str, Any], file: str) -> Contents:
    """The channels of nested mappings of names to arrays, numbers, texts and `Labelled`; raises FileError where
    structures are nested too deep."""
    found = _Found()
    _walk(variables, "", 0, found, file)
    signals = [_signals(axis, held, len(found.signals) > 1) for axis, held in found.signals.items()]
    named = some_of(list(map(repr, found.left_out)))
    warnings = (f"{named}: no numbers of one or two axes, left out",) if named else ()
    return Contents((*found.blocks, *signals), found.properties, warnings)


def _walk(structure: Mapping[str, Any], path: str, depth: int, found: _Found, file: str) -> None:
    if depth > _DEEPEST:
        raise FileError(file, path, f"structures are nested more than {_DEEPEST} deep")
    channels: list[Channel] = []
    texts: list[TextColumn] = []
    inner: list[tuple[str, Mapping[str, Any]]] = []
    for name, given in structure.items():
        here = f"{path}.{name}" if path else name
        value, label = (given.values, given.unit) if isinstance(given, Labelled) else (given, "")
        if parts := _structures(here, value):
            inner += parts
        elif isinstance(value, str | bool | int | float | np.number):
            found.properties[here] = value if isinstance(value, str) else float(np.real(value))
        elif _are_all(value, str):
            different, codes = np.unique(np.asarray(value, dtype=str), return_inverse=True)
            texts.append(TextColumn(name, tuple(different.tolist()), codes))
        elif isinstance(value, np.ndarray) and (columns := list(_columns(name, label, value))):
            channels += columns
        else:
            found.left_out.append(here)
    if channels:
        found.blocks.append(Block(path, with_distinct_names(channels), texts=tuple(texts)))
    for here, part in inner:
        if not _add_signal(here, part, found):
            _walk(part, here, depth + 1, found, file)


def _structures(name: str, value: Any) -> list[tuple[str, Mapping[str, Any]]]:
    """The structures of a value that is one, or a list of them, by their names; none of another."""
    if isinstance(value, Mapping):
        return [(name, value)]
    numbered = enumerate(value, start=1) if _are_all(value, Mapping) else ()
    return [(f"{name}({number})", part) for number, part in numbered]


def _are_all(value: Any, kind: type) -> bool:
    """Whether a value is a list, as of cells, or an array with one axis, of parts of this kind alone."""
    is_list = isinstance(value, list) or (
        isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "UO"
    )
    return is_list and len(value) > 0 and all(isinstance(part, kind) for part in value)


def _columns(name: str, label: str, array: Any) -> Iterator[Channel]:
    """The channels of an array; none where it is of another form."""
    if array.dtype.names and array.ndim == 1:
        for record_field in array.dtype.names:
            yield from _columns(record_field, "", array[record_field])
    elif array.dtype.kind in _NUMBERS and array.ndim == 1:
        yield Channel(name, label, as_values(array))
    elif array.dtype.kind in _NUMBERS and array.ndim == 2 and array.shape[1] <= MOST_COLUMNS:
        for column in range(array.shape[1]):
            yield Channel(f"{name}(:,{column + 1})", label, as_values(array[:, column]))


def _add_signal(path: str, structure: Mapping[str, Any], found: _Found) -> bool:
    """Add the channels of a structure that is a signal; whether it is one."""
    abscissa, ordinate = structure.get("x_values"), structure.get("y_values")
    if not isinstance(abscissa, Mapping) or not isinstance(ordinate, Mapping):
        return False
    start, step = (abscissa.get(name, 0.0) for name in ("start_value", "increment"))
    array = ordinate.get("values")
    if not isinstance(array, np.ndarray) or not all(isinstance(value, int | float) for value in (start, step)):
        return False
    record = structure.get("function_record")
    stated = record.get("name") if isinstance(record, Mapping) else None
    columns = list(_columns(path, _label(ordinate), array))
    named = [stated] if isinstance(stated, str) else list(stated) if isinstance(stated, np.ndarray | list) else []
    names = [str(name) for name in named] if len(named) == len(columns) else [column.name for column in columns]
    axis = (float(start), float(step), len(array), _label(abscissa))
    held = found.signals.setdefault(axis, [])
    held += [(path, replace(column, name=name)) for name, column in zip(names, columns, strict=True)]
    return bool(columns)


def _label(axis: Mapping[str, Any]) -> str:
    quantity = axis.get("quantity")
    label = quantity.get("label") if isinstance(quantity, Mapping) else None
    return label if isinstance(label, str) else ""


def _signals(axis: tuple[float, float, int, str], held: list[tuple[str, Channel]], is_named: bool) -> Block:
    """The block of signals on one abscissa: even times are its sample rate, others a channel."""
    start, step, count, label = axis
    name = held[0][0] if is_named else ""
    channels = with_distinct_names([channel for _, channel in held])
    abscissa = unit(label)
    if abscissa is not None and abscissa.dimension == "time" and step > 0:
        return Block(name, channels, 1 / (step * abscissa.to_si))
    is_frequency = abscissa is not None and abscissa.dimension == "frequency"
    values = start + step * np.arange(count, dtype=np.float64)
    return Block(name, (Channel("frequency" if is_frequency else "abscissa", label, values), *channels))
