"""Bodies in columns, as JSON, CSV or NumPy's .npz, and the requests in them.

Of an .npz nothing is unpickled, and no array is read before its size is known from the archive and from its own header.
"""

import io
import math
import sys
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from pydantic_core import from_json

from service.middleware.json_bodies import LONG_BYTES, NotJson, as_lists, document_of, require_unique_keys
from service.problems import Refusal, validated
from service.schemas.columns import ColumnsRequest
from underskin.errors import (
    ErrorCode,
    FileError,
    InvalidInput,
    conflicting,
    damage_said,
    not_unique,
    too_few,
    unreadable,
    wrong_type,
)
from underskin.prediction.columns import CsvColumn, CsvError, from_csv
from underskin.recordings.reading import sheet_text
from underskin.units import Array

NPZ = "application/x-npz"
_MOST_HEADER = 1000  # characters; np.savez writes some hundred
_MOST_MEMBERS = 64
_DIRECTORY_END = 22  # bytes of a zip archive's last record
_COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # the methods of np.savez and np.savez_compressed
_HEADERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
_MOST_PLAIN_BYTES = 10_000_000  # of columns that are read here: that takes some hundredths of a second
_MOST_CSV_CELLS = 500_000  # each is a Python object, which holds up other requests
CSV = "text/csv"
XLSX = "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet"
XLSM = "application/vnd.ms-excel.sheet.macroEnabled.12"
_WORKBOOK = "the workbook of the body"
_Kind = TypeVar("_Kind", bound=ColumnsRequest)


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


try:
    import simdjson
except ImportError:  # where no wheel is to be had, all JSON is read as short bodies are
    _LONG = sys.maxsize
else:
    _LONG = 10_000  # bytes, beyond which columns are read as arrays


@dataclass(frozen=True)
class UploadedNames:
    """What a CSV or workbook says beside the fields: columns of words (`labels`), which only say what a row is; and in
    `notes` what was left out or read otherwise than its heading says."""

    labels: Mapping[str, Sequence[str]]
    notes: Sequence[str]


def parse(
    kind: type[_Kind], body: bytes, content_type: str, most_bytes: int, sheet: str | None = None
) -> tuple[_Kind, UploadedNames]:
    """The request in `body`, and what else a CSV or workbook says; an .npz may have `most_bytes` when it is expanded;
    `sheet`: of a workbook, which is read in a process of its own, as files are.

    Raises Refusal 400 (unreadable), 413 (too large), 415 (another type) or 422 (a field is wrong), and InvalidInput.
    """
    names_of_columns = UploadedNames({}, ())
    if sheet is not None and not is_workbook(content_type):
        raise conflicting("sheet", sheet, f"must be left out: the body is no workbook ({XLSX})")
    match media_type_of(content_type):
        case "text/csv":
            fields: Any
            fields, names_of_columns = _from_csv(kind, body, "The CSV of the body")
        case _ if is_workbook(content_type):
            try:
                text = sheet_text(body, _WORKBOOK, sheet)
            except FileError as error:
                raise Refusal(400, f"{error}.") from None
            fields, names_of_columns = _from_csv(kind, text.encode(), "The workbook of the body")
        case "application/x-npz":
            fields = fields_of_npz(kind, body, most_bytes)
        case "" | "application/json" if (
            _LONG < len(body) <= _MOST_PLAIN_BYTES and (plain := _plain_json(kind, body)) is not None
        ):
            fields = plain
        case "" | "application/json" if len(body) > LONG_BYTES:
            fields = _long_json(kind, body)
        case _:
            fields = json_document(body, content_type, f", {CSV}, {NPZ} or {XLSX}")
    return validated(kind, fields), names_of_columns


def json_document(body: bytes, content_type: str, also: str = "") -> Any:
    """What a JSON body holds; raises Refusal 400 (unreadable), 422 (a key comes twice) or 415 (another type).

    `also` says what else is read.
    """
    media_type = media_type_of(content_type)
    if media_type not in ("", "application/json"):
        raise Refusal(415, f"Content-Type {media_type!r} cannot be read; send application/json{also}.")
    if len(body) > LONG_BYTES:
        return as_lists(_apart(body))
    try:
        document = from_json(body)  # reads NaN too, so that it is refused by field and row
    except ValueError as error:
        raise Refusal(400, f"The body is not JSON: {error}.") from None
    require_unique_keys(body)
    return document


