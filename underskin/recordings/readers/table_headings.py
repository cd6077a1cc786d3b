"""The names and units of a text table's columns, from the lines above its numbers.

The names are the nearest line above the numbers that has a cell for each column: the nearest with a known unit, or
behind a word such as `columns:`, before the nearest of all. A line of units may stand between, and so may lines that
are neither, such as the marker `eoh`.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from underskin.errors import FileError
from underskin.recordings.readers import text
from underskin.recordings.readers.cell_bytes import BLANKS
from underskin.recordings.readers.table_rows import Table, split, uncommented
from underskin.recordings.readers.unit_labels import labelled_unit, unit, without_brackets

_LABEL = re.compile(
    r"(?P<units>units?|einheit(en)?)\s*[:=]\s*|((column|channel|field|heading|header|(fancy)?name)s?|spalten?)\s*[:=]\s*",
    re.IGNORECASE,
)
_WIDE_BLANKS = re.compile(r"\t|\s{2,}")
_WITH_UNITS = re.compile(r"[^\s\[(]+(?:\s*[\[(][^\])]*[\])])?")  # Load (uN)
_NO_UNITS = ("", "-", "–", "1", "%", "°C", "K", "#", "a.u.", "n/a")


@dataclass(frozen=True)
class Headings:
    """Name and unit of each column; `lines` are the numbers of the lines that say them, from 0."""

    names: Sequence[tuple[str, str]]
    lines: tuple[int, ...] = ()


@dataclass(frozen=True)
class _Candidate:
    line: int
    cells: Sequence[str]
    label: str  # "units", "names", or none

    def is_sure(self) -> bool:
        """Whether more than the number of its cells speaks for names."""
        return self.label == "names" or any(unit(labelled_unit(cell)) is not None for cell in self.cells)

    def is_units(self) -> bool:
        units = [without_brackets(cell) for cell in self.cells]
        known = sum(unit(cell) is not None for cell in units)
        others = sum(cell not in _NO_UNITS for cell in units) - known
        states_values = any("=" in cell or ":" in cell for cell in units)  # k=3 N/m
        return self.label == "units" or (self.label == "" and known > 0 and others <= known and not states_values)


def find(lines: Sequence[str], table: Table, file: str) -> Headings:
    """The headings of a table; `column 1`, … where there are none.

    Raises FileError where the line above the numbers has quotes that do not close.
    """
    _require_closed_quotes(lines, table, file)
    candidates = list(_candidates(lines, table))
    units = next((one for one in candidates if one.is_units()), None)
    names = _names([one for one in candidates if one is not units and _full(one, table)], units, table)
    if names is None:  # a line of units alone names the columns as well
        names = units if units is not None and _full(units, table) else None
    if names is None:
        return Headings([(f"column {number}", "") for number in range(1, table.width + 1)])
    said = [""] * table.width if units is None else [without_brackets(cell) for cell in _padded(units.cells, table)]
    headings = [
        (name or f"column {number}", by_row or labelled_unit(name))
        for number, (name, by_row) in enumerate(zip(_padded(names.cells, table), said, strict=True), start=1)
    ]
    return Headings(headings, tuple(dict.fromkeys(one.line for one in (names, units) if one is not None)))


def _names(candidates: Sequence[_Candidate], units: _Candidate | None, table: Table) -> _Candidate | None:
    """The line of names among those from the nearest to the farthest; above a line of `units` the nearest to it."""
    if units is not None and units.label == "":
        # What stands under the units is nearer than names and neither: they would be names without these units.
        return next((one for one in candidates if one.line < units.line), None)
    words = [one for one in candidates if not _holds_number(one, table)]
    return next((one for one in words if one.is_sure()), next(iter(words), next(iter(candidates), None)))


def _candidates(lines: Sequence[str], table: Table) -> Iterator[_Candidate]:
    """The lines above the numbers with as many cells as these have columns, the nearest first.

    One with numbers among its cells is none, unless nothing stands between it and the numbers but a line of units.
    """
    nearest = True
    for index in range(table.start - 1, -1, -1):
        if not lines[index].strip():
            continue
        bare = uncommented(lines[index]).strip()
        label = _LABEL.match(bare)
        said = "" if label is None else "units" if label["units"] else "names"
        cells = _cells(bare[label.end() :] if label else bare, table)
        if cells is not None:
            candidate = _Candidate(index, cells, said)
            if nearest or not _holds_number(candidate, table):
                yield candidate
            nearest = nearest and candidate.is_units()
        else:
            nearest = False


def _cells(line: str, table: Table) -> Sequence[str] | None:
    """The cells of a line above the table, if they can be headings; separated like the table, or else otherwise."""
    cells = split(line, table.separator)
    if table.separator != BLANKS and cells:
        cells = [*cells, *[""] * (line.count(table.separator) + 1 - len(cells))][: max(table.width, len(cells))]
    ways = [cells]
    if table.separator == BLANKS:
        ways = [_WIDE_BLANKS.split(line), *ways, _WITH_UNITS.findall(line)]
        ways += [[cell.strip() for cell in line.split(mark)] for mark in "\t;,"]
    return next((cells for cells in ways if max(table.columns) < len(cells) <= table.width), None)


def _full(candidate: _Candidate, table: Table) -> bool:
    """Whether every column of numbers is named, but for one, which may be an index."""
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
