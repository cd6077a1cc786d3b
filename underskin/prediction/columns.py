"""Columns in lab units between a client and the library: their common length, and CSV in and out."""

import csv
import io
import re
from collections.abc import Container, Mapping, Sequence
from typing import Any

import numpy as np

from underskin.errors import ErrorCode, InvalidInput, Mention, Requirement
from underskin.units import Floats, Mask

_SAYS_NOTHING = re.compile(r'\s*(#|"?sep=.?"?\s*$)', re.IGNORECASE)
_WITH_COMMA = re.compile(r"\s*[+-]?\d*,\d+([eE][+-]?\d+)?\s*$")


class CsvError(ValueError):
    """A text is not columns in CSV; the message says what it must be."""


def rows(columns: Mapping[str, Floats]) -> int:
    """Number of rows that columns have together; a single number (shape `()`) holds for all of them.

    Raises:
        InvalidInput: names the first column that is not as long as the others, and one of these.
    """
    long = {name: len(values) for name, values in columns.items() if values.ndim}
    first = next(iter(long), None)
    for name, count in long.items():
        if first is not None and count != long[first]:
            length = f" ({long[first]}), or be a single number"
            allowed = Requirement("must have as many rows as ", Mention(first), length)
            raise InvalidInput(name, f"{count} rows", allowed, code=ErrorCode.UNEQUAL_LENGTHS)
    return 1 if first is None else long[first]


def statuses(inside: Mask, count: int) -> list[str]:
    """`ok` or `out_of_domain` for each of `count` rows."""
    return ["ok" if row else "out_of_domain" for row in np.broadcast_to(inside, (count,)).tolist()]


def told(inside: Mask, limits: Sequence[str | None] | None, count: int) -> dict[str, list[str]]:
    """The last columns of a CSV: of each of `count` rows which limit it exceeds, empty where none, and its status."""
    words = [""] * count if limits is None else [text or "" for text in limits]
    return {"limit": words, "status": statuses(inside, count)}


def from_csv(text: str) -> dict[str, list[str]]:
    """The cells of each column, by the names in the header; lines without a cell are skipped.

    Cells are separated by commas, or by semicolons or tabs where the header is; then numbers may have decimal commas,
    which become points. A first line `sep=;` and lines that begin with # say nothing.

    Raises:
        CsvError: the text is no CSV, a name comes twice, or a row has too many or too few cells.
    """
    rows = [row for row in io.StringIO(text, newline="") if row.strip() and not _SAYS_NOTHING.match(row)]
    separator = next((mark for mark in ";\t" if rows and mark in rows[0]), ",")
    try:
        lines = [line for line in csv.reader(rows, strict=True, delimiter=separator) if line]
    except csv.Error as error:
        raise CsvError(f"must be readable as CSV ({error})") from error
    if len(lines) < 2:
        raise CsvError("must have a header of field names and at least one row")
    if separator != ",":
        lines[1:] = [[cell.replace(",", ".") if _WITH_COMMA.match(cell) else cell for cell in row] for row in lines[1:]]
    header = [name.strip() for name in lines[0]]
    for name in header:
        if header.count(name) > 1:
            raise CsvError(f"must name each field once; its header has {name!r} twice")
    for number, line in enumerate(lines[1:]):
        if len(line) != len(header):
            raise CsvError(f"must have as many cells in each row as in the header: {len(line)} in row {number}, "
                           f"{len(header)} in the header")  # fmt: skip
    return {name: list(cells) for name, cells in zip(header, zip(*lines[1:], strict=True), strict=True)}


def without_labels(
    columns: Mapping[str, Sequence[str]], known: Container[str]
) -> tuple[dict[str, list[str]], dict[str, list[str]]]:
    """The columns that are fields, or hold numbers, and those of words, which only say what a row is."""
    words = [name for name, cells in columns.items() if name not in known and not any(map(_is_number, cells))]
    fields = {name: list(cells) for name, cells in columns.items() if name not in words}
    return fields, {name: list(columns[name]) for name in words}


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def to_csv(columns: Mapping[str, Floats | Sequence[Any]], line_end: str) -> str:
    """Columns of equal length as CSV (RFC 4180): arrays in full, `NaN` where there is no value; lists as they are."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator=line_end)
    writer.writerow(columns)
    writer.writerows(zip(*map(_cells, columns.values()), strict=True))
    return text.getvalue()


def _cells(column: Floats | Sequence[Any]) -> Sequence[Any]:
    if not isinstance(column, np.ndarray):
        return column
    return ["NaN" if value != value else repr(value) for value in column.tolist()]
