"""Headings and rows of tables in text files.

The names of the columns are on the nearest line above the numbers that has a cell for each column: the nearest with a
known unit, or after a word such as `columns:`, before the nearest of all. A line of units may stand between, and so may
other lines, such as the marker `eoh`. Rows are read block by block into sections, each under one line of headings, with
groups of rows separated by blank or comment lines; columns of text are counted.
"""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from underskin.errors import FileError
from underskin.recordings.readers import text
from underskin.recordings.readers.cells import (
    BLANKS,
    BlockText,
    PlainRows,
    RowStyle,
    Table,
    is_comment,
    no_row,
    split,
    uncommented,
)
from underskin.recordings.readers.unit_labels import labelled_unit, unit, without_brackets
from underskin.units import Floats

_LABEL = re.compile(
    r"(?P<units>units?|einheit(en)?)\s*[:=]\s*|((column|channel|field|heading|header|(fancy)?name)s?|spalten?)\s*[:=]\s*",
    re.IGNORECASE,
)
_WIDE_BLANKS = re.compile(r"\t|\s{2,}")
_WITH_UNITS = re.compile(r"[^\s\[(]+(?:\s*[\[(][^\])]*[\])])?")  # Load (uN)
_NO_UNITS = ("", "-", "–", "1", "%", "°C", "K", "#", "a.u.", "n/a")


@dataclass(frozen=True)
class Headings:
    """Name and unit of each column; `lines`: the indices of the lines that state them, from 0."""

    names: Sequence[tuple[str, str]]
    lines: tuple[int, ...] = ()


@dataclass(frozen=True)
class _Candidate:
    line: int
    cells: Sequence[str]
    label: str  # "units", "names", or none

    def is_sure(self) -> bool:
        """Whether it holds names by more evidence than the number of its cells."""
        return self.label == "names" or any(unit(labelled_unit(cell)) is not None for cell in self.cells)

    def is_units(self) -> bool:
        units = [without_brackets(cell) for cell in self.cells]
        unit_count = sum(unit(cell) is not None for cell in units)
        other_count = sum(cell not in _NO_UNITS for cell in units) - unit_count
        states_values = any("=" in cell or ":" in cell for cell in units)  # k=3 N/m
        return self.label == "units" or (
            self.label == "" and unit_count > 0 and other_count <= unit_count and not states_values
        )


def find(lines: Sequence[str], table: Table, file: str) -> Headings:
    """The headings of a table; `column 1`, … where there are none.

    Raises FileError where the line above the numbers has quotes that do not close.
    """
    _require_closed_quotes(lines, table, file)
    candidates = list(_candidates(lines, table))
    units = next((candidate for candidate in candidates if candidate.is_units()), None)
    names = _names(
        [candidate for candidate in candidates if candidate is not units and _full(candidate, table)], units, table
    )
    if names is None:  # a line of units also serves as names
        names = units if units is not None and _full(units, table) else None
    if names is None:
        return Headings([(f"column {number}", "") for number in range(1, table.width + 1)])
    stated_units = (
        [""] * table.width if units is None else [without_brackets(cell) for cell in _padded(units.cells, table)]
    )
    headings = [
        (name or f"column {number}", by_row or labelled_unit(name))
        for number, (name, by_row) in enumerate(zip(_padded(names.cells, table), stated_units, strict=True), start=1)
    ]
    return Headings(
        headings, tuple(dict.fromkeys(candidate.line for candidate in (names, units) if candidate is not None))
    )


def _names(candidates: Sequence[_Candidate], units: _Candidate | None, table: Table) -> _Candidate | None:
    """The line of names among those from the nearest to the farthest; above a line of `units` the nearest to it."""
    if units is not None and units.label == "":
        # Lines under the units are no names, which would then lack these units.
        return next((candidate for candidate in candidates if candidate.line < units.line), None)
    words = [candidate for candidate in candidates if not _holds_number(candidate, table)]
    return next(
        (candidate for candidate in words if candidate.is_sure()), next(iter(words), next(iter(candidates), None))
    )


