"""Tables that instruments write as text: some lines about the measurement, a line of headings, rows of numbers.

The separator (tab, semicolon or comma) and the decimal mark are those that make the longest run of rows a table of
numbers. Headings name the channels and, in brackets or behind the last underscore, their units. Lines above the
headings and under the numbers that hold a name and a value become properties. See Also csv_template.py, our own table.
"""

import re
from dataclasses import dataclass
from itertools import groupby
from typing import BinaryIO

import numpy as np

from underskin.errors import FileError
from underskin.recordings import text
from underskin.recordings.channels import Block, Channel, Contents, with_distinct_names
from underskin.recordings.unit_labels import labelled_unit, unit

_STYLES = (("\t", "."), (";", "."), (",", "."), ("\t", ","), (";", ","))
_SEPARATORS = re.compile(r"[\t;,]")


@dataclass(frozen=True)
class _Table:
    """Where the rows of numbers start, and how they are written."""

    start: int
    separator: str
    decimal: str
    width: int


def read(stream: BinaryIO, file: str) -> Contents:
    """The channels of a text table; raises FileError that names the line."""
    lines = text.lines(text.content(stream, file))
    table = _table(lines)
    if table is None:
        raise FileError(
            file,
            "",
            "holds no table of numbers alone, of at least two columns and two rows; names go into the CSV template",
        )
    rows, end = _rows(lines, table, file)
    for index in range(end, len(lines)):
        first = text.cells(lines[index], table.separator)[0]
        if text.number(first, table.decimal) is not None:
            raise _no_row(lines, index, table, file)
    columns = np.array(rows, dtype=np.float64).T.copy()
    channels = [Channel(*heading, column) for heading, column in zip(_headings(lines, table), columns, strict=True)]
    return Contents((Block("", with_distinct_names(channels)),), _properties(lines[: table.start] + lines[end:]))


def _table(lines: list[str]) -> _Table | None:
    """The style with the longest run of rows; the table starts at its first row, though a bad one may be between."""
    longest, best = 1, None
    for separator, decimal in _STYLES:
        widths = [len(_numbers(line, separator, decimal) or ()) for line in lines]
        width, length = _longest_run(widths)
        if length > longest:
            longest, best = length, _Table(widths.index(width), separator, decimal, width)
    return best


def _longest_run(widths: list[int]) -> tuple[int, int]:
    """Width and length of the longest run of rows of equally many numbers, at least two."""
    runs = ((width, sum(1 for _ in run)) for width, run in groupby(widths) if width > 1)
    return max(runs, key=lambda run: run[1], default=(0, 0))


def _numbers(line: str, separator: str, decimal: str) -> list[float] | None:
    if separator not in line:
        return None
    numbers = []
    for cell in text.cells(line, separator):
        value = text.number(cell, decimal)
        if value is None:
            return None
        numbers.append(value)
    return numbers


def _rows(lines: list[str], table: _Table, file: str) -> tuple[list[list[float]], int]:
    """The rows of numbers, and the line behind the last of them."""
    rows: list[list[float]] = []
    end = table.start
    for index in range(table.start, len(lines)):
        row = _numbers(lines[index], table.separator, table.decimal)
        if row is not None and len(row) == table.width:
            between = [line for line in range(end, index) if lines[line].strip()]
            if between:
                raise _no_row(lines, between[0], table, file)
            rows.append(row)
            end = index + 1
    return rows, end


def _no_row(lines: list[str], index: int, table: _Table, file: str) -> FileError:
    expected = f"must be a row of {table.width} numbers, as above it; found {lines[index][:60]!r}"
    return FileError(file, f"line {index + 1}", expected)


def _headings(lines: list[str], table: _Table) -> list[tuple[str, str]]:
    """Names and units of the columns, from the line above the numbers, or from two: names, and units under them."""
    above = [text.cells(line, table.separator) for line in lines[: table.start] if line.strip()]
    last, before = ([[], [], *above][-1], [[], [], *above][-2])
    if not _is_heading(last, table.width):
        return [(f"column {number}", "") for number in range(1, table.width + 1)]
    if _is_heading(before, table.width) and any(unit(cell) for cell in last):
        return list(zip(before, last, strict=True))
    return [(cell, labelled_unit(cell)) for cell in last]


def _is_heading(cells: list[str], width: int) -> bool:
    return len(cells) == width and all(cells)


def _properties(lines: list[str]) -> dict[str, str | float]:
    """What lines that hold a name and a value say; a number is kept as text, as written."""
    properties: dict[str, str | float] = {}
    for line in lines:
        cells = [cell.strip().strip('"') for cell in _SEPARATORS.split(line)]
        match [cell for cell in cells if cell]:
            case [name, value] if cells[0] == name:
                properties[name] = value
    return properties
