"""A table of numbers in a text: where it is, how it is separated, and the numbers in its rows.

`find` locates the table: a row holds a number in every column of numbers; other columns hold text. Separator and
decimal mark are those with the longest run of rows, and among equals with the fewest columns of text. `RowReader` reads
the rows into sections, each under one line of headings, with groups of rows separated by blank or comment lines. A
column may end before the others. Words such as `OVERLOAD` and ∞ in place of a number are counted, and read as NaN.
Complex numbers are `1.2-3.4i`, `(1.2,-3.4)` or `1.2∠-30°`.
"""

import cmath
import math
import re
from array import array
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby

import numpy as np

from underskin.errors import FileError
from underskin.recordings.channels import Values
from underskin.recordings.readers import text
from underskin.units import Floats

BLANKS = " "
_STYLES = (("\t", "."), (";", "."), (",", "."), ("\t", ","), (";", ","), (BLANKS, "."), (BLANKS, ","))
_BARE_OR_QUOTED = re.compile(r'[^"]*| *"[^"]*"')
_TOKEN = re.compile(r'"[^"]*"|\S+')
_COMMENT = re.compile(r"\s*(#|%|//|!)+\s*")
_LEAST = 2  # columns of numbers, rows of a table, rows of a group
_REAL = r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?"
_COMPLEX = re.compile(rf"\(?\s*(?P<re>{_REAL})\s*(?P<im>[+-]\s*{_REAL})\s*\*?\s*[ij]\s*\)?")
_PAIR = re.compile(rf"\(\s*(?P<re>{_REAL})\s*[,;]\s*(?P<im>{_REAL})\s*\)")
_POLAR = re.compile(rf"(?P<size>{_REAL})\s*∠\s*(?P<angle>{_REAL})\s*(?P<unit>°|deg|rad)")
_MARKS_COMPLEX = re.compile(r"[ij)∠]")
_OVERLOAD = re.compile(
    r"[+-]?\s*(∞|ol|o\.l|ovr|ovl|ovld|over|over[- ]?(load|range|flow)|clip(ped)?|sat(urated)?)", re.I
)


@dataclass(frozen=True)
class Table:
    """The first row and the style of the rows; `columns`: those that hold numbers, of `width` in all; `complex_ones`:
    those of them that hold complex numbers."""

    start: int
    separator: str
    decimal: str
    columns: tuple[int, ...]
    width: int
    complex_ones: frozenset[int] = frozenset()

    def cells(self, line: str) -> list[str]:
        """The cells of a line; empty for at most one cell, or unclosed quotes."""
        return split(line, self.separator)

    def row(self, line: str) -> list[float | complex | None] | None:
        """The numbers of a row, one for each of `columns`, NaN for an overload, None for an empty cell of a line with
        all separators; None where the line is no row."""
        return self.row_of(self.cells(line), line)

    def row_of(self, cells: Sequence[str], line: str) -> list[float | complex | None] | None:
        """The same of the cells of a line."""
        if not _LEAST <= len(cells) <= self.width:
            return None
        if len(cells) < self.width and room(line, self.separator) >= self.width:
            cells = [*cells, *[""] * (self.width - len(cells))]
        if len(cells) <= max(self.columns):
            return None
        row = [self.number(cells[column], column) for column in self.columns]
        numbers = sum(number is not None for number in row)
        empty = sum(not cells[column] for column in self.columns)
        return row if numbers + empty == len(row) and numbers >= min(_LEAST, len(row)) else None

    def cells_of_columns(self, lines: Sequence[str]) -> list[Sequence[str]] | None:
        """The cells of lines by column; None where a line may be no row, or has quotes within a cell."""
        least, separator = max(self.columns), self.separator
        if separator == BLANKS:
            if any(mark in line for mark in '\t;"' for line in lines) or not all(" " in line for line in lines):
                return None
            rows = [line.split() for line in lines]
            counts = list(map(len, rows))
            if not least < min(counts) <= max(counts) <= self.width:
                return None
            if min(counts) < self.width:
                rows = [row + [""] * (self.width - len(row)) for row in rows]
            return list(zip(*rows, strict=True))
        counts = [line.count(separator) for line in lines]
        if not least <= min(counts) <= max(counts) < self.width:
            return None
        if min(counts) < self.width - 1:
            lines = [line + separator * (self.width - 1 - count) for line, count in zip(lines, counts, strict=True)]
        joined = separator.join(lines)
        cells = joined.split(separator)
        if '"' in joined:
            if not all(map(_BARE_OR_QUOTED.fullmatch, cells)):
                return None
            cells = [cell.replace('"', "") for cell in cells]
        cells = list(map(str.strip, cells))
        return [cells[column :: self.width] for column in range(self.width)]

    def number(self, cell: str, column: int) -> float | complex | None:
        """The number in a cell of a column, NaN for an overload; None where it holds something else."""
        number = text.number(cell, self.decimal)
        if number is None and column in self.complex_ones:
            return complex_number(cell, self.decimal)
        return math.nan if number is None and _OVERLOAD.fullmatch(cell) else number


