"""The recordings in the table of the CSV template: rows by row, or many rows of one recording at once."""

import cmath
import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any, Protocol

import numpy as np

from underskin.errors import FileError
from underskin.recordings.campaign import COLUMNS
from underskin.recordings.readers import polar_columns
from underskin.recordings.readers.calendar_times import of_two_cells
from underskin.recordings.readers.plain_rows import PlainRows, RowStyle
from underskin.recordings.readers.polar_columns import MAGNITUDE, PARTS, PHASE
from underskin.recordings.readers.template_columns import CLOCK, DATE, FURTHER, Column
from underskin.recordings.readers.template_lines import TemplateLines
from underskin.recordings.shown_values import CellText
from underskin.units import Floats

POSITION = ("position_x_mm", "position_y_mm")
_ID = "id"
_LEAST = 8  # rows that are worth being taken at once
_Run = tuple[str, int, int]  # an id, the first of its rows and the one behind the last


class CellReader(Protocol):
    """What reads single cells, and words errors about them."""

    decimal: str

    def value(self, field: str, cell: str, place: tuple[int, int], factor: float = 1.0) -> Any:
        """The value of a field in the cell at a place (row and column, from 0)."""

    def error(self, index: int, reason: str, column: int | None = None) -> FileError:
        """What is wrong with a row, or with its cell in a column (both from 0)."""


class TemplateRecordings:
    """Takes the lines under the headings; `columns` are those that hold fields, of `width` in all."""

    def __init__(self, lines: TemplateLines, columns: Sequence[Column], width: int, reader: CellReader) -> None:
        self._lines = lines
        self._columns = columns
        self._each = [column for column in columns if column.field in (*COLUMNS, MAGNITUDE, PHASE)]
        self._once = [column for column in columns if column not in self._each]
        places = [column.place for column in self._each]
        self._style = RowStyle(lines.separator, reader.decimal, places, width, is_template=True)
        self._identity = next(column.place for column in columns if column.field == _ID)
        self._width = width
        self._reader = reader
        self._recordings: list[_Recording] = []
        self._begun: dict[str, int] = {}
        self._current, self._continued = "", False  # the id, and whether rows without it have followed

    def documents(self) -> list[dict[str, Any]]:
        """The recordings as in a campaign; raises FileError where a date and a time of day are no time."""
        for recording, index in zip(self._recordings, self._begun.values(), strict=True):
            self._date(recording.once, index)
        return [recording.document() for recording in self._recordings]

    def _date(self, once: dict[str, Any], index: int) -> None:
        """Put `recorded_at` in place of a date and a time of day, of a recording that begins in a row."""
        day, clock = once.pop(DATE, None), once.pop(CLOCK, None)
        column = next((one for one in self._columns if one.field == DATE), None)
        if column is None or day is clock is None:
            return
        if day is None:
            raise self._reader.error(index, f"has a time of day, {clock!r}, and no {column.heading}", column.place)
        once["recorded_at"] = self._reader.value("recorded_at", of_two_cells(day, clock or ""), (index, column.place))

    def take(self, first: int, lines: Sequence[str]) -> None:
        """Take lines, of which the first is at an index; raises FileError."""
        rows = PlainRows(lines, self._style)
        taken = 0
        for line, start, end in rows.runs():
            self._take_rows(first + taken, lines[taken:line])
            ids = [cell.strip() for cell in rows.texts(self._identity, start, end)]
            for own, run_start, run_end in _runs(ids, start):
                taken = line + run_end - start
                index = first + line + run_start - start
                if run_end - run_start < _LEAST or not self._take_run(own, index, rows, slice(run_start, run_end)):
                    self._take_rows(index, lines[index - first : taken])
        self._take_rows(first + taken, lines[taken:])

    def _take_rows(self, first: int, lines: Sequence[str]) -> None:
        """The same row by row, which names what is wrong."""
        for index, line in enumerate(lines, start=first):
            row = self._lines.cells(index, line)
            if any(row):
                self._take_row(index, row)

    def _take_row(self, index: int, row: Sequence[str]) -> None:
        own = row[self._identity] if self._identity < len(row) else ""
        if own in self._begun and self._begins(own):
            began = self._begun[own] + 1
            raise self._reader.error(index, f"recording {own!r} began on line {began} already", self._identity)
        if not own and not self._current:
            raise self._reader.error(index, "the first row of the table needs an id")
        recording = self._recording(own, index)
        if len(row) > self._width:
            raise self._reader.error(index, f"has {len(row)} cells under {self._width} headings", self._width)
        if contradiction := recording.add(self._values(row, index)):
            raise self._reader.error(index, contradiction)

    def _begins(self, own: str) -> bool:
        """Whether rows of this id begin a recording."""
        return bool(own) and (own != self._current or self._continued)

    def _recording(self, own: str, index: int) -> "_Recording":
        """The recording that rows with an id, or with none, belong to."""
        if self._begins(own):
            self._current, self._begun[own] = own, index
            self._recordings.append(_Recording())
        self._continued = not own
        return self._recordings[-1]

    def _values(self, row: Sequence[str], index: int) -> dict[str, Any]:
        """The values of a row by field."""
        cells = dict(enumerate(row))
        values = {
            one.field: self._reader.value(one.field, cells.get(one.place, ""), (index, one.place), one.factor)
            for one in self._columns
        }
        return polar_columns.with_parts(values)

    def _take_run(self, own: str, index: int, rows: PlainRows, run: slice) -> bool:
        """Take rows of one id at once; False where single rows must tell what they are."""
        begins = self._begins(own)
        if (begins and own in self._begun) or not (own or self._current):
            return False
        once: dict[str, Any] = {}
        for column in self._once:
            different = {cell.strip() for cell in set(rows.texts(column.place, run.start, run.stop))} - {""}
            if len(different) > 1:
                return False
            for cell in different:
                try:
                    once[column.field] = self._reader.value(column.field, cell, (index, column.place), column.factor)
                except FileError:
                    return False
        lines: dict[str, Floats | None] = {}
        for place, column in enumerate(self._each):
            filled = rows.filled[run, place]
            if filled.any() and not filled.all():
                return False
            lines[column.field] = rows.numbers[place][run] * column.factor if filled.any() else None
        whole = _with_parts(lines)
        if whole is None or (not begins and self._recordings[-1].contradiction(once)):
            return False
        self._recording(own, index).add_lines(once, whole, run.stop - run.start)
        return True


