"""NumPy files, `.npy` and `.npz`: arrays as variables.py describes. Objects, which would be executed, are not read."""

import io
import zipfile
from typing import Any, BinaryIO

import numpy as np

from underskin.errors import FileError, damage_said
from underskin.recordings.channels import Contents
from underskin.recordings.readers import variables

MAGIC = b"\x93NUMPY"
SUFFIX = ".npy"  # of each part of an archive


def read(stream: BinaryIO, file: str) -> Contents:
    """The arrays of a NumPy file; raises FileError that names the array."""
    stream.seek(0)
    is_archive = stream.read(len(MAGIC)) != MAGIC
    stream.seek(0)
    if not is_archive:
        return variables.contents({"array": _array(stream, "", file)}, file)
    with damage_said(file, "", lambda error: f"is no NumPy archive: {error}"), zipfile.ZipFile(stream) as archive:
        names = [name for name in archive.namelist() if name.endswith(SUFFIX)]
        arrays = {name.removesuffix(SUFFIX): _array(archive.open(name), name, file) for name in names}
    return variables.contents(arrays, file)


def _array(stream: Any, place: str, file: str) -> Any:
    """An array; a single number or text of an array without axes; None of objects."""
    with damage_said(file, place, lambda error: f"is no array of numbers: {error}"):
        try:
            array = np.lib.format.read_array(io.BytesIO(stream.read()), allow_pickle=False)
        except ValueError as error:
            if "allow_pickle" in str(error):
                raise FileError(file, place, "holds Python objects, which are not read: save numbers") from None
            raise
    return array if array.ndim else array.item()
