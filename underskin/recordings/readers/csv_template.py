"""Campaigns as CSV by one template: lines about the skin, then a table with a row per line or sample.

    schema,campaign/1
    name,palm 3 in May
    skin.thickness_mm,2.5
    sensor,s01,0,0

    id,sensor,preload_n,frequency_hz,frf_re_pc_per_n,frf_im_pc_per_n
    r1,s01,1.0,10,7.1,-0.5
    ,,,20,7.2,-0.6

Separator, decimal mark and units are those of the file: `;` and `,` work, `preload [mN]` is converted. A first line
`sep=;` and lines that begin with `#` are ignored; a line of words below a blank one under the table is a note. A cell
in quotes may hold the separator. An empty cell of a quantity that a recording has once repeats the one above; an empty
`id` continues the recording, and so does the same id in every row. A column `conditions.NAME` holds any further
condition. Surplus cells, repeated fields and recordings that start twice are rejected.
"""

import cmath
import math
from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from datetime import datetime
from difflib import get_close_matches
from itertools import islice, takewhile
from operator import itemgetter
from typing import Any, BinaryIO

import numpy as np

from underskin.errors import FileError
from underskin.recordings.campaign import COLUMNS, KINDS, SCHEMA, SkinDescription, Tolerances
from underskin.recordings.channels import Document
from underskin.recordings.readers import template_columns, text
from underskin.recordings.readers.template_columns import (
    CLOCK,
    DATE,
    FURTHER,
    MAGNITUDE,
    NO_NAME,
    PARTS,
    PHASE,
    Column,
    NoField,
)
from underskin.recordings.readers.text import iso_time, of_two_cells, time_zone
from underskin.recordings.readers.unit_labels import lab_field, labelled_unit
from underskin.recordings.validation import CellText
from underskin.units import LAB, Floats, LabField

POSITION = ("position_x_mm", "position_y_mm")
_ID = "id"


class _Recording:
    """A recording being read, which begins at row `index`: its `constants`, one value each, and the values of its row
    columns, in their order, as written; `others` are those that are no numbers, by row and column."""

    def __init__(self, index: int) -> None:
        self.index = index
        self.constants: dict[str, Any] = {}
        self.numbers = array("d")
        self.others: dict[tuple[int, int], Any] = {}

    def contradiction(self, constants: Mapping[str, Any]) -> str:
        """The first contradiction to the rows above, in words; empty without one."""
        for field, value in constants.items():
            above = self.constants.get(field, value)
            if above != value and not (above != above and value != value):  # NaN, which is rejected later
                return f"{field} = {value!r}, but {above!r} above it"
        return ""

    def add(self, values: Sequence[Any]) -> None:
        """Add the values of a row, unless all are missing; a single missing one is left to the checks."""
        if all(value is None for value in values):
            return
        row = len(self.numbers) // len(values)
        for column, value in enumerate(values):
            if not isinstance(value, float):
                self.others[row, column] = value
            self.numbers.append(value if isinstance(value, float) else math.nan)

    def document(self, row_columns: Sequence[Column]) -> dict[str, Any]:
        """The recording as in a campaign document, with one position."""
        single_values = {name: value for name, value in self.constants.items() if not name.startswith(FURTHER)}
        position = [single_values.pop(name, None) for name in POSITION]
        conditions = {
            name.removeprefix(FURTHER): value for name, value in self.constants.items() if name.startswith(FURTHER)
        }
        return {
            **({} if position == [None, None] else {"position_mm": position}),
            **single_values,
            **({"conditions": conditions} if conditions else {}),
            **self._in_units(row_columns),
        }

    def _in_units(self, row_columns: Sequence[Column]) -> dict[str, Floats | list[Any]]:
        """The columns in the units of their fields, without empty ones, which belong to other kinds."""
        numbers = np.frombuffer(self.numbers).reshape(-1, max(len(row_columns), 1))
        factors = {column.field: column.factor for column in row_columns}
        values = {field: numbers[:, index] * factor for index, (field, factor) in enumerate(factors.items())}
        others: dict[str, dict[int, Any]] = {field: {} for field in values}
        for (row, index), value in self.others.items():
            others[row_columns[index].field][row] = value
        if MAGNITUDE in values:
            magnitude, phase = values.pop(MAGNITUDE), values.pop(PHASE)
            frf = np.array(list(map(cmath.rect, magnitude.tolist(), phase.tolist())), complex)
            values |= {PARTS[0]: frf.real.copy(), PARTS[1]: frf.imag.copy()}
            wrong = others.pop(MAGNITUDE), others.pop(PHASE)
            for part, given, stated in zip(PARTS, wrong, (magnitude, phase), strict=True):
                rows = wrong[0].keys() | wrong[1].keys()
                others[part] = {row: given.get(row, float(stated[row])) for row in rows}
        columns = {field: _column(values[field], others[field]) for field in COLUMNS if field in values}
        return {field: column for field, column in columns.items() if column is not None}


