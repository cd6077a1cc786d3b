"""Bodies in columns, as JSON, CSV or NumPy's .npz, and the requests in them."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from pydantic_core import from_json

from service.middleware.long_json import LONG_BYTES, NotJson, as_lists, document_of
from service.middleware.unique_keys import require_unique_keys
from service.problems import Refusal, validated
from service.routes.npz_body import NPZ, fields_of_npz
from service.schemas.columns import ColumnsRequest
from underskin.errors import ErrorCode, FileError, InvalidInput, conflicting, wrong_type
from underskin.prediction.columns import CsvColumn, CsvError, from_csv
from underskin.recordings.reading import sheet_text

try:
    import simdjson
except ImportError:  # where no wheel is to be had, all JSON is read as short bodies are
    _LONG = sys.maxsize
else:
    _LONG = 10_000  # bytes, beyond which columns are read as arrays

_MOST_PLAIN_BYTES = 10_000_000  # of columns that are read here: that takes some hundredths of a second
_MOST_CSV_CELLS = 500_000  # each is a Python object, which holds up other requests

CSV = "text/csv"
XLSX = "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet"
XLSM = "application/vnd.ms-excel.sheet.macroEnabled.12"
_WORKBOOK = "the workbook of the body"

_Kind = TypeVar("_Kind", bound=ColumnsRequest)


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
