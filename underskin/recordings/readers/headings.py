"""Names and units of the columns of a table in a text, from the lines above it.

The names are on the nearest line above the numbers that has a word for each column; behind another line, such as the
marker `eoh`, a line with a known unit, or after a word such as `columns:`, comes before the nearest. A line of units
may stand between names and numbers.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from underskin.errors import FileError
from underskin.recordings.readers import text
from underskin.recordings.readers.table import BLANKS, Table, split, uncommented
from underskin.recordings.readers.unit_labels import labelled_unit, unit, without_brackets

_LABEL = re.compile(
    r"(?P<units>units?|einheit(en)?)\s*[:=]\s*|((column|channel|field|heading|header|(fancy)?name)s?|spalten?)\s*[:=]\s*",
    re.IGNORECASE,
)
_WIDE_BLANKS = re.compile(r"\t|\s{2,}")
_WITH_UNITS = re.compile(r"[^\s\[(]+(?:\s*[\[(][^\])]*[\])])?")  # Load (uN)
_MARKER = re.compile(r"\[[^\[\]]*\s[^\[\]]*\]")  # [Header end]
_VALUE = re.compile(r"[-+]?\.?\d[-+\d.,:/ %]*([eE][-+]?\d+)?")
_NO_UNITS = ("", "-", "–", "1", "%", "°C", "K", "#", "a.u.", "n/a")


@dataclass(frozen=True)
class Headings:
    """Name and unit of each column; `lines`: the indices of the lines that state them, from 0; `beside`: values that
    stand under names of their own to the right of the table's."""

    names: Sequence[tuple[str, str]]
    lines: tuple[int, ...] = ()
    beside: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class _Candidate:
    line: int
    cells: Sequence[str]
    label: str  # "units", "names", or none
    is_next: bool  # to the numbers, but for blank lines and a line of units

    def is_units(self) -> bool:
        """Whether it holds units: some of them, among other words, by more than a letter, which may be a symbol."""
        units = [without_brackets(cell) for cell in self.cells]
        known = [cell for cell, label in zip(self.cells, units, strict=True) if unit(label) is not None]
        other_count = sum(label not in _NO_UNITS for label in units) - len(known)
        states_values = any("=" in label or ":" in label for label in units)  # k=3 N/m
        are_units = len(known) > 0 and (
            other_count == 0 or (other_count <= len(known) and len(max(known, key=len)) > 1)
        )
        return self.label == "units" or (self.label == "" and are_units and not states_values)

    def holds_value(self) -> bool:
        """Whether a cell is a number, with either decimal mark, a date or a time."""
        return any(_VALUE.fullmatch(cell.strip()) for cell in self.cells)


def find(lines: Sequence[str], table: Table, file: str) -> Headings:
    """The headings of a table; `column 1`, … where there are none.

    Raises FileError where the line above the numbers has quotes that do not close.
    """
    _require_closed_quotes(lines, table, file)
    lines, beside = _without_values_beside(lines, table)
    candidates = list(_candidates(lines, table))
    units = _units(candidates)
    named = [candidate for candidate in candidates if candidate is not units and _is_full(candidate, table)]
    names = _names(named, units, lines)
    if names is None and units is not None and _is_full(units, table):  # which also serves as names
        names, units = units, units if all(unit(cell) for cell in units.cells) else None
    if names is None:
        return Headings([(f"column {number}", "") for number in range(1, table.width + 1)])
    padding = [""] * table.width
    stated_units = padding if units is None else [without_brackets(cell) for cell in [*units.cells, *padding]]
    headings = [
        (name or f"column {number}", by_row or labelled_unit(name))
        for number, name, by_row in zip(range(1, table.width + 1), [*names.cells, *padding], stated_units, strict=False)
    ]
    return Headings(
        headings, tuple(dict.fromkeys(candidate.line for candidate in (names, units) if candidate is not None)), beside
    )


def _without_values_beside(lines: Sequence[str], table: Table) -> tuple[Sequence[str], dict[str, str]]:
    """The lines with the two above the numbers cut to the table, and what stands beside it on them: names, and under
    each of them a value, as oscilloscopes write their time base."""
    above = [index for index in range(table.start - 1, -1, -1) if lines[index].strip()][:2]
    if len(above) < 2 or table.separator == BLANKS:
        return lines, {}
    edge = max(table.columns) + 1
    values, names = (split(lines[index], table.separator) for index in above)
    beside = dict(zip(names[edge:], values[edge:], strict=False))
    are_values = [bool(_VALUE.fullmatch(value)) and not _VALUE.fullmatch(name) for name, value in beside.items()]
    if not beside or len(values) != len(names) or len(beside) < len(names) - edge or not all(are_values):
        return lines, {}
    cut = {index: table.separator.join(cells[:edge]) for index, cells in zip(above, (values, names), strict=True)}
    return [cut.get(index, line) for index, line in enumerate(lines[: table.start])], beside


def _units(candidates: Sequence[_Candidate]) -> _Candidate | None:
    """The line of units: one that is called so, or the nearest that is none of values."""
    labelled = next((candidate for candidate in candidates if candidate.label == "units"), None)
    nearest = next((candidate for candidate in candidates if not candidate.holds_value()), None)
    return labelled or (nearest if nearest is not None and nearest.is_units() else None)


def _names(candidates: Sequence[_Candidate], units: _Candidate | None, lines: Sequence[str]) -> _Candidate | None:
    """The line of names among those from the nearest to the farthest; above a line of `units` that next to it."""
    if units is not None and units.label == "":
        # Lines under the units are no names, which would then lack these units.
        nearest = next((candidate for candidate in candidates if candidate.line < units.line), None)
        between = lines[nearest.line + 1 : units.line] if nearest is not None else []
        return None if any(line.strip() for line in between) else nearest
    words = [candidate for candidate in candidates if not candidate.holds_value()]
    if words and words[0].is_next and not words[0].label:
        return words[0]
    for candidate in words:  # the number of cells alone is little evidence
        if candidate.label == "names" or any(unit(labelled_unit(cell)) is not None for cell in candidate.cells):
            return candidate
    return next(iter(words), next(iter(candidates), None))


def _candidates(lines: Sequence[str], table: Table) -> Iterator[_Candidate]:
    """The lines above the numbers with as many cells as columns, the nearest first.

    A line with numbers counts only where at most a line of units separates it from the table.
    """
    is_next = True
    for index in range(table.start - 1, -1, -1):
        if not lines[index].strip():
            continue
        bare = uncommented(lines[index]).strip(BLANKS)
        if _MARKER.fullmatch(bare):
            is_next = False
            continue
        label = _LABEL.match(bare)
        kind = "" if label is None else "units" if label["units"] else "names"
        cells = _cells(bare[label.end() :] if label else bare, table)
        if cells is None:
            is_next = False
            continue
        candidate = _Candidate(index, cells, kind, is_next)
        if is_next or not candidate.holds_value():
            yield candidate
        is_next = is_next and candidate.is_units()


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


def _is_full(candidate: _Candidate, table: Table) -> bool:
    """Whether every column of numbers is named, except at most one, which may be an index."""
    named = [column for column in table.columns if candidate.cells[column]]
    return len(named) >= max(len(table.columns) - 1, 2)


def _require_closed_quotes(lines: Sequence[str], table: Table, file: str) -> None:
    nearest = next((index for index in range(table.start - 1, -1, -1) if lines[index].strip()), None)
    if nearest is None or table.separator == BLANKS:
        return
    try:
        text.cells(lines[nearest], table.separator)
    except ValueError as error:
        raise FileError(file, f"line {nearest + 1}", str(error)) from None