def _column(numbers: Floats, others: Mapping[int, Any]) -> Floats | list[Any] | None:
    """A column with the values that are no numbers, and the count of invalid cells in the place of the first one; None
    where it is empty."""
    if not others:
        return numbers if len(numbers) else None
    if len(others) == len(numbers) and all(value is None for value in others.values()):
        return None
    values: list[Any] = numbers.tolist()
    for row, value in others.items():
        values[row] = value
    invalid = sorted(row for row, value in others.items() if isinstance(value, CellText))
    if len(invalid) > 1:
        first = values[invalid[0]]
        values[invalid[0]] = CellText(first, f"{first.place}, and {len(invalid) - 1} more in this column")
    return values


_SENSOR = ("id", "x_mm", "y_mm")
_TEXTS = ("id", "kind", "sensor", "recorded_at", "estimator", "name", "skin.id", DATE, CLOCK)
_TOLERANCE = "tolerances."
_SKIN_FIELDS = (
    *(
        f"skin.{model_field.name}"
        for model_field in fields(SkinDescription)
        if model_field.name not in ("sensors", "tolerances")
    ),
    *(f"skin.{_TOLERANCE}{model_field.name}" for model_field in fields(Tolerances)),
)
_FIELDS = ({model_field.name for kind in KINDS.values() for model_field in fields(kind)} | set(POSITION)) - {
    "conditions"
}
_MOST_LINES_ABOVE = 10_000  # lines
_FLAGS = {"true": True, "false": False}


def is_template(content: str) -> bool:
    """Whether a text starts like the template."""
    return template_columns.separator_of(content) is not None


def has_table(content: str) -> bool:
    """Whether a tab-separated text has a line of headings of the table."""
    return any(_is_heading_row(line.split("\t")) for line in content.splitlines())


def read(stream: BinaryIO, file: str) -> Document:
    """The campaign document of a filled-in template; raises FileError that names the line."""
    return of_text(text.content(stream, file), file)


def of_text(written: str, file: str, sheet: str = "") -> Document:
    """The campaign document of a text with line feeds as line ends; raises as `read`.

    `sheet`: the place of the text in a workbook, in words, for errors.
    """
    separator = template_columns.separator_of(written)
    if separator is None:
        raise FileError(file, "line 1", f"must be schema,{SCHEMA}")
    template = _Template(written, separator, file, sheet)
    return Document(template.document(), tuple(template.warnings))


def _is_heading_row(row: Sequence[str]) -> bool:
    """Whether a row is that of the headings: it starts with id, or with an unnamed index column and id."""
    first, second = [cell.lower() for cell in [*row, ""][:2]]
    return first == _ID or (first in NO_NAME and second == _ID)