def complex_number(cell: str, decimal: str) -> complex | None:
    """The complex number in a cell; None where it holds something else."""
    if not _MARKS_COMPLEX.search(cell):
        return None
    cell = cell.strip().replace(text.MINUS, "-")
    polar = _POLAR.fullmatch(cell)
    found = polar or _COMPLEX.fullmatch(cell) or _PAIR.fullmatch(cell)
    if found is None:
        return None
    first, second = (text.number(part.replace(" ", ""), decimal) for part in found.groups()[:2])
    if first is None or second is None:
        return None
    if polar is None:
        return complex(first, second)
    return cmath.rect(first, second if polar["unit"] == "rad" else math.radians(second))


def split(line: str, separator: str) -> list[str]:
    """The cells of a line without empty ones at its end; empty for at most one cell, or unclosed quotes."""
    if separator == BLANKS:
        if " " not in line or "\t" in line or ";" in line:
            return []
        cells = [token.strip('"') for token in _TOKEN.findall(line)] if '"' in line else line.split()
        return cells if len(cells) > 1 else []
    try:
        return text.cells(line, separator) if separator in line else []
    except ValueError:
        return []


def room(line: str, separator: str) -> int:
    """The number of cells of a line, including empty ones at its end."""
    return len(split(line, separator)) if separator == BLANKS else line.count(separator) + 1


def uncommented(line: str) -> str:
    """The line without a leading comment mark."""
    return _COMMENT.sub("", line, count=1) if is_comment(line) else line


def is_comment(line: str) -> bool:
    """Whether a line begins with a comment mark: #, %, // or !."""
    return _COMMENT.match(line) is not None


def find(lines: Sequence[str]) -> Table | None:
    """The table of a text; None where no two rows of at least two numbers follow each other."""
    filled = [line for line in lines if line.strip()]
    has_commas = any("," in line for line in filled)
    best, most = None, 0.0
    for separator, decimal in _STYLES:
        if decimal == "," and not has_commas:
            continue
        columns, first, length = _longest_run([_columns(line, separator, decimal) for line in filled])
        if length < _LEAST:
            continue
        run = filled[first : first + length]
        cells = [split(line, separator) for line in run]
        rows = length * len(columns) / max(map(_count_of_parts, cells))
        if rows > most:
            width = max(room(line, separator) for line in run)
            complex_ones = frozenset(
                column for column in columns if any(complex_number(row[column], decimal) is not None for row in cells)
            )
            best, most = Table(0, separator, decimal, columns, width, complex_ones), rows
    if best is None:
        return None
    return replace(best, start=next(index for index, line in enumerate(lines) if best.row(line) is not None))


