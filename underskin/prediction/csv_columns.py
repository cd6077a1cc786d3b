"""Columns in lab units from CSV, as spreadsheets and users write it: headings and cells are read as those of the CSV
template of campaigns are.
"""

import csv
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from underskin.errors import FileError, wrong_type
from underskin.recordings.readers import template_columns, text

_SAYS_NOTHING = re.compile(r'\s*(#|"?sep=.?"?\s*$)', re.IGNORECASE)
_LABELS = ("id", "sensor", "name", "recorded_at")  # columns that only say what a row is, in numbers too


class CsvError(ValueError):
    """A text is not columns in CSV; the message says what it must be."""


@dataclass(frozen=True)
class CsvColumn:
    """One column: its heading as written, the cells, the lines of the text on which they stand (from 1), the factor to
    the unit of its field, and the decimal mark."""

    heading: str
    cells: Sequence[str]
    lines: Sequence[int]
    factor: float
    decimal: str

    def numbers(self, field: str) -> list[float]:
        """Its values in the field's unit; raises InvalidInput that names the field, the row and the line."""
        return [self._number(field, row, cell) for row, cell in enumerate(self.cells)]

    def _number(self, field: str, row: int, cell: str) -> float:
        value = _number(cell, self.decimal)
        if value is not None:
            return value * self.factor
        hint = f"; {cell} {text.ungrouped(cell)}" if text.is_grouped(cell) else ""
        raise wrong_type(field, cell, f"must be a number (line {self.lines[row]}){hint}", row)


@dataclass(frozen=True)
class CsvColumns:
    """The columns by field; the cells of `unknown` ones, which hold numbers and name no field, and of `labels`, which
    only say what a row is, by heading."""

    fields: dict[str, CsvColumn]
    unknown: dict[str, list[str]]
    labels: dict[str, list[str]]


def from_csv(data: bytes, known: Collection[str]) -> CsvColumns:
    """The columns of a text whose first line names the fields; `known` are those that there are.

    The text is UTF-8, UTF-16 or Latin-1. Cells are separated by commas, or by semicolons or tabs where the header is;
    all numbers have the decimal mark that `text.decimal_mark` finds. Headings are read in capitals or not, with units
    in brackets or in the name. A first line `sep=;`, lines that begin with # and lines without a cell say nothing, and
    neither does a column without a heading that is empty or counts the rows.

    Raises:
        CsvError: the text is no CSV, a field comes twice, or a row has too many or too few cells.
    """
    header, rows, lines, separator = _table(data)
    fields: dict[str, CsvColumn] = {}
    unknown: dict[str, list[str]] = {}
    labels: dict[str, list[str]] = {}
    columns = [[row[place] for row in rows] for place in range(len(header))]
    values = [cells for heading, cells in zip(header, columns, strict=True) if not _is_named_label(heading)]
    decimal = text.decimal_mark(lambda _: values, separator)
    for place, (heading, cells) in enumerate(zip(header, columns, strict=True)):
        meant = template_columns.field_of(heading, known)
        if meant is not None and meant[0] in known:
            field, factor = meant
            if field in fields:
                twice = f"{fields[field].heading!r} and {heading!r} are the same"
                raise CsvError(f"must name each field once; its header has {field!r} twice: {twice}")
            fields[field] = CsvColumn(heading, cells, lines, factor, decimal)
        elif _only_counts(place, heading, cells):
            continue
        elif _is_label(heading, cells, decimal):
            if heading in labels:
                raise CsvError(f"must name each column once; its header has {heading!r} twice")
            labels[heading] = cells
        else:
            unknown[heading] = cells
    return CsvColumns(fields, unknown, labels)


def _table(data: bytes) -> tuple[list[str], list[list[str]], list[int], str]:
    """The header, the rows with as many cells, their lines, and the separator."""
    try:
        content = text.decode(data, "the text")
    except FileError as error:
        raise CsvError(f"must be readable as CSV ({error.place}: {error.reason})") from None
    numbered = [
        (number, line)
        for number, line in enumerate(text.lines(content), start=1)
        if line.strip() and not _SAYS_NOTHING.match(line)
    ]
    separator = next((mark for mark in ";\t" if numbered and mark in numbered[0][1]), ",")
    reader = csv.reader((line + "\n" for _, line in numbered), strict=True, delimiter=separator)
    table, lines = [], []
    try:
        for row in reader:
            cells = [cell.strip() for cell in row]
            if any(cells):
                table.append(cells)
                lines.append(numbered[reader.line_num - 1][0])
    except csv.Error as error:
        raise CsvError(f"must be readable as CSV ({error})") from error
    if len(table) < 2:
        raise CsvError("must have a header of field names and at least one row")
    header = _without_empty_end(table[0], 1)
    for row, line in zip(table[1:], lines[1:], strict=True):
        if len(_without_empty_end(row, len(header))) != len(header):
            raise CsvError(f"must have as many cells in each row as in the header: {len(row)} on line {line}, "
                           f"{len(header)} in the header")  # fmt: skip
    return header, table[1:], lines[1:], separator


def _without_empty_end(cells: list[str], least: int) -> list[str]:
    """The cells without the empty ones at the end, as spreadsheets write them, but so many at least."""
    while len(cells) > least and not cells[-1]:
        cells.pop()
    return cells


def _only_counts(place: int, heading: str, cells: Sequence[str]) -> bool:
    """Whether it is an index of the rows, as spreadsheets write it, or an empty column."""
    if heading.lower() not in template_columns.NO_NAME:
        return False
    counts = [[str(first + row) for row in range(len(cells))] for first in (0, 1)]
    return not any(cells) or (place == 0 and list(cells) in counts)


def _is_named_label(heading: str) -> bool:
    lower = heading.lower()
    return lower in _LABELS or lower.startswith(template_columns.FURTHER)


def _is_label(heading: str, cells: Sequence[str], decimal: str) -> bool:
    if _is_named_label(heading):
        return True
    return bool(heading) and all(_number(cell, decimal) is None for cell in cells)


def _number(cell: str, decimal: str) -> float | None:
    if decimal == "." and cell.isascii() and "_" not in cell:
        try:
            return float(cell)  # most cells, in less time
        except ValueError:
            pass
    return text.number(cell, decimal)