def _long_json(kind: type[ColumnsRequest], body: bytes) -> Any:
    """What a long JSON body holds; its columns are arrays."""
    document = _apart(body)
    if not isinstance(document, dict):
        return as_lists(document)
    for name, value in document.items():
        if not kind.is_column(name):
            document[name] = as_lists(value)
    return document


def _apart(body: bytes) -> Any:
    try:
        return document_of(body)
    except NotJson as error:
        raise Refusal(400, f"The body is not JSON: {error}.") from None


def media_type_of(content_type: str) -> str:
    """A Content-Type without its parameters."""
    return content_type.split(";", 1)[0].strip().lower()


def is_workbook(content_type: str) -> bool:
    """Whether a body is said to be an Excel workbook, with macros or without."""
    return media_type_of(content_type) in (XLSX, XLSM.lower())


def _plain_json(kind: type[ColumnsRequest], body: bytes) -> dict[str, Any] | None:
    """The fields of a JSON object with the columns as arrays, without a Python object for each number.

    None where anything but that is in the body, such as lists in lists, an empty one, entries that are no numbers, or a
    key that comes again: `json_document` reads that, or says what is wrong.
    """
    if not body.startswith(b"{"):
        return None
    try:
        document = simdjson.Parser().parse(body)
        if not isinstance(document, simdjson.Object) or len(document) > len(kind.model_fields):
            return None  # each key is searched for among all
        names = list(document)
        fields = {name: document[name] for name in names}
        lists = [value for value in fields.values() if isinstance(value, simdjson.Array)]
        nested = _comes_more_often(b"[", len(lists), body) or _comes_more_often(b"{", 1, body)
        if nested or len(fields) < len(names) or not all(map(len, lists)):
            return None
        return {name: _plain(kind, name, value) for name, value in fields.items()}
    except (ValueError, TypeError, RuntimeError):
        return None


def _plain(kind: type[ColumnsRequest], name: str, value: Any) -> Any:
    if not isinstance(value, simdjson.Array):
        return value
    return np.frombuffer(value.as_buffer(of_type="d")) if kind.is_column(name) else value.as_list()


def _comes_more_often(mark: bytes, times: int, body: bytes) -> bool:
    index = -1
    for _ in range(times + 1):
        index = body.find(mark, index + 1)
        if index < 0:
            return False
    return True


def _from_csv(kind: type[ColumnsRequest], body: bytes, what: str) -> tuple[dict[str, Any], UploadedNames]:
    cells = sum(map(body.count, (b",", b";", b"\t", b"\n", b"\r")))  # or fewer, where numbers have decimal commas
    if cells > _MOST_CSV_CELLS:
        most = f"{_MOST_CSV_CELLS:,} may be in one; send less at once, or JSON or {NPZ}."
        raise Refusal(413, f"{what} has some {cells:,} cells; {most}", title="Body too large")
    try:
        parsed = from_csv(body, kind.model_fields)
    except CsvError as error:
        raise Refusal(400, f"{what} {error}.") from None
    # The request's own checks refuse unknown columns, by their first values.
    return {
        **{name: cells[0] for name, cells in parsed.unknown.items()},
        **{name: _cells(kind, name, column) for name, column in parsed.fields.items()},
    }, UploadedNames(parsed.labels, parsed.notes)


def _cells(kind: type[ColumnsRequest], name: str, column: CsvColumn) -> Any:
    if name in kind.lists:
        raise wrong_type(name, column.cells[0], f"cannot be sent as CSV; send application/json or {NPZ}")
    return _constant(name, column.cells) if name in kind.constants else column.numbers(name)


def _constant(name: str, cells: Sequence[str]) -> str | bool:
    for row, cell in enumerate(cells):
        if cell != cells[0]:
            raise InvalidInput(
                name, cell, f"must be the same in every row ({cells[0]!r})", row, code=ErrorCode.CONFLICTING
            )
    return {"true": True, "false": False}.get(cells[0].lower(), cells[0])