def _candidates(lines: Sequence[str], table: Table) -> Iterator[_Candidate]:
    """The lines above the numbers with as many cells as columns, the nearest first.

    A line with numbers counts only where at most a line of units separates it from the table.
    """
    nearest = True
    for index in range(table.start - 1, -1, -1):
        if not lines[index].strip():
            continue
        bare = uncommented(lines[index]).strip()
        label = _LABEL.match(bare)
        kind = "" if label is None else "units" if label["units"] else "names"
        cells = _cells(bare[label.end() :] if label else bare, table)
        if cells is not None:
            candidate = _Candidate(index, cells, kind)
            if nearest or not _holds_number(candidate, table):
                yield candidate
            nearest = nearest and candidate.is_units()
        else:
            nearest = False


def _cells(line: str, table: Table) -> Sequence[str] | None:
    """The cells of a line above the table, if they can be headings; separated like the table, or in another way."""
    cells = split(line, table.separator)
    if table.separator != BLANKS and cells:
        cells = [*cells, *[""] * (line.count(table.separator) + 1 - len(cells))][: max(table.width, len(cells))]
    ways = [cells]
    if table.separator == BLANKS:
        ways = [_WIDE_BLANKS.split(line), *ways, _WITH_UNITS.findall(line)]
        ways += [[cell.strip() for cell in line.split(mark)] for mark in "\t;,"]
    return next((cells for cells in ways if max(table.columns) < len(cells) <= table.width), None)


def _full(candidate: _Candidate, table: Table) -> bool:
    """Whether every column of numbers is named, except at most one, which may be an index."""
    named = [column for column in table.columns if candidate.cells[column]]
    return len(named) >= max(len(table.columns) - 1, 2)


def _holds_number(candidate: _Candidate, table: Table) -> bool:
    return any(text.number(cell, table.decimal) is not None for cell in candidate.cells)


def _padded(cells: Sequence[str], table: Table) -> list[str]:
    return [*cells, *[""] * (table.width - len(cells))]


def _require_closed_quotes(lines: Sequence[str], table: Table, file: str) -> None:
    nearest = next((index for index in range(table.start - 1, -1, -1) if lines[index].strip()), None)
    if nearest is None or table.separator == BLANKS:
        return
    try:
        text.cells(lines[nearest], table.separator)
    except ValueError as error:
        raise FileError(file, f"line {nearest + 1}", str(error)) from None


_FEW = 16  # rows below which they are read one by one
_LOOSE = 4096  # rows that are kept as lists
_APART = 1 << 16  # rows that are kept in parts
_LEAST = 2  # rows of a group
_MOST_GROUPS = 1000
Lines = list[tuple[int, str]]  # with their numbers, from 0


@dataclass
class Section:
    """Rows under one line of headings: the first and the last line with rows, from 0; the lines `between` it and the
    section above; and the first row of each group, separated by blank or comment lines."""

    first: int
    last: int
    between: Lines
    _starts: list[int] = field(default_factory=list)
    _count: int = 0
    _loose: list[Sequence[float]] = field(default_factory=list)
    _parts: list[Sequence[Floats]] = field(default_factory=list)
    _in_parts: int = 0
    _columns: list[Floats] = field(default_factory=list)

    @property
    def group_starts(self) -> tuple[int, ...]:
        """Empty for a single group, and where one is too short, as where every second line is blank."""
        ends = [*self._starts[1:], self._count]
        short = any(end - start < _LEAST for start, end in zip(self._starts, ends, strict=True))
        return () if short or not 1 < len(self._starts) <= _MOST_GROUPS else tuple(self._starts)

    def start_group(self) -> None:
        """Let the next row start a group."""
        self._starts.append(self._count)

    def add(self, last: int, row: Sequence[float]) -> None:
        """Add a row."""
        self.last = last
        self._count += 1
        self._loose.append(row)
        if len(self._loose) == _LOOSE:
            self._gather()

    def add_rows(self, last: int, columns: Sequence[Floats]) -> None:
        """Add many rows by their columns."""
        self._gather()
        self.last = last
        self._count += len(columns[0])
        self._add_part(columns)

    def columns(self) -> list[Floats]:
        """The columns of numbers."""
        self._gather()
        if self._parts:
            self._join()
        return self._columns

    def _gather(self) -> None:
        if self._loose:
            self._add_part(list(np.array(self._loose, dtype=np.float64).T))
            self._loose = []

    def _add_part(self, columns: Sequence[Floats]) -> None:
        self._parts.append(columns)
        self._in_parts += len(columns[0])
        if self._in_parts >= _APART:
            self._join()

    def _join(self) -> None:
        """Append the parts to the columns in place, so that a long file is not in memory twice."""
        self._columns = self._columns or [np.empty(0) for _ in self._parts[0]]
        for index, column in enumerate(self._columns):
            column.resize(self._count, refcheck=False)
            np.concatenate([part[index] for part in self._parts], out=column[-self._in_parts :])
        self._parts, self._in_parts = [], 0


