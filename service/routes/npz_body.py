"""Fields of a request as NumPy's .npz: a zip archive of arrays by name.

Nothing is unpickled, and no array is read before its size is known from the archive and from its own header.
"""

import io
import math
import zipfile
from typing import Any

import numpy as np

from service.problems import Refusal
from service.schemas.columns import ColumnsRequest
from underskin.errors import (
    ErrorCode,
    FileError,
    InvalidInput,
    damage_said,
    not_unique,
    too_few,
    unreadable,
    wrong_type,
)
from underskin.units import Array

NPZ = "application/x-npz"
_MOST_HEADER = 1000  # characters; np.savez writes some hundred
_MOST_MEMBERS = 64
_DIRECTORY_END = 22  # bytes of a zip archive's last record
_COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # the methods of np.savez and np.savez_compressed
_HEADERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}


def fields_of_npz(kind: type[ColumnsRequest], body: bytes, most_bytes: int) -> dict[str, Any]:
    """The fields of a request: columns as arrays, all else as JSON has it.

    Raises:
        Refusal: 400 where the body is no archive, 413 where its arrays exceed `most_bytes`.
        InvalidInput: names an array that cannot be used.
    """
    try:
        with damage_said("", "", str):
            _require_short_directory(body[-_DIRECTORY_END:])
            archive = zipfile.ZipFile(io.BytesIO(body))
    except FileError as error:
        raise Refusal(400, f"The body is not an .npz file: {error.reason}.") from None
    members = archive.infolist()
    expanded = sum(member.file_size for member in members)
    if expanded > most_bytes:
        limit = f"{most_bytes / 1e6:g} MB (UNDERSKIN_MAX_BODY_MB)"
        message = (
            f"The arrays of the body take {expanded / 1e6:.4g} MB, which exceeds {limit}; send fewer rows a request."
        )
        raise Refusal(413, message, title="Body too large")
    fields: dict[str, Any] = {}
    for member in members:
        name = member.filename.removesuffix(".npy")
        if name in fields:
            raise not_unique(name, None, "is given twice: must be one array of the file")
        if name not in kind.model_fields:
            raise InvalidInput(name, None, "is not a field of this request", code=ErrorCode.UNKNOWN_FIELD)
        fields[name] = _value(kind, name, _array(archive, member, name))
    return fields


def _require_short_directory(end: bytes) -> None:
    """Raises ValueError unless an archive ends as NumPy's do, with a record that says that its directory is short:
    zipfile reads that as a whole."""
    if not end.startswith(b"PK\x05\x06"):
        raise ValueError("it does not end as NumPy's archives do")
    if int.from_bytes(end[12:16], "little") > _MOST_MEMBERS * _MOST_HEADER:
        raise ValueError("its directory is too long")


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo, name: str) -> Array:
    try:
        with damage_said("", "", str):
            if member.compress_type not in _COMPRESSIONS:
                raise ValueError("it is neither stored nor deflated")
            with archive.open(member) as file:
                shape, by_columns, dtype = _HEADERS[np.lib.format.read_magic(file)](file, max_header_size=_MOST_HEADER)
                data = file.read(member.file_size)  # no more than is declared; at its end the checksum is compared
            if dtype.hasobject:
                raise ValueError("it holds Python objects (pickles)")
            promised = math.prod(shape) * dtype.itemsize
            if len(data) != promised:
                raise ValueError(f"it has {len(data)} bytes, and its header says {promised}")
            array = np.ndarray(shape, dtype, data, order="F" if by_columns else "C")
    except FileError as error:
        reason = error.reason
    else:
        return array
    raise unreadable(name, member.filename, f"must be an array of numbers or a text in NumPy's .npy format: {reason}")


def _value(kind: type[ColumnsRequest], name: str, array: Array) -> Any:
    """The array itself for a column; single values and lists as JSON has them."""
    array_type = f"{array.dtype.name} {array.shape}"
    if name in kind.constants:
        if array.ndim or array.dtype.kind not in "Ub":
            raise wrong_type(name, array_type, "must be a single text or boolean, of shape ()")
        return _text(name, array) if array.dtype.kind == "U" else array.item()
    if array.dtype.kind not in "fiu":
        raise wrong_type(name, array_type, "must be an array of floats or integers")
    if name in kind.lists:
        return array.astype(float).tolist()
    if array.ndim > 1:
        raise wrong_type(name, array_type, "must be a column, of shape (rows,), or a single number, of shape ()")
    if not array.size:
        raise too_few(name, array_type, "must not be empty")
    return array.astype(float, copy=False) if array.ndim else float(array)


def _text(name: str, array: Array) -> str:
    """A text of shape (); NumPy itself would let any 32 bits pass for a character."""
    try:
        return array.astype(array.dtype.newbyteorder("<")).tobytes().decode("utf-32-le").rstrip("\0")
    except UnicodeDecodeError as error:
        raise unreadable(name, array.dtype.name, f"must be a text in Unicode: {error}") from None
