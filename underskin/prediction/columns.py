"""Columns in lab units between a client and the library: their common length, and CSV out."""

import csv
import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from underskin.errors import ErrorCode, InvalidInput, Mention, Requirement
from underskin.units import Floats, Mask

_FORMULA = ("=", "+", "-", "@", "\t", "\r")


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


def limits_and_statuses(inside: Mask, limits: Sequence[str | None] | None, count: int) -> dict[str, list[str]]:
    """The last columns of a CSV: for each of `count` rows the exceeded limit, empty without one, and the status."""
    words = [""] * count if limits is None else [text or "" for text in limits]
    return {"limit": words, "status": statuses(inside, count)}


def to_csv(columns: Mapping[str, Floats | Sequence[Any]], line_end: str) -> str:
    """Columns of equal length as CSV (RFC 4180): arrays in full, `NaN` where there is no value; lists as they are."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator=line_end)
    writer.writerow(columns)
    writer.writerows(zip(*map(_cells, columns.values()), strict=True))
    return text.getvalue()


def to_spreadsheet(columns: Mapping[str, Sequence[Any]]) -> str:
    """Columns as CSV for a spreadsheet: `NaN` for missing values, and text that looks like a formula quoted."""
    return to_csv({name: [_as_text(value) for value in column] for name, column in columns.items()}, "\r\n")


def _as_text(value: Any) -> Any:
    if value is None:
        return "NaN"
    return f"'{value}" if isinstance(value, str) and value.startswith(_FORMULA) else value


def _cells(column: Floats | Sequence[Any]) -> Sequence[Any]:
    if not isinstance(column, np.ndarray):
        return column
    return ["NaN" if value != value else repr(value) for value in column.tolist()]