class _Template:
    def __init__(self, written: str, separator: str, file: str, sheet: str) -> None:
        self.written = written
        self.separator = separator
        self.file = file
        self.sheet = sheet
        self.decimal = text.decimal_mark((cells for _, cells in self._lines() if len(cells) > 1), separator)
        self.rows = self._rows_to_headings()
        self.stated: dict[str, int] = {}  # line indices of the fields above the table
        self.warnings: list[str] = []
        self.has_local_times = self.has_unreadable_times = False

    def _lines(self, start: int = 0) -> Iterator[tuple[int, list[str]]]:
        """The index of each line from `start` on, and its cells; one empty cell of a blank line or comment."""
        for first, lines in text.blocks(self.written):
            for index, line in enumerate(lines[max(0, start - first) :], start=max(start, first)):
                yield index, self.cells(index, line)

    def cells(self, index: int, line: str) -> list[str]:
        """The cells of the line at an index, from 0; raises FileError where its quotes do not close."""
        try:
            cells = text.cells(line, self.separator)
        except ValueError as error:
            if not template_columns.is_empty_line(line):
                raise self.error(index, str(error)) from None
            return [""]
        # An id may start with #, like the number of a press: then numbers follow it.
        is_empty = template_columns.is_empty_line(line) and not any(map(template_columns.is_number, cells[1:]))
        return [""] if is_empty else cells

    def _rows_to_headings(self) -> list[list[str]]:
        """The rows above the table, and last the headings."""
        rows = []
        for _, row in islice(self._lines(), _MOST_LINES_ABOVE):
            rows.append(row)
            if _is_heading_row(row):
                return rows
        raise self.error(len(rows) - 1, "the table is missing: no line begins with id")

    def document(self) -> dict[str, Any]:
        """The campaign document."""
        above = [self._read_line_above(row, index) for index, row in enumerate(self.rows[:-1]) if any(row)]
        parts = {part: {field: value for of, field, value in above if of == part} for part in ("campaign", "skin")}
        sensors = [value for part, _, value in above if part == "sensor"]
        tolerances = {name: value for name, value in parts["skin"].items() if name.startswith(_TOLERANCE)}
        skin = {name: value for name, value in parts["skin"].items() if name not in tolerances}
        if tolerances:
            skin["tolerances"] = {name.removeprefix(_TOLERANCE): value for name, value in tolerances.items()}
        skin |= {"sensors": sensors} if sensors else {}
        return {
            "schema": SCHEMA,
            **parts["campaign"],
            "skin": skin,
            "recordings": _Rows(self, self._columns()).recordings(),
        }

    def _read_line_above(self, row: list[str], index: int) -> tuple[str, str, Any]:
        """A line above the table: its subject (campaign, skin or sensor), its field and its value."""
        name = template_columns.in_small_letters(row[0])
        self._require_few(row, index, 4 if name == "sensor" else 2)
        cell = row[1] if len(row) > 1 else ""
        if name == "sensor":
            values = [*row[1:], "", "", ""]
            sensor = {
                key: self.value(key, values[column], (index, column + 1))
                for column, key in enumerate(_SENSOR)
                if values[column]
            }
            return "sensor", name, sensor
        if name in ("schema", "name", "units_checked"):
            self._require_first(name, index)
            return "campaign", name, _FLAGS.get(cell.lower(), cell) if name == "units_checked" else cell
        field, factor = self._field(name.removeprefix("skin."), index)
        if f"skin.{field}" not in _SKIN_FIELDS or not name.startswith("skin."):
            raise self.error(index, f"{name!r} is neither of the campaign nor of its skin")
        self._require_first(f"skin.{field}", index)
        value = self.value(f"skin.{field}", cell, (index, 1), factor)
        if factor != 1.0 and not self._units_checked():
            self._require_meant(name, field, cell, value, index)
        return "skin", field, value

    def _require_few(self, row: list[str], index: int, most: int) -> None:
        """Reject surplus cells of a line above the table, such as the digits after a decimal comma."""
        if len(row) > most:
            point = ", decimals are written with a point" if self.separator == "," else ""
            hint = f"cells that hold {self.separator!r} go in quotes{point}"
            raise self.error(index, f"{row[most]!r} is a cell too many under {row[0]}: {hint}", most)

    def _require_first(self, field: str, index: int) -> None:
        """Reject a field that was stated before."""
        before = self.stated.setdefault(field, index)
        if before != index:
            raise self.error(index, f"{field} is given on line {before + 1} already", 0)

    def _units_checked(self) -> bool:
        return any([cell.lower() for cell in row[:2]] == ["units_checked", "true"] for row in self.rows)

    def _require_meant(self, heading: str, field: str, cell: str, converted: Any, index: int) -> None:
        """Reject a value that is likely in the field's unit and unlikely in the unit of its heading."""
        number, quantity = text.number(cell, self.decimal), LAB[field]
        if number is None or quantity.likely is None or _likely(quantity, converted) or not _likely(quantity, number):
            return
        hint = f"{cell} {labelled_unit(heading)} is {converted:g} {quantity.unit}: was {cell} {quantity.unit} meant?"
        raise self.error(index, f"{heading} = {cell}: {hint} (if not, units_checked,true)")

    def _columns(self) -> list[Column]:
        """The columns that hold fields, each field once."""
        headings, start = self.rows[-1], len(self.rows)
        rows = (cells for _, cells in self._lines(start))
        try:
            columns, notes = template_columns.columns(headings, rows, _FIELDS, self.decimal)
        except NoField as error:
            raise self.error(start - 1, str(error), error.index) from None
        self.warnings += notes
        self.warnings += template_columns.halved(column.heading for column in columns)
        return columns

    def without_notes(self, under: Sequence[tuple[int, list[str]]]) -> list[tuple[int, list[str]]]:
        """The first of the lines under the last row with numbers that may start a recording; the others are notes."""
        cut = list(takewhile(lambda line: self._may_be_cut(line[1]), under))
        self.warnings += [template_columns.note_message(index + 1, row) for index, row in under[len(cut) :] if row[0]]
        return cut

    def _may_be_cut(self, row: Sequence[str]) -> bool:
        """Whether words directly under the rows may start a recording whose numbers are missing: no cell names an
        unknown sensor or kind."""
        sensors = {row[1] for row in self.rows[:-1] if row[0].lower() == "sensor" and len(row) > 1}
        known_values = {"sensor": sensors, "kind": set(KINDS)}
        names = [(known_values.get(heading.lower()), cell) for heading, cell in zip(self.rows[-1], row, strict=False)]
        return any(row) and all(not cell or not allowed or cell in allowed for allowed, cell in names)

    def _field(self, name: str, index: int) -> tuple[str, float]:
        """The field of the skin for a name above the table, and the factor to its unit."""
        if f"skin.{name}" in _SKIN_FIELDS:
            return name, 1.0
        field_and_factor = lab_field(name)
        if field_and_factor is None:
            close = get_close_matches(f"skin.{name}", _SKIN_FIELDS, 1)
            guess = f"; did you mean {close[0]}?" if close else ""
            raise self.error(index, f"{name!r} is no field, or its unit is not of the field{guess}")
        return field_and_factor

    def value(self, field: str, cell: str, place: tuple[int, int], factor: float = 1.0) -> Any:
        """The number in the cell at a place (row and column, from 0).

        Anything else is unchanged, to be rejected by the campaign's checks.
        """
        if cell and field == "recorded_at":
            return self._time(cell, place)
        if not cell or field in _TEXTS:
            return cell or None
        number = text.number(cell, self.decimal)
        if number is not None:
            return number * factor
        if text.is_grouped(cell):
            raise self.error(place[0], f"{field} = {cell!r} {text.ungrouped(cell)}", place[1])
        where = f"{self.sheet and f'{self.sheet}, '}line {place[0] + 1}, column {place[1] + 1}"
        if self.decimal == "," and text.number(cell, ".") is not None:
            where += "; decimals of this file are written with a comma"
        return CellText(cell, where)

    def _time(self, cell: str, place: tuple[int, int]) -> str | None:
        """A time with its zone; None, with a note on the first, of one that cannot be read."""
        zone = time_zone()
        try:
            (time,) = (iso_time(day, zone) for day in text.with_day_first([cell], self.decimal))
            datetime.fromisoformat(time)
        except ValueError as error:
            if not self.has_unreadable_times:
                where = f"line {place[0] + 1}, column {place[1] + 1}"
                self.warnings.append(f"{where}: recorded_at = {cell!r} {text.no_time(error)}")
            self.has_unreadable_times = True
            return None
        if time != cell and not self.has_local_times:
            self.has_local_times = True
            self.warnings.append(f"times such as {cell} are taken to be in the zone {zone} (UNDERSKIN_TIME_ZONE)")
        return time

    def error(self, index: int, reason: str, column: int | None = None) -> FileError:
        """The error of a row, or of its cell in a column (both from 0)."""
        place = f"line {index + 1}" if column is None else f"line {index + 1}, column {column + 1}"
        return FileError(self.file, place, reason)


