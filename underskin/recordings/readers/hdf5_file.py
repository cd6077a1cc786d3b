"""Campaigns as HDF5, field for field as in JSON, without loss.

/                        attributes schema, name, units_checked
/skin                    attributes as in the document; tolerances.thickness_percent etc.
/skin/sensors            datasets id, x_mm, y_mm
/recordings/<number>     attributes for single values, a dataset for each column

Any other file holds channels: datasets as variables.py describes, with the unit of their attribute `unit` or `units`; a
group is a structure, and its other attributes, and those of datasets, are properties.

Files from outside may not hold links out of the file, cycles, or datasets that declare data never written.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

import h5py
import numpy as np

from underskin.errors import ErrorCode, FileError, damage_said
from underskin.recordings.campaign import COLUMNS, SCHEMA, Campaign, to_dict
from underskin.recordings.channels import Contents
from underskin.recordings.readers import variables

_CUT = re.compile(r"truncated file: eof = (\d+),.*stored_eof = (\d+)")
_DEEPEST = 8
_MOST_OBJECTS = 200_000
_TOO_MUCH = "is nested too deep, or holds too many objects"
_SMALL = 100_000  # bytes, which a dataset may declare without any stored
_LARGEST_COMPRESSION = 1100  # deflate's is 1032


@contextmanager
def opened(stream: BinaryIO, file: str, what: str) -> Iterator[Any]:
    """The root of a file, named `what` in messages.

    Raises FileError where it is damaged, or holds forbidden objects.
    """
    stream.seek(0)
    with damage_said(file, "", lambda error: f"{what} {damage(error)}"), h5py.File(stream, "r") as source:
        refuse_outside(source, file)
        yield source


def damage(error: Exception) -> str:
    """The damage of a file in words; h5py raises any exception for one."""
    cut = _CUT.search(str(error))
    if cut is not None:
        return f"was cut off: {cut[1]} of its {cut[2]} bytes are there; copy it once more"
    return f"is damaged: {type(error).__name__}: {error}"


def refuse_outside(source: Any, file: str) -> None:
    """Raise FileError for a soft or external link, external storage, a virtual dataset, a cycle, or a dataset that
    declares more than the file can have stored."""
    seen: set[Any] = set()
    for item, here in _objects(source, "", 0, file):
        address = h5py.h5o.get_info(item.id).addr
        if address in seen:
            raise FileError(file, here, "is the same object as another one in the file")
        seen.add(address)
        if isinstance(item, h5py.Dataset):
            _refuse_dataset(item, here, file)
        elif isinstance(item, h5py.Group) and len(seen) > _MOST_OBJECTS:
            raise FileError(file, here, _TOO_MUCH)


def _objects(group: Any, path: str, depth: int, file: str) -> Iterator[tuple[Any, str]]:
    """Each object below a group with its path, parents first."""
    if depth > _DEEPEST:
        raise FileError(file, path, _TOO_MUCH)
    for name in group:
        here = f"{path}/{name}"
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            raise FileError(file, here, "is a link to somewhere else: only data in the file itself is read")
        yield (item := group[name]), here
        if isinstance(item, h5py.Group):
            yield from _objects(item, here, depth + 1, file)


def _refuse_dataset(item: Any, here: str, file: str) -> None:
    if item.external or item.is_virtual:
        raise FileError(file, here, "keeps its data in another file: only data in the file itself is read")
    stored = item.id.get_storage_size()
    if item.shape is not None and item.nbytes > _SMALL + _LARGEST_COMPRESSION * stored:
        raise FileError(file, here, f"declares {item.nbytes} bytes of data, of which the file stores {stored}")


_TOLERANCES, _OF_SENSOR = "tolerances", ("id", "x_mm", "y_mm")
MAGIC = b"\x89HDF\r\n\x1a\n"
_UNITS = ("unit", "units", "Unit", "Units")
_OURS = ("campaign/", "skin-export/")


def write(campaign: Campaign, stream: BinaryIO) -> None:
    """Write the campaign into an open binary file."""
    document = to_dict(campaign)
    write_document(document, document["recordings"], stream)


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
    with opened(stream, file, "the HDF5 file") as source:
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
