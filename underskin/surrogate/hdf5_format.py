"""The HDF5 file of a table: its contents, its atomic writing, and the checks on reading.

A table is self-describing (NeXus style): each group is an NXdata with `@signal` and `@axes`, each dataset carries
`@units` and `@long_name`; the root carries the schema, the versions and settings of its computation, and the SHA-256 of
all its datasets. `tables/README.md` describes the format.
"""

import hashlib
import os
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import h5py
import numpy as np

from underskin.errors import TableError
from underskin.units import Floats

SIGMA_SCHEMA = "underskin-sigma/1"
INFLUENCE_SCHEMA = "underskin-influence/1"
CONTACT_SCHEMA = "underskin-contact/3"
_MAGIC = b"\x89HDF\r\n\x1a\n"


@dataclass(frozen=True)
class Dataset:
    """One dataset of a table: its values, the names of its axes (empty for an axis itself) and its meaning."""

    values: Floats
    meaning: str
    axes: tuple[str, ...] = ()


Group = Mapping[str, Dataset]


@dataclass(frozen=True)
class TableFile:
    """A table as read: datasets by "group/name", the root's attributes, and the hash that identifies it."""

    data: Mapping[str, Floats]
    attributes: Mapping[str, Any]
    sha256: str


def data_hash(data: Mapping[str, Floats]) -> str:
    """SHA-256 over names, shapes and little-endian doubles of all datasets, in the order of their names."""
    digest = hashlib.sha256()
    for name in sorted(data):
        values = np.ascontiguousarray(data[name], dtype="<f8")
        digest.update(f"{name} {values.shape}\n".encode())
        digest.update(values.tobytes())
    return digest.hexdigest()


def write_table(
    path: Path, schema: str, groups: Mapping[str, Group], signals: Mapping[str, str], about: Mapping[str, Any]
) -> str:
    """Write a table next to `path`, flush it to the disk and move it into place; returns its hash.

    Raises TableError, and writes nothing, when a value is not finite.
    """
    data = {f"{group}/{name}": d.values for group, datasets in groups.items() for name, d in datasets.items()}
    for name, values in data.items():
        if not np.isfinite(values).all():
            raise TableError(f"table {path} is not written: {name} would hold values that are not finite")
    digest = data_hash(data)
    partial = path.with_name(path.name + ".partial")
    with h5py.File(partial, "w") as file:
        file.attrs.update({"schema": schema, "data_sha256": digest, "default": next(iter(groups)), **about})
        for group, datasets in groups.items():
            _write_group(file.create_group(group), datasets, signals[group])
    with partial.open("rb+") as written:
        os.fsync(written.fileno())
    partial.replace(path)
    _sync_folder(path.parent)
    return digest


def _write_group(group: h5py.Group, datasets: Group, signal: str) -> None:
    group.attrs["NX_class"] = "NXdata"
    group.attrs["signal"] = signal
    group.attrs["axes"] = list(datasets[signal].axes)
    for name, dataset in datasets.items():
        stored = group.create_dataset(
            name, data=np.asarray(dataset.values, dtype="<f8"), compression="gzip", shuffle=True, track_times=False
        )
        stored.attrs["units"] = ""
        stored.attrs["long_name"] = dataset.meaning
        if dataset.axes:
            stored.attrs["axes"] = list(dataset.axes)


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def read_table(path: Path, schema: str) -> TableFile:
    """Read and verify a table: schema, hash, finite values, ascending axes, and shapes that fit their axes.

    Raises TableError with the file, the reason and what to do.
    """
    try:
        with path.open("rb") as file:
            magic = file.read(len(_MAGIC))
    except OSError as error:
        raise TableError(f"table {path} cannot be read: {error.strerror}. {_REMEDY}") from error
    if magic != _MAGIC:
        raise TableError(f"table {path} is not an HDF5 file, or its beginning is damaged. {_REMEDY}")
    try:
        with h5py.File(path, "r") as file:
            return _verified(path, file, schema)
    except (OSError, KeyError, RuntimeError, ValueError) as error:
        raise TableError(f"table {path} is truncated or damaged: {error}. {_REMEDY}") from error


_REMEDY = "Restore it from the distribution, or make it anew: `underskin tablegen sigma|influence|contact --out FILE`."


def _verified(path: Path, file: h5py.File, schema: str) -> TableFile:
    attributes = dict(file.attrs)
    stored_schema = attributes.get("schema")
    if stored_schema != schema:
        raise TableError(f"table {path} has schema {stored_schema!r}; this version reads {schema!r}. {_REMEDY}")
    data: dict[str, Floats] = {}
    for group_name, group in file.items():
        for name, dataset in group.items():
            data[f"{group_name}/{name}"] = np.asarray(dataset[()], dtype=float)
    for group_name, group in file.items():
        for name, dataset in group.items():
            _verify_values(path, group_name, name, data, list(dataset.attrs.get("axes", ())))
    digest = data_hash(data)
    if digest != attributes.get("data_sha256"):
        raise TableError(f"table {path} was altered after it was written: its SHA-256 does not match. {_REMEDY}")
    return TableFile(data, attributes, digest)


def _verify_values(path: Path, group: str, name: str, data: Mapping[str, Floats], axes: list[str]) -> None:
    values = data[f"{group}/{name}"]
    if not np.isfinite(values).all():
        raise TableError(f"table {path}: {group}/{name} holds values that are not finite. {_REMEDY}")
    if not axes and not (values.ndim == 1 and values.size >= 2 and (np.diff(values) > 0).all()):
        raise TableError(f"table {path}: axis {group}/{name} does not ascend. {_REMEDY}")
    expected = tuple(data[f"{group}/{axis}"].size for axis in axes)
    if axes and values.shape != expected:
        raise TableError(f"table {path}: {group}/{name} has shape {values.shape}, its axes {expected}. {_REMEDY}")


class Table(ABC):
    """A verified table: `path`, `sha256` (which names it) and the file's `attributes`."""

    schema: ClassVar[str]

    def __init__(self, path: Path) -> None:
        """Read and verify the table; raises TableError with the reason."""
        file = read_table(path, self.schema)
        self.path = path
        self.sha256 = file.sha256
        self.attributes = file.attributes
        try:
            self._take(file.data)
        except KeyError as error:
            raise TableError(f"table {path} lacks the dataset {error}") from error

    @abstractmethod
    def _take(self, data: Mapping[str, Floats]) -> None:
        """Store the datasets that the table needs, by "group/name"."""