def _count_of_parts(cells: Sequence[str]) -> int:
    """The number of cells with those that a tab or a semicolon in them would make: commas between semicolons are
    decimal."""
    return len(cells) + sum(cell.count(mark) for cell in cells for mark in "\t;")


def most_numbers(lines: Sequence[str]) -> tuple[int, int]:
    """The number of numbers of the line with most of them, with any separator, and its index."""
    counts = [max(_count(line, *style) for style in _STYLES) for line in lines]
    most = max(counts)
    return most, counts.index(most)


def _count(line: str, separator: str, decimal: str) -> int:
    cells = split(line, separator) or [line]
    return sum(text.number(cell, decimal) is not None for cell in cells)


def _columns(line: str, separator: str, decimal: str) -> tuple[int, ...]:
    """Which cells of a line are numbers, or overloads beside numbers; empty for fewer than two."""
    cells = split(line, separator)
    numbers = {
        index
        for index, cell in enumerate(cells)
        if text.number(cell, decimal) is not None or complex_number(cell, decimal) is not None
    }
    if not numbers:
        return ()
    columns = tuple(index for index, cell in enumerate(cells) if index in numbers or _OVERLOAD.fullmatch(cell))
    return columns if len(columns) >= _LEAST else ()


def _longest_run(columns_of: Sequence[tuple[int, ...]]) -> tuple[tuple[int, ...], int, int]:
    """The columns, the first line and the length of the longest run of lines with numbers in the same columns; of equal
    ones the first with most columns."""
    best: tuple[tuple[int, ...], int, int] = ((), 0, 0)
    first = 0
    for columns, run in groupby(columns_of):
        length = sum(1 for _ in run)
        if columns and (length, len(columns)) > (best[2], len(best[0])):
            best = (columns, first, length)
        first += length
    return best


def no_row(index: int, line: str, table: Table, file: str) -> FileError:
    """The error for an invalid line among the rows."""
    where = "" if len(table.columns) == table.width else f" in {table.width} columns"
    expected = f"must be a row of {len(table.columns)} numbers{where}, as above it; found {line[:60]!r}"
    return FileError(file, f"line {index + 1}", expected)


_FEW = 64  # lines that are read one by one where they are not plain
_MOST_GROUPS = 1000
_MOST_DIFFERENT = 1_000_000  # texts of a column that is kept
_PLAIN = b"0123456789+-.eE\n"  # bytes of lines that are read at once, beside separators
Lines = list[tuple[int, str]]  # with their numbers, from 0


def plain_numbers(lines: Sequence[str], separator: str, decimal: str, width: int) -> Floats | None:
    """The numbers, row by row, of lines that hold just one in each of `width` cells; None for others."""
    if separator == BLANKS or {line.count(separator) for line in lines} != {width - 1}:
        return None
    written = "\n".join(lines).encode()
    if written.translate(None, _PLAIN.replace(b".", decimal.encode()) + separator.encode()):
        return None
    if decimal == ",":
        written = written.replace(b",", b".")
    try:
        numbers = np.fromstring(written.replace(b"\n", separator.encode()), sep=separator)
    except ValueError:
        return None
    return numbers if numbers.size == len(lines) * width else None


