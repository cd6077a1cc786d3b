"""Columns in lab units between a client and the library: their common length, and CSV in and out.

CSV comes in as spreadsheets and users write it; headings and cells are read like those of the CSV template of
campaigns.
"""

import csv
import io
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from underskin.errors import ErrorCode, FileError, InvalidInput, Mention, Requirement, wrong_type
from underskin.recordings.readers import template_columns, text
from underskin.recordings.readers.template_columns import MAGNITUDE, PHASE, OtherColumn
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


REAL = "frf_pc_per_n"  # which has no imaginary part
_LABELS = ("id", "sensor", "name", "recorded_at")  # columns that only label rows, also by numbers


class CsvError(ValueError):
    """A text is no CSV of columns; the message says what it must be."""


@dataclass(frozen=True)
class CsvColumn:
    """One column: its heading as written, the cells, the lines of the text on which they stand (from 1), the factor to
    the unit of its field, and the decimal mark; of the magnitude of an FRF, whose real part is taken, its `phase`."""

    heading: str
    cells: Sequence[str]
    lines: Sequence[int]
    factor: float
    decimal: str
    phase: "CsvColumn | None" = None

    def numbers(self, field: str) -> list[float]:
        """Its values in the field's unit; raises InvalidInput that names the field, or magnitude or phase, the row and
        the line."""
        if self.phase is not None:
            magnitude = replace(self, phase=None).numbers(MAGNITUDE)
            phase = self.phase.numbers(self.phase.heading)
            return [size * math.cos(angle) for size, angle in zip(magnitude, phase, strict=True)]
        values = [_number(cell, self.decimal) for cell in self.cells]
        if None in values:
            raise self._refused(field, [row for row, value in enumerate(values) if value is None])
        return [value * self.factor for value in values if value is not None]

    def _refused(self, field: str, rows: Sequence[int]) -> InvalidInput:
        """The error for the first of these rows without a number, with the count of the others."""
        cell = self.cells[rows[0]]
        more = f", and {len(rows) - 1} more in this column" if len(rows) > 1 else ""
        hint = f"; {cell} {text.ungrouped(cell)}" if text.is_grouped(cell) else ""
        return wrong_type(field, cell, f"must be a number (line {self.lines[rows[0]]}{more}){hint}", rows[0])


@dataclass(frozen=True)
class CsvColumns:
    """The columns by field; by heading, the cells of `unknown` columns, which hold numbers and name no field, and of
    `labels`, which only label rows; `notes`: what was left out or interpreted."""

    fields: dict[str, CsvColumn]
    unknown: dict[str, list[str]]
    labels: dict[str, list[str]]
    notes: list[str]


@dataclass(frozen=True)
class _Table:
    """The header, the rows with as many cells, their lines, and the separator; `notes` are the lines left out."""

    header: list[str]
    rows: list[list[str]]
    lines: list[int]
    separator: str
    notes: list[str]


def from_csv(data: bytes, field_names: Collection[str]) -> CsvColumns:
    """The columns of a text whose first line names the fields; `field_names` are those that there are.

    The text is UTF-8, UTF-16 or Latin-1. Cells are separated by commas, or by semicolons or tabs where the header is;
    the decimal mark follows from `text.decimal_mark`. Headings are read in capitals or not, with units in brackets or
    in the name; magnitude and phase of an FRF become its real part, `frf_pc_per_n`, where that is a field. A first line
    `sep=;`, lines that begin with #, empty lines, and a column without a heading that is empty or counts the rows are
    ignored. Words below a blank line under the table are a note.

    Raises:
        CsvError: the text is no CSV, a field comes twice, or a row has too many or too few cells.
    """
    table = _table(data)
    result = CsvColumns({}, {}, {}, table.notes)
    columns = [[row[index] for row in table.rows] for index in range(len(table.header))]
    values = [cells for heading, cells in zip(table.header, columns, strict=True) if not _is_named_label(heading)]
    decimal = text.decimal_mark(values, table.separator)
    polar = (MAGNITUDE, PHASE) if REAL in field_names else ()
    parts: dict[str, CsvColumn] = {}
    meanings = template_columns.fields_of(table.header, field_names)
    for index, (heading, cells, meant) in enumerate(zip(table.header, columns, meanings, strict=True)):
        is_known = meant is not None and meant[0] in (*field_names, *polar)
        other = OtherColumn.of(() if is_known else cells, decimal)
        if meant is None and polar and template_columns.is_phase_without_unit(heading):
            meant = PHASE, _angle(heading, other.largest)
            result.notes.append(f"{heading!r} {template_columns.READ_AS_DEGREES}")
        if meant is not None and meant[0] in (*field_names, *polar):
            field, factor = meant
            if field in (fields := parts if field in polar else result.fields):
                raise _twice(field, fields[field].heading, heading)
            fields[field] = CsvColumn(heading, cells, table.lines, factor, decimal)
        elif other.only_counts(index, heading):
            continue
        elif _is_named_label(heading) or (heading and not other.has_numbers):
            if heading in result.labels:
                raise CsvError(f"must name each column once; its header has {heading!r} twice")
            result.labels[heading] = cells
        else:
            result.unknown[heading] = cells
    result.notes.extend(template_columns.halved(column.heading for column in result.fields.values()))
    if parts:
        real = _real_part(parts)
        if REAL in result.fields:
            raise _twice(REAL, result.fields[REAL].heading, real.heading)
        result.fields[REAL] = real
        result.notes.append(f"{real.heading}: the real part is taken as {REAL}")
    return result


