"""A pressure map as CSV: x_mm in the first line, from its second cell on; then a line for each y_mm, its first cell,
with pressure_mpa in the others.

Separated by commas, or by tabs or semicolons, as spreadsheets copy and save it, then with decimal points or commas.
"""

import math
from typing import Any

from underskin import errors
from underskin.errors import ErrorCode, FileError, InvalidInput
from underskin.recordings.readers import text

_FIELD = "pressure_map"
_FORM = "must be CSV: x_mm in the first line, from its second cell on; then for each y_mm a line of it and pressure_mpa"

Line = tuple[int, list[str]]  # its number in the file, from 1, and its cells


def parse(content: bytes, name: str) -> dict[str, Any]:
    """The `pressure_map` of POST /v1/stress in a file called `name`; raises InvalidInput that names the place."""
    lines, decimal = _lines(content, name)
    if len(lines) < 3 or len(lines[0][1]) < 3:
        raise errors.too_few(_FIELD, name, f"{_FORM}; two of each at least")
    (_, head), *rows = lines
    for line, cells in rows:
        if len(cells) != len(head):
            allowed = f"must have as many as line {lines[0][0]} has ({len(head)}) (line {line} of {name})"
            raise InvalidInput(_FIELD, f"{len(cells)} cells", allowed, code=ErrorCode.UNEQUAL_LENGTHS)
    x, *numbers = [
        [
            _number(cell, decimal, f"line {line}, cell {column + 1} of {name}")
            for column, cell in enumerate(cells)
            if row or column
        ]
        for row, (line, cells) in enumerate(lines)
    ]
    for (line, _), row in zip(rows, numbers, strict=True):
        for column, value in enumerate(row[1:], 2):
            if value < 0:
                allowed = f"must be at least 0: a pressure does not pull (line {line}, cell {column} of {name})"
                raise errors.out_of_range(_FIELD, value, allowed)
    return {"x_mm": x, "y_mm": [row[0] for row in numbers], "pressure_mpa": [row[1:] for row in numbers]}


def _lines(content: bytes, name: str) -> tuple[list[Line], str]:
    """The non-empty lines, and the decimal mark."""
    try:
        document = text.decode(content, name)
    except FileError as error:
        raise errors.unreadable(_FIELD, name, f"must be a readable CSV file ({error.place}: {error.reason})") from None
    separator = next((sign for sign in ("\t", ";") if sign in document), ",")
    numbered = [(number, _cells(line, separator, number, name)) for number, line in enumerate(text.lines(document), 1)]
    decimal = text.decimal_mark((cells for _, cells in numbered), separator)
    return [(number, cells) for number, cells in numbered if any(cells)], decimal


def _cells(line: str, separator: str, number: int, name: str) -> list[str]:
    try:
        return text.cells(line, separator)
    except ValueError as error:
        raise errors.unreadable(_FIELD, line[:80], f"{error} (line {number} of {name})") from None


def _number(cell: str, decimal: str, place: str) -> float:
    value = text.number(cell, decimal)
    if value is None:
        reason = text.ungrouped(cell) if text.is_grouped(cell) else "must be a number"
        raise errors.wrong_type(_FIELD, cell[:80], f"{reason} ({place})")
    if not math.isfinite(value):
        raise errors.not_finite(_FIELD, cell[:80], f"must be a finite number ({place})")
    return value
