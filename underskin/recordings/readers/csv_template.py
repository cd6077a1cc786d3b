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
condition. Surplus cells, repeated fields and recordings that start twice are rejected. Long runs of rows of one id are
read at once, others row by row.
"""

import cmath
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from difflib import get_close_matches
from itertools import groupby, islice, takewhile
from typing import Any, BinaryIO, Protocol

import numpy as np

from underskin.errors import FileError
from underskin.recordings.campaign import COLUMNS, KINDS, SCHEMA, SkinDescription, Tolerances
from underskin.recordings.channels import Document
from underskin.recordings.readers import template_columns, text
from underskin.recordings.readers import template_columns as template_lines
from underskin.recordings.readers.calendar_times import iso_time, of_two_cells, time_zone
from underskin.recordings.readers.cells import BlockText, PlainRows, RowStyle
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
    TemplateLines,
)
from underskin.recordings.readers.unit_labels import lab_field, labelled_unit
from underskin.recordings.validation import CellText
from underskin.units import LAB, Floats, LabField

POSITION = ("position_x_mm", "position_y_mm")
_ID = "id"
_LEAST = 8  # least number of rows that are read at once
_Run = tuple[str, int, int]  # an id, the index of its first row and the index after its last


class CellReader(Protocol):
    """Reads single cells, and words errors about them."""

    decimal: str

    def value(self, field: str, cell: str, place: tuple[int, int], factor: float = 1.0) -> Any:
        """The value of a field in the cell at a place (row and column, from 0)."""

    def error(self, index: int, reason: str, column: int | None = None) -> FileError:
        """The error of a row, or of its cell in a column (both from 0)."""


class TemplateRecordings:
    """Collects recordings from the lines under the headings; `columns`: those that hold fields, of `width` in all."""

    def __init__(self, lines: TemplateLines, columns: Sequence[Column], width: int, reader: CellReader) -> None:
        self._lines = lines
        self._columns = columns
        self._row_columns = [column for column in columns if column.field in (*COLUMNS, MAGNITUDE, PHASE)]
        self._recording_columns = [column for column in columns if column not in self._row_columns]
        indices = [column.index for column in self._row_columns]
        self._style = RowStyle(lines.separator, reader.decimal, indices, width, is_template=True)
        self._identity = next(column.index for column in columns if column.field == _ID)
        self._width = width
        self._reader = reader
        self._recordings: list[_Recording] = []
        self._first_rows: dict[str, int] = {}
        self._current, self._continued = "", False  # the id, and whether rows without it have followed

    def documents(self) -> list[dict[str, Any]]:
        """The recordings as in a campaign document; raises FileError for an invalid date and time of day."""
        for recording, index in zip(self._recordings, self._first_rows.values(), strict=True):
            self._date(recording.constants, index)
        return [recording.document() for recording in self._recordings]

    def _date(self, constants: dict[str, Any], index: int) -> None:
        """Replace a date and a time of day by `recorded_at`, for a recording that starts at row `index`."""
        day, clock = constants.pop(DATE, None), constants.pop(CLOCK, None)
        column = next((candidate for candidate in self._columns if candidate.field == DATE), None)
        if column is None or day is clock is None:
            return
        if day is None:
            raise self._reader.error(index, f"has a time of day, {clock!r}, and no {column.heading}", column.index)
        constants["recorded_at"] = self._reader.value(
            "recorded_at", of_two_cells(day, clock or ""), (index, column.index)
        )

    def take(self, first: int, lines: Sequence[str]) -> None:
        """Read lines, the first of which has the index `first`; raises FileError."""
        rows = PlainRows(lines, self._style)
        taken = 0
        for line, start, end in rows.runs():
            self._take_rows(first + taken, lines[taken:line])
            ids = [cell.strip() for cell in rows.texts(self._identity, start, end)]
            for recording_id, run_start, run_end in _runs(ids, start):
                taken = line + run_end - start
                index = first + line + run_start - start
                if run_end - run_start < _LEAST or not self._take_run(
                    recording_id, index, rows, slice(run_start, run_end)
                ):
                    self._take_rows(index, lines[index - first : taken])
        self._take_rows(first + taken, lines[taken:])

    def _take_rows(self, first: int, lines: Sequence[str]) -> None:
        """Read lines row by row, with errors that name the row."""
        for index, line in enumerate(lines, start=first):
            row = self._lines.cells(index, line)
            if any(row):
                self._take_row(index, row)

    def _take_row(self, index: int, row: Sequence[str]) -> None:
        recording_id = row[self._identity] if self._identity < len(row) else ""
        if recording_id in self._first_rows and self._starts_recording(recording_id):
            first_line = self._first_rows[recording_id] + 1
            raise self._reader.error(
                index, f"recording {recording_id!r} began on line {first_line} already", self._identity
            )
        if not recording_id and not self._current:
            raise self._reader.error(index, "the first row of the table needs an id")
        recording = self._recording(recording_id, index)
        if len(row) > self._width:
            raise self._reader.error(index, f"has {len(row)} cells under {self._width} headings", self._width)
        if contradiction := recording.add(self._values(row, index)):
            raise self._reader.error(index, contradiction)

    def _starts_recording(self, recording_id: str) -> bool:
        """Whether rows of this id start a recording."""
        return bool(recording_id) and (recording_id != self._current or self._continued)

    def _recording(self, recording_id: str, index: int) -> "_Recording":
        """The recording that rows with this id, which may be empty, belong to."""
        if self._starts_recording(recording_id):
            self._current, self._first_rows[recording_id] = recording_id, index
            self._recordings.append(_Recording())
        self._continued = not recording_id
        return self._recordings[-1]

    def _values(self, row: Sequence[str], index: int) -> dict[str, Any]:
        """The values of a row by field."""
        cells = dict(enumerate(row))
        values = {
            column.field: self._reader.value(
                column.field, cells.get(column.index, ""), (index, column.index), column.factor
            )
            for column in self._columns
        }
        return template_columns.with_parts(values)

    def _take_run(self, recording_id: str, index: int, rows: PlainRows, run: slice) -> bool:
        """Read rows of one id at once; False where they must be read one by one."""
        starts = self._starts_recording(recording_id)
        if (starts and recording_id in self._first_rows) or not (recording_id or self._current):
            return False
        constants: dict[str, Any] = {}
        for column in self._recording_columns:
            different = {cell.strip() for cell in set(rows.texts(column.index, run.start, run.stop))} - {""}
            if len(different) > 1:
                return False
            for cell in different:
                try:
                    constants[column.field] = self._reader.value(
                        column.field, cell, (index, column.index), column.factor
                    )
                except FileError:
                    return False
        lines: dict[str, Floats | None] = {}
        for number, column in enumerate(self._row_columns):
            filled = rows.filled[run, number]
            if filled.any() and not filled.all():
                return False
            lines[column.field] = rows.numbers[number][run] * column.factor if filled.any() else None
        columns = _with_parts(lines)
        if columns is None or (not starts and self._recordings[-1].contradiction(constants)):
            return False
        self._recording(recording_id, index).add_lines(constants, columns, run.stop - run.start)
        return True


def _runs(ids: Sequence[str], start: int) -> Iterator[_Run]:
    """The runs of rows of one id; the first row has the index `start`."""
    for recording_id, run in groupby(ids):
        end = start + sum(1 for _ in run)
        yield recording_id, start, end
        start = end


def _with_parts(lines: dict[str, Floats | None]) -> dict[str, Floats | None] | None:
    """Columns with real and imaginary part instead of magnitude and phase; None where one of these is missing."""
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
    """Whether all values are NaN, which is unequal to itself and rejected after the table is read."""
    return all(isinstance(value, float) and math.isnan(value) for value in values)


class _Recording:
    """A recording being read: its `constants`, one value each, and its columns in parts."""

    def __init__(self) -> None:
        self.constants: dict[str, Any] = {}
        self.columns: dict[str, list[Floats | list[Any]]] = {}

    def contradiction(self, constants: Mapping[str, Any]) -> str:
        """The first contradiction to the rows above, in words; empty without one."""
        for field, value in constants.items():
            above = self.constants.get(field)
            if value is not None and above is not None and above != value and not _are_nan(above, value):
                return f"{field} = {value!r}, but {above!r} above it"
        return ""

    def add(self, line: Mapping[str, Any]) -> str:
        """Add the values of a row; returns a contradiction to the rows above, in words."""
        line_values = {field: line[field] for field in COLUMNS if field in line}
        if any(value is not None for value in line_values.values()):  # a single missing value is left to the checks
            for field, value in line_values.items():
                parts = self.columns.setdefault(field, [])
                last = parts[-1] if parts else None
                if isinstance(last, list):
                    last.append(value)
                else:
                    parts.append([value])
        constants = {field: value for field, value in line.items() if field not in COLUMNS and value is not None}
        if contradiction := self.contradiction(constants):
            return contradiction
        self.constants |= constants
        return ""

    def add_lines(self, constants: Mapping[str, Any], lines: Mapping[str, Floats | None], count: int) -> None:
        """Add `count` rows by their columns, and constants without contradiction."""
        self.constants |= constants
        if any(values is not None for values in lines.values()):
            for field in (name for name in COLUMNS if name in lines):
                values = lines[field]
                self.columns.setdefault(field, []).append([None] * count if values is None else values)

    def document(self) -> dict[str, Any]:
        """The recording as in a campaign document: one position, without empty columns, which belong to other kinds."""
        columns = {name: _joined(parts) for name, parts in self.columns.items() if not all(map(_is_empty, parts))}
        position = [self.constants.pop(name, None) for name in POSITION]
        conditions = {
            name.removeprefix(FURTHER): value for name, value in self.constants.items() if name.startswith(FURTHER)
        }
        single_values = {name: value for name, value in self.constants.items() if not name.startswith(FURTHER)}
        return {
            **({} if position == [None, None] else {"position_mm": position}),
            **single_values,
            **({"conditions": conditions} if conditions else {}),
            **columns,
        }


def _is_empty(part: Floats | list[Any]) -> bool:
    return isinstance(part, list) and all(value is None for value in part)


def _joined(parts: Sequence[Floats | list[Any]]) -> Floats | list[Any]:
    """The parts of a column as an array where some are arrays and the others hold only numbers; else as a list."""
    if any(isinstance(part, np.ndarray) for part in parts) and not any(map(_is_other, parts)):
        return np.concatenate(parts)
    return _counted([value for part in parts for value in (part.tolist() if isinstance(part, np.ndarray) else part)])


def _counted(values: list[Any]) -> list[Any]:
    """The values of a column, with the count of invalid cells in the place of the first one."""
    invalid = [index for index, value in enumerate(values) if isinstance(value, CellText)]
    if len(invalid) > 1:
        first = values[invalid[0]]
        values[invalid[0]] = CellText(first, f"{first.place}, and {len(invalid) - 1} more in this column")
    return values


def _is_other(part: Floats | list[Any]) -> bool:
    """Whether a list holds anything but numbers."""
    return isinstance(part, list) and not all(isinstance(value, float) for value in part)


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
    return template_lines.separator_of(content) is not None


def has_table(content: str) -> bool:
    """Whether a tab-separated text has a line of headings of the table."""
    return any(_is_heading_row(line.split("\t")) for line in content.splitlines())


def read(stream: BinaryIO, file: str, sheet: str = "") -> Document:
    """The campaign document of a filled-in template; raises FileError that names the line.

    `sheet`: the place of the text in a workbook, in words, for errors.
    """
    source = BlockText(stream, file)
    separator = template_lines.separator_of(next(source.blocks()))
    if separator is None:
        raise FileError(file, "line 1", f"must be schema,{SCHEMA}")
    template = _Template(file, TemplateLines(source, separator, file), sheet)
    return Document(template.document(), tuple(template.warnings))


def _is_heading_row(row: Sequence[str]) -> bool:
    """Whether a row is that of the headings: it starts with id, or with an unnamed index column and id."""
    first, second = [cell.lower() for cell in [*row, ""][:2]]
    return first == _ID or (first in NO_NAME and second == _ID)


class _Template:
    def __init__(self, file: str, lines: TemplateLines, sheet: str) -> None:
        self.file = file
        self.sheet = sheet
        self.lines = lines
        self.separator = lines.separator
        self.decimal = text.decimal_mark(lines.holding, lines.separator)
        self.rows = self._rows_to_headings()
        self.stated: dict[str, int] = {}  # line indices of the fields above the table
        self.warnings: list[str] = []
        self.has_local_times = False

    def _rows_to_headings(self) -> list[list[str]]:
        """The rows above the table, and last the headings."""
        rows = []
        for row in islice(self.lines, _MOST_LINES_ABOVE):
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
        return {"schema": SCHEMA, **parts["campaign"], "skin": skin, "recordings": self._recordings()}

    def _read_line_above(self, row: list[str], index: int) -> tuple[str, str, Any]:
        """A line above the table: its subject (campaign, skin or sensor), its field and its value."""
        name = template_columns.in_small_letters(row[0])
        self._require_few(row, index, 4 if name == "sensor" else 2)
        cell = row[1] if len(row) > 1 else ""
        if name == "sensor":
            values = [*row[1:], "", "", ""]
            sensor = {key: self.value(key, values[column], (index, column + 1)) for column, key in enumerate(_SENSOR)}
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

    def _recordings(self) -> list[dict[str, Any]]:
        start, end = len(self.rows), self._end()
        recordings = TemplateRecordings(self.lines, self._columns(start, end), len(self.rows[-1]), self)
        for first, lines in self.lines.blocks(start, end):
            recordings.take(first, lines)
        return recordings.documents()

    def _end(self) -> int:
        """The index after the last row of the table; rows of words below a blank line are notes."""
        start = len(self.rows)
        end = start
        under: list[list[str]] = []  # the rows behind the last that has numbers
        for first, lines in self.lines.blocks(start):
            last = next(
                (number for number in reversed(range(len(lines))) if self._is_full(first + number, lines[number])), None
            )
            if last is not None:
                end, under = first + last + 1, []
            rest = enumerate(lines[0 if last is None else last + 1 :], start=first if last is None else end)
            under += [self.lines.cells(index, line) for index, line in rest]
        cut = sum(1 for _ in takewhile(self._may_be_cut, under))
        notes = [(index, row) for index, row in enumerate(under[cut:], start=end + cut) if row[0]]
        self.warnings += [template_lines.note_message(index + 1, row) for index, row in notes]
        return end + cut

    def _is_full(self, index: int, line: str) -> bool:
        """Whether a line holds more than words; one with unclosed quotes is rejected later."""
        if self.separator not in line:
            return False
        try:
            cells = self.lines.cells(index, line)
        except FileError:
            return True
        return any(cells[1:]) and not template_lines.is_note(cells)

    def _may_be_cut(self, row: Sequence[str]) -> bool:
        """Whether words directly under the rows may start a recording whose numbers are missing: no cell names an
        unknown sensor or kind."""
        known_values = {"sensor": self._sensors(), "kind": set(KINDS)}
        names = [(known_values.get(heading.lower()), cell) for heading, cell in zip(self.rows[-1], row, strict=False)]
        return any(row) and all(not cell or not allowed or cell in allowed for allowed, cell in names)

    def _sensors(self) -> set[str]:
        return {row[1] for row in self.rows[:-1] if row[0].lower() == "sensor" and len(row) > 1}

    def _columns(self, start: int, end: int) -> list[Column]:
        """The columns that hold fields, each field once."""
        headings = self.rows[-1]

        def under(places: Sequence[int]) -> Iterator[list[str]]:
            return self.lines.under(places, len(headings), start, end)

        try:
            columns, notes = template_columns.columns(headings, under, _FIELDS, self.decimal)
        except NoField as error:
            raise self.error(start - 1, str(error), error.index) from None
        self.warnings += notes
        self.warnings += template_columns.halved(column.heading for column in columns)
        return columns

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

    def _time(self, cell: str, place: tuple[int, int]) -> str:
        zone = time_zone()
        try:
            time = iso_time(cell, zone)
        except ValueError as error:
            raise self.error(place[0], f"recorded_at = {cell!r} {error}", place[1]) from None
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