def _likely(quantity: LabField, value: float) -> bool:
    assert quantity.likely is not None
    return quantity.likely[0] <= value <= quantity.likely[1]


class _Rows:
    """Reads the rows under the headings into recordings; `columns`: those that hold fields."""

    def __init__(self, template: _Template, columns: Sequence[Column]) -> None:
        self._template = template
        self._row_columns = [column for column in columns if column.field in (*COLUMNS, MAGNITUDE, PHASE)]
        self._recording_columns = [column for column in columns if column not in self._row_columns]
        self._identity = next(column for column in columns if column.field == _ID)
        self._date = next((column for column in columns if column.field == DATE), None)
        self._width = len(template.rows[-1])
        of_rows = [column.index for column in self._row_columns]
        self._of_row = itemgetter(*of_rows) if len(of_rows) > 1 else None  # plain rows hold several numbers
        self._others = [index for index in range(self._width) if index not in of_rows]
        self._recordings: dict[str, _Recording] = {}
        self._current, self._continued = "", False  # the id, and whether rows without it have followed

    def recordings(self) -> list[dict[str, Any]]:
        """The recordings as in a campaign document; raises FileError that names the line."""
        template = self._template
        under: list[tuple[int, list[str]]] = []  # the lines since the last row that holds more than words
        for first, lines in text.blocks(template.written):
            skipped = max(0, len(template.rows) - first)
            for index, line in enumerate(lines[skipped:], start=first + skipped):
                if not under and self._take_plain(line):
                    continue
                under.append((index, template.cells(index, line)))
                if any(under[-1][1][1:]) and not template_columns.is_note(under[-1][1]):
                    self._take(under)
                    under = []
        self._take(template.without_notes(under))
        for recording in self._recordings.values():
            self._join_date(recording.constants, recording.index)
        return [recording.document(self._row_columns) for recording in self._recordings.values()]

    def _take_plain(self, line: str) -> bool:
        """Read a row that holds numbers in all columns of rows, and nothing else; False for others."""
        if self._of_row is None or not self._current or self._template.decimal == ",":
            return False
        if '"' in line or "_" in line or not line.isascii():
            return False
        cells = line.split(self._template.separator)
        if len(cells) != self._width or any(map(cells.__getitem__, self._others)):
            return False
        try:
            self._recordings[self._current].numbers.extend(list(map(float, self._of_row(cells))))
        except ValueError:
            return False
        self._continued = True
        return True

    def _take(self, rows: Sequence[tuple[int, list[str]]]) -> None:
        for index, row in rows:
            if any(row):
                self._take_row(index, row)

    def _take_row(self, index: int, row: Sequence[str]) -> None:
        cells = [*row, *[""] * (self._width - len(row))]
        recording_id = cells[self._identity.index]
        if recording_id and (recording_id != self._current or self._continued):
            if recording_id in self._recordings:
                first_line = self._recordings[recording_id].index + 1
                reason = f"recording {recording_id!r} began on line {first_line} already"
                raise self._template.error(index, reason, self._identity.index)
            self._current, self._recordings[recording_id] = recording_id, _Recording(index)
        if not self._current:
            raise self._template.error(index, "the first row of the table needs an id")
        self._continued = not recording_id
        if len(row) > self._width:
            reason = f"has {len(row)} cells under {self._width} headings"
            raise self._template.error(index, reason, self._width)
        recording = self._recordings[self._current]
        constants = {
            column.field: self._value(column, cells[column.index], index, column.factor)
            for column in self._recording_columns
            if cells[column.index]
        }
        if contradiction := recording.contradiction(constants):
            raise self._template.error(index, contradiction)
        recording.add([self._value(column, cells[column.index], index) for column in self._row_columns])
        recording.constants |= constants

    def _value(self, column: Column, cell: str, index: int, factor: float = 1.0) -> Any:
        return self._template.value(column.field, cell, (index, column.index), factor)

    def _join_date(self, constants: dict[str, Any], index: int) -> None:
        """Replace a date and a time of day by `recorded_at`, for a recording that starts at row `index`."""
        day, clock = constants.pop(DATE, None), constants.pop(CLOCK, None)
        if self._date is None or day is clock is None:
            return
        if day is None:
            reason = f"has a time of day, {clock!r}, and no {self._date.heading}"
            raise self._template.error(index, reason, self._date.index)
        constants["recorded_at"] = self._template.value(
            "recorded_at", of_two_cells(day, clock or ""), (index, self._date.index)
        )