def _twice(field: str, first: str, second: str) -> CsvError:
    twice = f"{first!r} and {second!r} are the same"
    return CsvError(f"must name each field once; its header has {field!r} twice: {twice}")


def _angle(heading: str, largest: float) -> float:
    """The factor to rad of a phase without a unit, by the largest of its values."""
    try:
        return template_columns.angle_by_values(heading, largest)
    except ValueError as error:
        raise CsvError(f"has a phase that is not clear: {error}") from None


def _real_part(parts: Mapping[str, CsvColumn]) -> CsvColumn:
    """The real part from magnitude and phase; raises CsvError where one is missing."""
    if len(parts) == 1:
        ((field, column),) = parts.items()
        raise CsvError(f"must have magnitude and phase of an FRF: {column.heading!r} {template_columns.lacking(field)}")
    heading = f"{parts[MAGNITUDE].heading}, {parts[PHASE].heading}"
    return replace(parts[MAGNITUDE], heading=heading, phase=parts[PHASE])


def _table(data: bytes) -> _Table:
    try:
        content = text.decode(data, "the text")
    except FileError as error:
        raise CsvError(f"must be readable as CSV ({error.place}: {error.reason})") from None
    written = enumerate(text.lines(content), start=1)
    numbered = [(number, line) for number, line in written if not template_columns.is_empty_line(line)]
    separator = next((mark for mark in ";\t" if numbered and mark in numbered[0][1]), ",")
    rows: list[list[str]] = []
    lines: list[int] = []
    for number, line in numbered:
        try:
            cells = text.cells(line, separator, len(rows[0]) if rows else 1)
        except ValueError as error:
            raise CsvError(f"must be readable as CSV (line {number}: {error})") from None
        if any(cells):
            rows.append(cells)
            lines.append(number)
    notes = _notes_under(rows, lines) if rows and len(rows[0]) > 1 else []
    if len(rows) < 2:
        raise CsvError("must have a header of field names and at least one row")
    header, *rows = rows
    for row, number in zip(rows, lines[1:], strict=True):
        if len(row) != len(header):
            counts = f"{len(row)} on line {number}, {len(header)} in the header"
            raise CsvError(f"must have as many cells in each row as in the header: {counts}")
    return _Table(header, rows, lines[1:], separator, notes)


def _notes_under(table: list[list[str]], lines: list[int]) -> list[str]:
    """Remove rows of words below a blank line under a table; returns a message on each."""
    end = len(table)
    while end > 2 and template_columns.is_note(table[end - 1]):
        end -= 1
    start = next((row for row in range(end, len(table)) if lines[row] > lines[row - 1] + 1), len(table))
    notes = [template_columns.note_message(line, row) for line, row in zip(lines[start:], table[start:], strict=True)]
    del table[start:], lines[start:]
    return notes


def _is_named_label(heading: str) -> bool:
    lower = heading.lower()
    return lower in _LABELS or lower.startswith(template_columns.FURTHER)


def _number(cell: str, decimal: str) -> float | None:
    if decimal == "." and cell.isascii() and "_" not in cell:
        try:
            return float(cell)  # most cells, in less time
        except ValueError:
            pass
    return text.number(cell, decimal)
