"""Campaigns as CSV, by one template: lines about the skin, then a table with a row per line or sample.

    schema,campaign/1
    name,palm 3 in May
    skin.thickness_mm,2.5
    sensor,s01,0,0

    id,sensor,preload_n,frequency_hz,frf_re_pc_per_n,frf_im_pc_per_n
    r1,s01,1.0,10,7.1,-0.5
    ,,,20,7.2,-0.6

Separator, decimal mark and units are the file's own: `;` and `,` work, `preload [mN]` is converted. A first line
`sep=;` and lines that begin with `#` say nothing; a line of one cell, below a blank one under the table, is a note. A
cell in quotes may hold the separator. An empty cell under a quantity that a recording has once repeats the one above;
an empty `id` continues the recording, and so does its own id where every row has it. A column `conditions.NAME` holds
whatever else the lab noted. A cell too many, a field that comes again and a recording that begins twice are refused.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import fields
from difflib import get_close_matches
from typing import Any, BinaryIO

from underskin.errors import FileError
from underskin.recordings.campaign import COLUMNS, KINDS, SCHEMA
from underskin.recordings.channels import Document
from underskin.recordings.conditions import SkinDescription
from underskin.recordings.readers import template_columns, text
from underskin.recordings.readers.calendar_times import iso_time
from underskin.recordings.readers.template_columns import FURTHER, NO_NAME, Column, NoField
from underskin.recordings.readers.unit_labels import lab_field, labelled_unit
from underskin.recordings.shown_values import CellText
from underskin.recordings.time_zone import time_zone
from underskin.units import LAB, LabField

_FIRST_LINE = 2000
_TO_SPREADSHEETS = re.compile(r"sep=\S?\s*", re.IGNORECASE)
_SEPARATORS = ("\t", ";", ",")
_POSITION = ("position_x_mm", "position_y_mm")
_SENSOR = ("id", "x_mm", "y_mm")
_TEXTS = ("id", "kind", "sensor", "recorded_at", "estimator", "name", "skin.id")
_SKIN_FIELDS = tuple(f"skin.{entry.name}" for entry in fields(SkinDescription) if entry.name != "sensors")
_KNOWN = ({entry.name for kind in KINDS.values() for entry in fields(kind)} | set(_POSITION)) - {"conditions"}
_ID = "id"
_NO_ZONE = "times such as 24.12.2025 09:30 are taken to be in the zone {zone} (UNDERSKIN_TIME_ZONE)"
_FLAGS = {"true": True, "false": False}


def is_template(content: str) -> bool:
    """Whether a text begins as the template does."""
    return _separator(content) is not None


def read(stream: BinaryIO, file: str) -> Document:
    """The campaign document of a filled-in template; raises FileError that names the line."""
    content = text.content(stream, file)
    separator = _separator(content)
    if separator is None:
        raise FileError(file, "line 1", f"must be schema,{SCHEMA}")
    template = _Template(file, list(_rows(content, separator, file)), separator)
    return Document(template.document(), tuple(template.warnings))


def _separator(content: str) -> str | None:
    first = next((line for line in text.lines(content[:_FIRST_LINE]) if not _says_nothing(line)), "")
    return next((mark for mark in _SEPARATORS if _first_cells(first, mark) == ["schema", SCHEMA]), None)


def _first_cells(line: str, separator: str) -> list[str]:
    try:
        return [cell.lower() for cell in text.cells(line, separator)[:2]]
    except ValueError:
        return []


def _rows(content: str, separator: str, file: str) -> Iterator[list[str]]:
    for number, line in enumerate(text.lines(content), start=1):
        try:
            cells = text.cells(line, separator)
        except ValueError as error:
            if not _says_nothing(line):
                raise FileError(file, f"line {number}", str(error)) from None
            cells = [""]
        # An id may begin with #, as numbers of presses do: then numbers follow it.
        counts = any(text.number(cell, mark) is not None for cell in cells[1:] for mark in ".,")
        yield cells if counts or not _says_nothing(line) else [""]


def _says_nothing(line: str) -> bool:
    """Whether a line is blank, a comment, or tells a spreadsheet its separator."""
    bare = line.strip().strip('"')
    return not bare or bare.startswith("#") or _TO_SPREADSHEETS.fullmatch(bare) is not None


def _begins_table(row: Sequence[str]) -> bool:
    """Whether a row is the headings: they begin with id, behind an index without a heading too."""
    first, second = [cell.lower() for cell in [*row, ""][:2]]
    return first == _ID or (first in NO_NAME and second == _ID)


class _Template:
    def __init__(self, file: str, rows: list[list[str]], separator: str) -> None:
        self.file = file
        self.rows = rows
        self.separator = separator
        self.decimal = text.decimal_mark(rows, separator)
        self.lines: dict[str, int] = {}  # where the fields above the table stand
        self.warnings: list[str] = []

    def document(self) -> dict[str, Any]:
        table = next((index for index, row in enumerate(self.rows) if _begins_table(row)), None)
        if table is None:
            raise self._error(len(self.rows) - 1, "the table is missing: no line begins with id")
        above = [self._above(row, index) for index, row in enumerate(self.rows[:table]) if any(row)]
        parts = {part: {field: value for of, field, value in above if of == part} for part in ("campaign", "skin")}
        sensors = [value for part, _, value in above if part == "sensor"]
        skin = {**parts["skin"], **({"sensors": sensors} if sensors else {})}
        return {"schema": SCHEMA, **parts["campaign"], "skin": skin, "recordings": self._recordings(table)}

    def _above(self, row: list[str], index: int) -> tuple[str, str, Any]:
        """A line above the table: what it is about (campaign, skin or sensor), its field and its value."""
        name = template_columns.in_small_letters(row[0])
        self._require_few(row, index, 4 if name == "sensor" else 2)
        cell = row[1] if len(row) > 1 else ""
        if name == "sensor":
            values = [*row[1:], "", "", ""]
            sensor = {key: self._value(key, values[place], (index, place + 1)) for place, key in enumerate(_SENSOR)}
            return "sensor", name, sensor
        if name in ("schema", "name", "units_checked"):
            self._require_first(name, index)
            return "campaign", name, _FLAGS.get(cell.lower(), cell) if name == "units_checked" else cell
        field, factor = self._field(name.removeprefix("skin."), index)
        if f"skin.{field}" not in _SKIN_FIELDS or not name.startswith("skin."):
            raise self._error(index, f"{name!r} is neither of the campaign nor of its skin")
        self._require_first(f"skin.{field}", index)
        value = self._value(f"skin.{field}", cell, (index, 1), factor)
        if factor != 1.0 and not self._units_checked():
            self._require_meant(name, field, cell, value, index)
        return "skin", field, value

    def _require_few(self, row: list[str], index: int, most: int) -> None:
        """Refuses cells behind those that a line above the table has, such as what follows a decimal comma."""
        if len(row) > most:
            point = ", decimals are written with a point" if self.separator == "," else ""
            hint = f"cells that hold {self.separator!r} go in quotes{point}"
            raise self._error(index, f"{row[most]!r} is a cell too many under {row[0]}: {hint}", most)

    def _require_first(self, field: str, index: int) -> None:
        """Refuses a field that stands above already."""
        before = self.lines.setdefault(field, index)
        if before != index:
            raise self._error(index, f"{field} is given on line {before + 1} already", 0)

    def _units_checked(self) -> bool:
        return any([cell.lower() for cell in row[:2]] == ["units_checked", "true"] for row in self.rows)

    def _require_meant(self, heading: str, field: str, cell: str, converted: Any, index: int) -> None:
        """Refuses a value that is likely in the field's unit and unlikely in the one that its heading says."""
        number, known = text.number(cell, self.decimal), LAB[field]
        if number is None or known.likely is None or _likely(known, converted) or not _likely(known, number):
            return
        said = f"{cell} {labelled_unit(heading)} is {converted:g} {known.unit}: was {cell} {known.unit} meant?"
        raise self._error(index, f"{heading} = {cell}: {said} (if not, units_checked,true)")

    def _recordings(self, table: int) -> list[dict[str, Any]]:
        end = self._end(table)
        columns = self._columns(table, end)
        identity = next(column.place for column in columns if column.field == _ID)
        recordings: list[_Recording] = []
        begun: dict[str, int] = {}
        current, continued = "", False  # the id of the recording, and whether rows without it have followed
        for index, row in enumerate(self.rows[table + 1 : end], start=table + 1):
            if not any(row):
                continue
            own = row[identity] if identity < len(row) else ""
            if own and (own != current or continued):
                if own in begun:
                    raise self._error(index, f"recording {own!r} began on line {begun[own] + 1} already", identity)
                current, begun[own] = own, index
                recordings.append(_Recording())
            continued = not own
            if not current:
                raise self._error(index, "the first row of the table needs an id")
            if len(row) > len(self.rows[table]):
                reason = f"has {len(row)} cells under {len(self.rows[table])} headings"
                raise self._error(index, reason, len(self.rows[table]))
            if contradiction := recordings[-1].add(self._line(columns, row, index)):
                raise self._error(index, contradiction)
        return [recording.document() for recording in recordings]

    def _end(self, table: int) -> int:
        """The row behind the last of the table; single cells below a blank line under it are notes."""
        end = max(index for index in range(table, len(self.rows)) if any(self.rows[index][1:])) + 1
        while end < len(self.rows) and any(self.rows[end]):
            end += 1
        notes = [(index, row[0]) for index, row in enumerate(self.rows[end:], start=end) if row[0]]
        self.warnings += [f"line {index + 1} under the table, {note!r}, is left out" for index, note in notes]
        return end

    def _line(self, columns: Sequence[Column], row: list[str], index: int) -> dict[str, Any]:
        """The values of a row by field."""
        cells = dict(enumerate(row))
        values = {
            one.field: self._value(one.field, cells.get(one.place, ""), (index, one.place), one.factor)
            for one in columns
        }
        return template_columns.with_parts(values)

    def _columns(self, table: int, end: int) -> list[Column]:
        """The field of each column and the factor to its unit, each field once."""
        try:
            columns, left_out = template_columns.columns(
                self.rows[table], self.rows[table + 1 : end], _KNOWN, self.decimal
            )
        except NoField as error:
            raise self._error(table, str(error), error.place) from None
        self.warnings += left_out
        halved = [column.heading for column in columns if column.heading.lower().startswith("indenter")]
        self.warnings += [f"{heading!r} is halved" for heading in halved if "diameter" in heading.lower()]
        return columns

    def _field(self, name: str, index: int) -> tuple[str, float]:
        """The field of the skin that a name above the table means, and the factor to its unit."""
        if f"skin.{name}" in _SKIN_FIELDS:
            return name, 1.0
        known = lab_field(name)
        if known is None:
            close = get_close_matches(f"skin.{name}", _SKIN_FIELDS, 1)
            guess = f"; did you mean {close[0]}?" if close else ""
            raise self._error(index, f"{name!r} is no field, or its unit is not of the field{guess}")
        return known

    def _value(self, field: str, cell: str, place: tuple[int, int], factor: float = 1.0) -> Any:
        """The number in the cell at a place (row and column, from 0).

        What is no number stays as it is, for the campaign's checks to refuse.
        """
        if cell and field == "recorded_at":
            return self._time(cell, place)
        if not cell or field in _TEXTS:
            return cell or None
        number = text.number(cell, self.decimal)
        if number is not None:
            return number * factor
        if text.is_grouped(cell):
            raise self._error(place[0], f"{field} = {cell!r} {text.ungrouped(cell)}", place[1])
        return CellText(cell, f"line {place[0] + 1}, column {place[1] + 1}")

    def _time(self, cell: str, place: tuple[int, int]) -> str:
        zone = time_zone()
        try:
            time = iso_time(cell, zone)
        except ValueError as error:
            raise self._error(place[0], f"recorded_at = {cell!r} {error}", place[1]) from None
        if time != cell and (said := _NO_ZONE.format(zone=zone)) not in self.warnings:
            self.warnings.append(said)
        return time

    def _error(self, index: int, reason: str, column: int | None = None) -> FileError:
        """What is wrong with a row, or with its cell in a column (both from 0)."""
        place = f"line {index + 1}" if column is None else f"line {index + 1}, column {column + 1}"
        return FileError(self.file, place, reason)


