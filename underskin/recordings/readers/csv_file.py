"""Tables that instruments write as text: some lines about the measurement, a line of headings, rows of numbers.

The separator (tab, semicolon or comma) and the decimal mark are those that make the longest run of rows a table of
numbers. Headings name the channels and, in brackets or behind the last underscore, their units. Lines above the
headings and under the numbers that hold a name and a value become properties, unless the name has two values. A cell in
quotes may hold the separator. See Also csv_template.py, our own table.
"""

import re
from dataclasses import dataclass
from itertools import groupby
from typing import BinaryIO

import numpy as np

from underskin.errors import FileError
from underskin.recordings.channels import Block, Channel, Contents, with_distinct_names
from underskin.recordings.readers import text
from underskin.recordings.readers.unit_labels import labelled_unit, unit

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
        first = lines[index].split(table.separator)[0].strip().strip('"')
        if text.number(first, table.decimal) is not None:
            raise _no_row(lines, index, table, file)
    for index in range(table.start):
        if _is_grouped_row(lines[index], table):
            raise _no_row(lines, index, table, file)
    columns = np.array(rows, dtype=np.float64).T.copy()
    headings = _headings(lines, table, file)
    channels = [Channel(*heading, column) for heading, column in zip(headings, columns, strict=True)]
    properties, warnings = _properties(lines[: table.start] + lines[end:], table.separator)
    return Contents((Block("", with_distinct_names(channels)),), properties, warnings)


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
    numbers = []
    for cell in _cells(line, separator):
        value = text.number(cell, decimal)
        if value is None:
            return None
        numbers.append(value)
    return numbers


def _cells(line: str, separator: str) -> list[str]:
    """The cells of a line; none where it has one at most, or quotes that do not close."""
    try:
        return text.cells(line, separator) if separator in line else []
    except ValueError:
        return []


def _is_grouped_row(line: str, table: _Table) -> bool:
    """Whether a line above the table looks like a row of it but for numbers with their thousands apart."""
    cells = _cells(line, table.separator)
    ungrouped = [cell.replace(",", "") if text.is_grouped(cell) else cell for cell in cells]
    return len(cells) == table.width and all(text.number(cell, table.decimal) is not None for cell in ungrouped)


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


def _headings(lines: list[str], table: _Table, file: str) -> list[tuple[str, str]]:
    """Names and units of the columns, from the line above the numbers, or from two: names, and units under them."""
    above = [index for index in range(table.start) if lines[index].strip()]
    try:
        last = text.cells(lines[above[-1]], table.separator) if above else []
    except ValueError as error:
        raise FileError(file, f"line {above[-1] + 1}", str(error)) from None
    before = _cells(lines[above[-2]], table.separator) if len(above) > 1 else []
    if not _is_heading(last, table.width):
        return [(f"column {number}", "") for number in range(1, table.width + 1)]
    if _is_heading(before, table.width) and any(unit(cell) for cell in last):
        return list(zip(before, last, strict=True))
    return [(cell, labelled_unit(cell)) for cell in last]


def _is_heading(cells: list[str], width: int) -> bool:
    return len(cells) == width and all(cells)


def _properties(lines: list[str], separator: str) -> tuple[dict[str, str | float], tuple[str, ...]]:
    """What lines that hold a name and a value say, a number as text, as written; and which have two values."""
    values: dict[str, list[str]] = {}
    for line in lines:
        quoted = _cells(line, separator) if '"' in line else []
        cells = quoted or [cell.strip().strip('"') for cell in _SEPARATORS.split(line)]
        match [cell for cell in cells if cell]:
            case [name, value] if cells[0] == name:
                values.setdefault(name, []).append(value)
    twice = {name: different for name, said in values.items() if len(different := list(dict.fromkeys(said))) > 1}
    warnings = [
        f"{name!r} is given as {different[0]!r} and as {different[1]!r}: neither is used"
        for name, different in twice.items()
    ]
    return {name: said[0] for name, said in values.items() if name not in twice}, tuple(warnings)
