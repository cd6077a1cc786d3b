"""Campaigns as HDF5, field for field as in JSON, without loss.

/                        attributes schema, name, units_checked
/skin                    attributes as in the document; tolerances.thickness_percent etc.
/skin/sensors            datasets id, x_mm, y_mm
/recordings/<number>     attributes for single values, a dataset for each column

Any other file holds channels: datasets as variables.py describes, with the unit of their attribute `unit` or `units`; a
group is a structure, and its other attributes, and those of datasets, are properties.
"""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO

import h5py
import numpy as np

from underskin.errors import ErrorCode, FileError
from underskin.recordings.campaign import COLUMNS, SCHEMA
from underskin.recordings.channels import Contents
from underskin.recordings.readers import hdf5_guard, variables

_TOLERANCES, _OF_SENSOR = "tolerances", ("id", "x_mm", "y_mm")
MAGIC = b"\x89HDF\r\n\x1a\n"
_UNITS = ("unit", "units", "Unit", "Units")
_OURS = ("campaign/", "skin-export/")


def write_document(about: Mapping[str, Any], recordings: Iterable[Mapping[str, Any]], file: Path | BinaryIO) -> None:
    """Write a campaign document with an iterable of recordings; those in `about` are ignored."""
    with h5py.File(file, "w", libver="latest") as target:
        _write_attributes(target, {name: about[name] for name in about if name not in ("skin", "recordings")})
        skin = dict(about["skin"])
        sensors = skin.pop("sensors", [])
        skin |= {f"{_TOLERANCES}.{name}": value for name, value in (skin.pop(_TOLERANCES, None) or {}).items()}
        _write_attributes(target.create_group("skin"), skin)
        for name in _OF_SENSOR if sensors else ():
            target[f"skin/sensors/{name}"] = [sensor[name] for sensor in sensors]
        groups = target.create_group("recordings")
        for index, recording in enumerate(recordings):
            group = groups.create_group(f"{index:06d}")
            _write_attributes(group, {name: value for name, value in recording.items() if name not in COLUMNS})
            for name in recording.keys() & set(COLUMNS):
                group[name] = np.array(recording[name], dtype=np.float64)


def _write_attributes(group: Any, values: dict[str, Any]) -> None:
    for name, value in values.items():
        if value is not None:
            group.attrs[name] = value


def read(stream: BinaryIO, file: str) -> dict[str, Any] | Contents:
    """The campaign document of an HDF5 file, or its channels; raises FileError that names the object."""
    with hdf5_guard.opened(stream, file, "the HDF5 file") as source:
        schema = source.attrs.get("schema")
        is_ours = isinstance(schema, str | bytes) and _plain(schema).startswith(_OURS)
        if is_ours or ("skin" in source and "recordings" in source):
            return _document(source, file)
        found = variables.contents(_variables(source), file)
        if not found.blocks:
            needed = f"a campaign has the attribute schema = {SCHEMA}, /skin and /recordings"
            raise FileError(file, "/", f"holds no numbers of one or two axes; {needed}")
        return found


def _variables(group: Any) -> dict[str, Any]:
    """The datasets, groups and attributes of a group by their names."""
    held: dict[str, Any] = {}
    for name, item in group.items():
        if isinstance(item, h5py.Group):
            held[name] = _variables(item)
            continue
        attributes = _single(item)
        label = next((str(attributes.pop(key)) for key in _UNITS if key in attributes), "")
        held |= {f"{name}.{key}": value for key, value in attributes.items()}
        if isinstance(item, h5py.Dataset) and item.shape is not None:
            is_text = h5py.check_string_dtype(item.dtype) is not None
            stored = item.asstr()[()] if is_text else item[()]
            held[name] = stored if is_text or not item.shape else variables.Labelled(stored, label)
    return {**_single(group), **held}


def _single(item: Any) -> dict[str, str | float]:
    """The attributes that are a number or a text."""
    single: dict[str, str | float] = {}
    for name in item.attrs:
        with suppress(TypeError, ValueError, OSError):  # h5py has no type for it
            stored = np.asarray(item.attrs[name]).squeeze()
            value = _plain(stored.item()) if stored.ndim == 0 and stored.dtype.kind in "iufSUO" else None
            if isinstance(value, str | int | float):
                single[name] = value
    return single


def _document(source: Any, file: str) -> dict[str, Any]:
    about = _attributes(source)
    schema = about.get("schema")
    if str(schema).startswith("skin-export/"):
        how = "it comes in alone, on the upload page or by `underskin import FILE`"
        raise FileError(file, "/", f"is a whole skin as `underskin export` writes it: {how}", code=ErrorCode.WHOLE_SKIN)
    if schema != SCHEMA or "skin" not in source or "recordings" not in source:
        needed = f"it needs the attribute schema = {SCHEMA}, /skin and /recordings"
        raise FileError(file, "/", f"is HDF5, but no campaign: {needed}")
    skin = _attributes(source["skin"])
    tolerances = {name: value for name, value in skin.items() if name.startswith(f"{_TOLERANCES}.")}
    skin = {name: value for name, value in skin.items() if name not in tolerances}
    if tolerances:
        skin[_TOLERANCES] = {name.removeprefix(f"{_TOLERANCES}."): value for name, value in tolerances.items()}
    if "sensors" in source["skin"]:
        stored = source["skin/sensors"]
        columns = stored["id"].asstr()[()].tolist(), stored["x_mm"][()].tolist(), stored["y_mm"][()].tolist()
        skin["sensors"] = [dict(zip(_OF_SENSOR, row, strict=True)) for row in zip(*columns, strict=True)]
    return {
        **about,
        "skin": skin,
        "recordings": [
            {**_attributes(group), **{name: group[name][()] for name in group}}
            for group in source["recordings"].values()
        ],
    }


def _attributes(group: Any) -> dict[str, Any]:
    return {name: _plain(value) for name, value in group.attrs.items()}


def _plain(value: Any) -> Any:
    if isinstance(value, bytes):
        return value.decode()
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value
