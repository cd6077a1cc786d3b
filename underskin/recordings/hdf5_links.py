"""What an HDF5 file from outside may not hold: anything that leads out of it, or back to where the walk has been."""

from typing import Any

import h5py

from underskin.errors import FileError

_DEEPEST = 8
_MOST_OBJECTS = 200_000


def refuse_outside(source: Any, file: str) -> None:
    """Raises FileError at a soft or external link, external storage, a virtual dataset, or a group met again."""
    seen: set[Any] = set()
    _walk(source, "", 0, seen, file)


def _walk(group: Any, path: str, depth: int, seen: set[Any], file: str) -> None:
    if depth > _DEEPEST or len(seen) > _MOST_OBJECTS:
        raise FileError(file, path or "/", "is nested too deep, or holds too many objects")
    for name in group:
        here = f"{path}/{name}"
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            raise FileError(file, here, "is a link to somewhere else: only data in the file itself is read")
        item = group[name]
        address = h5py.h5o.get_info(item.id).addr
        if address in seen:
            raise FileError(file, here, "is the same object as another one in the file")
        seen.add(address)
        if isinstance(item, h5py.Group):
            _walk(item, here, depth + 1, seen, file)
        elif isinstance(item, h5py.Dataset) and (item.external or item.is_virtual):
            raise FileError(file, here, "keeps its data in another file: only data in the file itself is read")