@dataclass
class TextColumn:
    """A column with text in some rows: their number, the first of them, and an example."""

    count: int = 0
    first: tuple[int, str] | None = None
    example: str = ""


class SectionReader:
    """Reads the lines of a file from the table's start on.

    Raises FileError at the first line between rows that is no row, unless it is blank, a comment, or followed by the
    `headings`.
    """

    def __init__(self, table: Table, headings: frozenset[str], file: str) -> None:
        self._table = table
        self._style = RowStyle(table.separator, table.decimal, table.columns, table.width)
        self._headings = headings
        self._file = file
        self.sections: list[Section] = []
        self.under: Lines = []  # lines since the last row
        self.texts = {column: TextColumn() for column in range(table.width) if column not in table.columns}
        self.count = 0

    def take_all(self, source: BlockText) -> None:
        """Read the lines of a text."""
        first = 0
        for block in source.blocks():
            lines = block.split("\n")
            skipped = max(0, self._table.start - first)
            if skipped < len(lines):
                self._take(first + skipped, lines[skipped:])
            first += len(lines)

    def _take(self, first: int, lines: Sequence[str]) -> None:
        """Read lines, the first of which has the index `first`."""
        rows = PlainRows(lines, self._style)
        taken = 0
        for line, start, end in rows.runs():
            if end - start < _FEW:
                continue
            self._take_lines(first + taken, lines[taken:line])
            taken = line + end - start
            self._section(first + line).add_rows(first + taken - 1, [column[start:end] for column in rows.numbers])
            self.count += end - start
            for column in self.texts:
                self._see(column, first + line, lines[line:taken], rows.texts(column, start, end))
        self._take_lines(first + taken, lines[taken:])

    def _take_lines(self, first: int, lines: Sequence[str]) -> None:
        for index, line in enumerate(lines, start=first):
            self._take_line(index, line)

    def _take_line(self, index: int, line: str) -> None:
        row = self._table.row(line)
        if row is None:
            self.under.append((index, line))
            return
        self._section(index).add(index, row)
        self.count += 1
        cells = self._table.cells(line)
        for column in self.texts:
            self._see(column, index, [line], [cells[column] if column < len(cells) else ""])

    def _section(self, index: int) -> Section:
        """The section of the row at an index."""
        foreign = [line for line in self.under if line[1].strip() and not is_comment(line[1])]
        if foreign and not any(line.strip() in self._headings for _, line in foreign):
            raise no_row(*foreign[0], self._table, self._file)
        if foreign or not self.sections:
            self.sections.append(Section(index, index, self.under if self.sections else []))
            self.sections[-1].start_group()
        elif self.under:
            self.sections[-1].start_group()
        self.under = []
        return self.sections[-1]

    def _see(self, column: int, first: int, lines: Sequence[str], cells: Sequence[str]) -> None:
        """Record the text of a column in some rows."""
        text_column = self.texts[column]
        for cell, count in Counter(cells).items():
            if text.number(cell, self._table.decimal) is not None:
                continue
            text_column.count += count
            text_column.example = text_column.example or cell.strip()
            if text_column.first is None:
                index = cells.index(cell)
                text_column.first = (first + index, lines[index])
