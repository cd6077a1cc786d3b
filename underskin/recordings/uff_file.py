"""Universal files, dataset 58 (functions at nodal DOFs) as text and binary, read by pyuff.

Each dataset is a channel, named by its first description line; those on one abscissa are a block. Even spacing in time
gives the block's sample rate; any other abscissa is a channel of its own (`frequency` for spectra).
"""

import os
import warnings
from typing import Any, BinaryIO

import numpy as np
import pyuff

from underskin.errors import FileError
from underskin.recordings.channels import Block, Channel, Contents, with_distinct_names
from underskin.units import Floats

_FUNCTION = 58
_TIME, _FREQUENCY = 17, 18  # specific data types of the abscissa
_END = b"-1"


def read(stream: BinaryIO, file: str) -> Contents:
    """The functions of a universal file; raises FileError that names the dataset."""
    notes = _cut_off(stream)
    try:
        universal = pyuff.UFF(f"/dev/fd/{stream.fileno()}")  # pyuff takes a path: the open file's own
        types = [int(number) for number in universal.get_set_types()]
    except MemoryError:
        raise
    except Exception as error:
        raise FileError(file, "", f"no universal file: {error}") from None
    functions = [_function(universal, index, file) for index, kind in enumerate(types) if kind == _FUNCTION]
    if not functions:
        raise FileError(file, "", f"holds no whole dataset {_FUNCTION}; its datasets: {types or 'none'}")
    if len(functions) < len(types):
        notes.append(f"datasets other than {_FUNCTION} are left out: {sorted(set(types) - {_FUNCTION})}")
    return Contents(_blocks(functions), {}, tuple(notes))


def _cut_off(stream: BinaryIO) -> list[str]:
    """A warning where the last dataset has no end."""
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(0, size - 200))
    ended = stream.read().rstrip().endswith(_END)
    stream.seek(0)
    return [] if ended else ["the last dataset has no end and is left out: the file is cut off"]


def _function(universal: Any, index: int, file: str) -> dict[str, Any]:
    place = f"dataset {index + 1}"
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            function: dict[str, Any] = universal.read_sets(index)
        announced, found = int(function["num_pts"]), len(function["data"])
    except MemoryError:
        raise
    except Exception as error:
        raise FileError(file, place, f"cannot be read: {error}") from None
    if found < announced or len(function["x"]) < announced or announced < 1:
        raise FileError(file, place, f"holds {found} of the {announced} points that it announces")
    return {**function, "x": function["x"][:announced], "data": function["data"][:announced], "number": index + 1}


def _blocks(functions: list[dict[str, Any]]) -> tuple[Block, ...]:
    together: list[list[dict[str, Any]]] = []
    for function in functions:
        same = next((group for group in together if _same_abscissa(group[0], function)), None)
        if same is None:
            together.append([function])
        else:
            same.append(function)
    return tuple(_block(group) for group in together)


def _same_abscissa(one: dict[str, Any], other: dict[str, Any]) -> bool:
    return _axis(one) == _axis(other) and np.array_equal(one["x"], other["x"])


def _axis(function: dict[str, Any]) -> int:
    return int(function["abscissa_spec_data_type"])


def _block(functions: list[dict[str, Any]]) -> Block:
    first = functions[0]
    channels = [Channel(_name(function), _unit(function), np.asarray(function["data"])) for function in functions]
    step = float(first["abscissa_inc"]) if first["abscissa_spacing"] == 1 else 0.0
    if _axis(first) == _TIME and step > 0:
        return Block(f"dataset {first['number']}", with_distinct_names(channels), 1 / step)
    abscissa: Floats = np.asarray(first["x"], dtype=np.float64)
    names = {_TIME: "time", _FREQUENCY: "frequency"}
    name = names.get(_axis(first)) or _text(first["abscissa_axis_lab"]) or "abscissa"
    channels = [Channel(name, _text(first["abscissa_axis_units_lab"]), abscissa), *channels]
    return Block(f"dataset {first['number']}", with_distinct_names(channels))


def _name(function: dict[str, Any]) -> str:
    return _text(function["id1"]) or _text(function["ordinate_axis_lab"]) or f"dataset {function['number']}"


def _unit(function: dict[str, Any]) -> str:
    above, below = _text(function["ordinate_axis_units_lab"]), _text(function["orddenom_axis_units_lab"])
    return f"{above}/{below}" if above and below else above


def _text(value: Any) -> str:
    stripped = str(value).strip()
    return "" if stripped == "NONE" else stripped