def _runs(ids: Sequence[str], start: int) -> Iterator[_Run]:
    """The runs of rows of one id, of which the first row is at `start`."""
    for own, run in groupby(ids):
        end = start + sum(1 for _ in run)
        yield own, start, end
        start = end


def _with_parts(lines: dict[str, Floats | None]) -> dict[str, Floats | None] | None:
    """Columns with real and imaginary part in place of magnitude and phase; None where one lacks the other."""
    if MAGNITUDE not in lines:
        return lines
    others = {field: values for field, values in lines.items() if field not in (MAGNITUDE, PHASE)}
    magnitude, phase = lines[MAGNITUDE], lines[PHASE]
    if magnitude is None and phase is None:
        return {**others, **dict.fromkeys(PARTS)}
    if magnitude is None or phase is None:
        return None
    values = np.array(list(map(cmath.rect, magnitude.tolist(), phase.tolist())))
    return {**others, PARTS[0]: values.real.copy(), PARTS[1]: values.imag.copy()}


def _are_nan(*values: Any) -> bool:
    """Whether all are NaN, which equals nothing and is refused once the table is read."""
    return all(isinstance(value, float) and math.isnan(value) for value in values)


class _Recording:
    """A recording under way: what it has once, and its columns in parts."""

    def __init__(self) -> None:
        self.once: dict[str, Any] = {}
        self.columns: dict[str, list[Floats | list[Any]]] = {}

    def contradiction(self, once: Mapping[str, Any]) -> str:
        """What contradicts the rows above, in words."""
        for field, value in once.items():
            above = self.once.get(field)
            if value is not None and above is not None and above != value and not _are_nan(above, value):
                return f"{field} = {value!r}, but {above!r} above it"
        return ""

    def add(self, line: Mapping[str, Any]) -> str:
        """Take the values of a row; what contradicts those above it, in words."""
        entries = {field: line[field] for field in COLUMNS if field in line}
        if any(value is not None for value in entries.values()):  # one missing beside others is for the checks
            for field, value in entries.items():
                parts = self.columns.setdefault(field, [])
                last = parts[-1] if parts else None
                if isinstance(last, list):
                    last.append(value)
                else:
                    parts.append([value])
        once = {field: value for field, value in line.items() if field not in COLUMNS and value is not None}
        if contradiction := self.contradiction(once):
            return contradiction
        self.once |= once
        return ""

    def add_lines(self, once: Mapping[str, Any], lines: Mapping[str, Floats | None], count: int) -> None:
        """Take `count` rows at once, by their columns, and what they have once, which contradicts nothing."""
        self.once |= once
        if any(values is not None for values in lines.values()):
            for field in (name for name in COLUMNS if name in lines):
                values = lines[field]
                self.columns.setdefault(field, []).append([None] * count if values is None else values)

    def document(self) -> dict[str, Any]:
        """As in a campaign: one position, and no columns that it leaves empty, which are another kind's."""
        columns = {name: _joined(parts) for name, parts in self.columns.items() if not all(map(_is_empty, parts))}
        position = [self.once.pop(name, None) for name in POSITION]
        noted = {name.removeprefix(FURTHER): value for name, value in self.once.items() if name.startswith(FURTHER)}
        own = {name: value for name, value in self.once.items() if not name.startswith(FURTHER)}
        return {
            **({} if position == [None, None] else {"position_mm": position}),
            **own,
            **({"conditions": noted} if noted else {}),
            **columns,
        }


def _is_empty(part: Floats | list[Any]) -> bool:
    return isinstance(part, list) and all(entry is None for entry in part)


def _joined(parts: Sequence[Floats | list[Any]]) -> Floats | list[Any]:
    """An array where some parts are, and the others hold numbers alone; else a list."""
    if any(isinstance(part, np.ndarray) for part in parts) and not any(map(_is_other, parts)):
        return np.concatenate(parts)
    return _counted([entry for part in parts for entry in (part.tolist() if isinstance(part, np.ndarray) else part)])


def _counted(entries: list[Any]) -> list[Any]:
    """The entries of a column, of which the first that is no number says how many more there are."""
    wrong = [place for place, entry in enumerate(entries) if isinstance(entry, CellText)]
    if len(wrong) > 1:
        first = entries[wrong[0]]
        entries[wrong[0]] = CellText(first, f"{first.place}, and {len(wrong) - 1} more in this column")
    return entries


def _is_other(part: Floats | list[Any]) -> bool:
    """Whether a part holds anything but numbers."""
    return isinstance(part, list) and not all(isinstance(entry, float) for entry in part)