@dataclass
class Section:
    """Rows under one line of headings: the first and the last line with rows, from 0; the lines `between` it and the
    section above; the numbers row by row, two for each complex one; the number of rows in each column that has ended,
    with the line on which it did."""

    first: int
    last: int
    between: Lines
    count: int = 0
    ended: dict[int, tuple[int, int, str]] = field(default_factory=dict)
    _numbers: "array[float]" = field(default_factory=lambda: array("d"))
    _starts: list[int] = field(default_factory=list)

    @property
    def group_starts(self) -> tuple[int, ...]:
        """The first row of each group; empty for a single group, and where one is too short, as where every second line
        is blank."""
        ends = [*self._starts[1:], self.count]
        short = any(end - start < _LEAST for start, end in zip(self._starts, ends, strict=True))
        return () if short or not 1 < len(self._starts) <= _MOST_GROUPS else tuple(self._starts)

    def start_group(self) -> None:
        """Let the next row start a group."""
        self._starts.append(self.count)

    def add(self, last: int, count: int, numbers: Floats) -> None:
        """Add the numbers of rows, the last of them on line `last`."""
        self.last = last
        self.count += count
        self._numbers.frombytes(numbers.tobytes())

    def columns(self, table: Table) -> list[Values]:
        """The columns of numbers."""
        rows = np.frombuffer(self._numbers).reshape(self.count, -1)
        columns: list[Values] = []
        first = 0
        for column in table.columns:
            count = self.ended[column][0] if column in self.ended else self.count
            is_complex = column in table.complex_ones
            values = rows[:count, first].copy()
            columns.append(values + 1j * rows[:count, first + 1] if is_complex else values)
            first += 1 + is_complex
        return columns


@dataclass
class OtherCells:
    """The cells of a column that are no numbers: how many, the first of them with its line, and an example."""

    count: int = 0
    first: tuple[int, str] | None = None
    example: str = ""

    def see(self, cell: str, index: int, line: str, count: int = 1) -> None:
        """Add a cell, which stands in so many rows, first on the line at an index."""
        self.count += count
        self.example = self.example or cell.strip()
        self.first = self.first or (index, line)


@dataclass
class Words(OtherCells):
    """The cells of a column of words; of those that are numbers, `count` and `example` have none."""

    texts: dict[str, int] = field(default_factory=dict)
    codes: "array[int]" = field(default_factory=lambda: array("q"))

    def add(self, cells: Sequence[str], decimal: str, first: int, lines: Sequence[str]) -> None:
        """Add the cells of the next rows, one in each of the lines from `first` on; of too many different ones none is
        kept."""
        for cell, count in Counter(cells).items():
            if text.number(cell, decimal) is None:
                row = cells.index(cell) if self.first is None else 0
                self.see(cell, first + row, lines[row], count)
            if self.kept:
                self.texts.setdefault(cell, len(self.texts))
        if self.kept:
            self.codes.extend(map(self.texts.__getitem__, cells))
        else:
            self.codes = array("q")

    @property
    def kept(self) -> bool:
        """Whether it may tell recordings apart."""
        return len(self.texts) <= _MOST_DIFFERENT