def _likely(known: LabField, value: float) -> bool:
    assert known.likely is not None
    return known.likely[0] <= value <= known.likely[1]


class _Recording:
    """A recording, row by row."""

    def __init__(self) -> None:
        self.once: dict[str, Any] = {}
        self.columns: dict[str, list[Any]] = {}

    def add(self, line: dict[str, Any]) -> str:
        """Take the values of a row; what contradicts those above it, in words."""
        entries = {field: line[field] for field in COLUMNS if field in line}
        if any(value is not None for value in entries.values()):  # one missing beside others is for the checks
            for field, value in entries.items():
                self.columns.setdefault(field, []).append(value)
        for field, value in line.items():
            if field not in COLUMNS and value is not None and self.once.setdefault(field, value) != value:
                return f"{field} = {value!r}, but {self.once[field]!r} above it"
        return ""

    def document(self) -> dict[str, Any]:
        """As in a campaign: one position, and no columns that it leaves empty, which are another kind's."""
        columns = {name: column for name, column in self.columns.items() if any(entry is not None for entry in column)}
        position = [self.once.pop(name, None) for name in _POSITION]
        noted = {name.removeprefix(FURTHER): value for name, value in self.once.items() if name.startswith(FURTHER)}
        own = {name: value for name, value in self.once.items() if not name.startswith(FURTHER)}
        return {
            **({} if position == [None, None] else {"position_mm": position}),
            **own,
            **({"conditions": noted} if noted else {}),
            **columns,
        }
