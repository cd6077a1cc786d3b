"""Universal files, dataset 58 (functions at nodal DOFs) as text and binary, read by pyuff.

Each dataset is a channel, named by its first description line; those on one abscissa are a block. Even spacing in time
gives the block's sample rate; any other abscissa is a channel (`frequency` for spectra). Several FRFs are one block
each, named by that line, with the channels `frequency`, `FRF` and, where there is one of the same degrees of freedom,
`coherence`: each is a recording, and all are mapped alike. Where their units differ, the channel is named with its
unit, `FRF pC/N`.
"""

import os
import warnings
from typing import Any, BinaryIO

import numpy as np
import pyuff

from underskin.errors import FileError, damage_said
from underskin.recordings.channels import Block, Channel, Contents, some_of, with_distinct_names

_FUNCTION = 58
_FRF, _COHERENCE = 4, 6  # function types
_FREEDOM = ("rsp_node", "rsp_dir", "ref_node", "ref_dir")
_TIME, _FREQUENCY = 17, 18  # specific data types of the abscissa


def read(stream: BinaryIO, file: str) -> Contents:
    """The functions of a universal file; raises FileError that names the dataset."""
    notes = _cut_off(stream)
    with damage_said(file, "", lambda error: f"no universal file: {error}"):
        universal = pyuff.UFF(f"/dev/fd/{stream.fileno()}")  # pyuff takes a path: the open file's own
        types = [int(number) for number in universal.get_set_types()]
    functions = [_function(universal, index, file) for index, number in enumerate(types) if number == _FUNCTION]
    if not functions:
        raise FileError(file, "", f"holds no whole dataset {_FUNCTION}; its datasets: {types or 'none'}")
    if len(functions) < len(types):
        notes.append(f"datasets other than {_FUNCTION} are left out: {sorted(set(types) - {_FUNCTION})}")
    frfs = [one for one in functions if int(one["func_type"]) == _FRF and np.iscomplexobj(one["data"])]
    if len(frfs) < 2:
        return Contents(_blocks(functions), {}, tuple(notes))
    named = _with_coherence(frfs, functions)
    notes.append(f"holds {len(frfs)} FRFs, each a part of its own: {some_of(list(named))}")
    properties = {f"{name}.{key}": value for name, frf in named.items() for key, value in _about(frf).items()}
    one_unit = len({_unit(frf) for frf in frfs}) == 1
    blocks = [_frf_block(name, frf, "FRF" if one_unit else f"FRF {_unit(frf)}") for name, frf in named.items()]
    used = {one["number"] for frf in named.values() for one in (frf, frf["coherence"]) if one is not None}
    others = [function for function in functions if function["number"] not in used]
    return Contents((*blocks, *_blocks(others)), properties, tuple(notes))


def _cut_off(stream: BinaryIO) -> list[str]:
    """A warning where the last dataset has no end."""
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(0, size - 200))
    ended = stream.read().rstrip().endswith(b"-1")
    stream.seek(0)
    return [] if ended else ["the last dataset has no end and is left out: the file is cut off"]


def _function(universal: Any, index: int, file: str) -> dict[str, Any]:
    place = f"dataset {index + 1}"
    with damage_said(file, place, lambda error: f"cannot be read: {error}"):
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            function: dict[str, Any] = universal.read_sets(index)
        announced, stored = int(function["num_pts"]), len(function["data"])
    if stored < announced or len(function["x"]) < announced or announced < 1:
        raise FileError(file, place, f"holds {stored} of the {announced} points that it announces")
    columns = {name: function[name][:announced] for name in ("x", "data")}
    return {**function, **columns, "number": index + 1, "axis": int(function["abscissa_spec_data_type"])}


def _with_coherence(frfs: list[dict[str, Any]], functions: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """The FRFs by distinct names, each with its coherence, the first of the same degrees of freedom, or None."""
    waiting = [function for function in functions if int(function["func_type"]) == _COHERENCE]
    named: dict[str, dict[str, Any]] = {}
    for frf in frfs:
        alike = (one for one in waiting if _freedom(one) == _freedom(frf) and _same_abscissa(one, frf))
        coherence = next(alike, None)
        waiting = [one for one in waiting if one is not coherence]
        name = _name(frf)
        named[name if name not in named else f"{name} (dataset {frf['number']})"] = {**frf, "coherence": coherence}
    return named


def _freedom(function: dict[str, Any]) -> tuple[int, ...]:
    return tuple(int(function[name]) for name in _FREEDOM)


def _about(frf: dict[str, Any]) -> dict[str, str]:
    """The properties of a dataset, for use in a rig description."""
    lines = {f"description {number}": _text(frf[f"id{number}"]) for number in range(1, 6)}
    places = {"response": _place(frf, "rsp"), "reference": _place(frf, "ref")}
    return {name: text for name, text in (lines | places).items() if text}


def _place(frf: dict[str, Any], of: str) -> str:
    """The entity's name of a node, or its number."""
    return _text(frf[f"{of}_ent_name"]) or str(int(frf[f"{of}_node"]))


def _frf_block(name: str, frf: dict[str, Any], channel: str) -> Block:
    channels = [
        Channel("frequency", _text(frf["abscissa_axis_units_lab"]), np.asarray(frf["x"], dtype=np.float64)),
        Channel(channel, _unit(frf), np.asarray(frf["data"])),
    ]
    if frf["coherence"] is not None:
        channels.append(Channel("coherence", "", np.asarray(frf["coherence"]["data"])))
    return Block(name, tuple(channels))


def _blocks(functions: list[dict[str, Any]]) -> tuple[Block, ...]:
    together: list[list[dict[str, Any]]] = []
    for function in functions:
        same = next((group for group in together if _same_abscissa(group[0], function)), None)
        if same is None:
            together.append([function])
        else:
            same.append(function)
    return tuple(map(_block, together))


def _same_abscissa(first: dict[str, Any], second: dict[str, Any]) -> bool:
    return bool(first["axis"] == second["axis"]) and np.array_equal(first["x"], second["x"])


def _block(functions: list[dict[str, Any]]) -> Block:
    first = functions[0]
    channels = [Channel(_name(function), _unit(function), np.asarray(function["data"])) for function in functions]
    step = float(first["abscissa_inc"]) if first["abscissa_spacing"] == 1 else 0.0
    if first["axis"] == _TIME and step > 0:
        return Block(f"dataset {first['number']}", with_distinct_names(channels), 1 / step)
    names = {_TIME: "time", _FREQUENCY: "frequency"}
    name = names.get(first["axis"]) or _text(first["abscissa_axis_lab"]) or "abscissa"
    abscissa = Channel(name, _text(first["abscissa_axis_units_lab"]), np.asarray(first["x"], dtype=np.float64))
    return Block(f"dataset {first['number']}", with_distinct_names([abscissa, *channels]))


def _name(function: dict[str, Any]) -> str:
    return _text(function["id1"]) or _text(function["ordinate_axis_lab"]) or f"dataset {function['number']}"


def _unit(function: dict[str, Any]) -> str:
    above, below = _text(function["ordinate_axis_units_lab"]), _text(function["orddenom_axis_units_lab"])
    return f"{above}/{below}" if above and below else above


def _text(value: Any) -> str:
    stripped = str(value).strip()
    return "" if stripped == "NONE" else stripped
