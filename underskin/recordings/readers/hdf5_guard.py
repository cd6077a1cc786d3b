"""HDF5 files from outside, which may not hold links out of the file, cycles, or datasets that declare data never
written."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, BinaryIO

import h5py

from underskin.errors import FileError, damage_said

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