class RowReader:
    """Reads the rows of a text from the table's start on.

    `texts` are the cells of columns of text, `overloads` those that mark a value as too large. Raises FileError at the
    first line between rows that is no row, unless it is blank, a comment, or followed by the `headings`.
    """

    def __init__(self, table: Table, headings: frozenset[str], file: str) -> None:
        self.table = table
        self.headings = headings
        self._file = file
        self._is_plain = table.columns == tuple(range(table.width)) and not table.complex_ones
        self.sections: list[Section] = []
        self.under: Lines = []  # lines since the last row
        self.texts = {column: Words() for column in range(table.width) if column not in table.columns}
        self.overloads: dict[int, OtherCells] = {}
        self.count = 0

    def take_all(self, written: str) -> None:
        """Read the rows of a text."""
        for first, lines in text.blocks(written):
            skipped = max(0, self.table.start - first)
            if skipped < len(lines):
                self._take(first + skipped, lines[skipped:])
        for section in self.sections:
            for count, index, line in section.ended.values():
                if section.count - count < _LEAST:  # a row with an empty cell is no end of a column
                    raise no_row(index, line, self.table, self._file)

    def _take(self, first: int, lines: Sequence[str]) -> None:
        """Read lines, the first of which has the index `first`: many at once, or one by one where one is no plain
        row."""
        table, ended = self.table, self.sections[-1].ended if self.sections else {}
        numbers = plain_numbers(lines, table.separator, table.decimal, table.width) if self._is_plain else None
        if numbers is not None and not ended:
            self._section(first).add(first + len(lines) - 1, len(lines), numbers)
            self.count += len(lines)
            return
        cells = table.cells_of_columns(lines)
        columns = self._numbers(cells, ended) if cells is not None and not (ended and self.under) else None
        if cells is not None and columns is not None:
            self._add(first, lines, cells, columns)
        elif len(parts := self._parts(lines)) > 1:
            for part in parts:
                self._take(first, part)
                first += len(part)
        else:
            for index, line in enumerate(lines, start=first):
                self._take_line(index, line)

    def _parts(self, lines: Sequence[str]) -> list[Sequence[str]]:
        """A few lines each of many; those with cells apart from those without, such as blank ones."""
        if len(lines) > _FEW:
            return [lines[start : start + _FEW] for start in range(0, len(lines), _FEW)]
        return [list(part) for _, part in groupby(lines, key=lambda line: self.table.separator in line)]

    def _numbers(self, cells: Sequence[Sequence[str]], ended: Collection[int]) -> list[Values] | None:
        """The columns of numbers of some rows, NaN for overloads and below the end of a column; None where a cell is
        something else."""
        columns: list[Values] = []
        for column in self.table.columns:
            is_complex = column in self.table.complex_ones
            plain = None if is_complex else plain_numbers(cells[column], ";", self.table.decimal, 1)
            found = [self.table.number(cell, column) for cell in cells[column]] if plain is None else []
            if column in ended and not any(cells[column]):
                plain = np.full(len(cells[column]), math.nan)
            elif column in ended or None in found:
                return None
            columns.append(np.array(found, complex if is_complex else float) if plain is None else plain)
        return columns if len(columns) - len(ended) >= _LEAST else None

    def _take_line(self, index: int, line: str) -> None:
        """Read a line, which may end columns; raises FileError where a number follows the end of its column."""
        cells = self.table.cells(line)
        row = self.table.row_of(cells, line)
        if row is None:
            self.under.append((index, line))
            return
        section = self._section(index)
        for column, number in zip(self.table.columns, row, strict=True):
            if number is None:
                section.ended.setdefault(column, (section.count, index, line))
            elif column in section.ended:
                raise no_row(*section.ended[column][1:], self.table, self._file)
        padded = [*cells, *[""] * (self.table.width - len(cells))]
        columns = [np.asarray([math.nan if number is None else number]) for number in row]
        self._add(index, [line], [[cell] for cell in padded], columns)

    def _add(self, first: int, lines: Sequence[str], cells: Sequence[Sequence[str]], columns: Sequence[Values]) -> None:
        """Add rows: their cells by column, and the numbers of the columns of numbers."""
        parts: list[Floats] = []
        for column, values in zip(self.table.columns, columns, strict=True):
            parts += [values.real, values.imag] if column in self.table.complex_ones else [values.real]
            for row in np.flatnonzero(np.isnan(values)).tolist():
                cell = cells[column][row]
                if cell and text.number(cell, self.table.decimal) is None:
                    self.overloads.setdefault(column, OtherCells()).see(cell, first + row, lines[row])
        self._section(first).add(first + len(lines) - 1, len(lines), np.stack(parts, axis=1))
        self.count += len(lines)
        for column, words in self.texts.items():
            words.add(cells[column], self.table.decimal, first, lines)

    def _section(self, index: int) -> Section:
        """The section of the row at an index."""
        foreign = [line for line in self.under if line[1].strip() and not is_comment(line[1])]
        if foreign and not any(line.strip() in self.headings for _, line in foreign):
            raise no_row(*foreign[0], self.table, self._file)
        if foreign or not self.sections:
            self.sections.append(Section(index, index, self.under if self.sections else []))
            self.sections[-1].start_group()
        elif self.under:
            self.sections[-1].start_group()
        self.under = []
        return self.sections[-1]
