"""Campaigns as CSV, by one template: lines about the skin, then a table with a row per line or sample.

    schema,campaign/1
    name,palm 3 in May
    skin.thickness_mm,2.5
    sensor,s01,0,0

    id,sensor,preload_n,frequency_hz,frf_re_pc_per_n,frf_im_pc_per_n
    r1,s01,1.0,10,7.1,-0.5
    ,,,20,7.2,-0.6

Separator, decimal mark and units are the file's own: `;` and `,` work, `preload [mN]` is converted. An empty cell
under a quantity that a recording has once repeats the one above; an empty `id` continues the recording.
"""

from dataclasses import fields
from typing import Any, BinaryIO

from underskin.errors import FileError
from underskin.recordings import text
from underskin.recordings.campaign import COLUMNS, KINDS, SCHEMA, SkinDescription
from underskin.recordings.unit_labels import lab_field, labelled_unit
from underskin.units import LAB, LabField

_FIRST_LINE = 200
_SEPARATORS = ("\t", ";", ",")
_POSITION = {"position_x_mm": 0, "position_y_mm": 1}
_TEXTS = ("id", "kind", "sensor", "recorded_at", "name", "skin.id")
_SKIN_FIELDS = tuple(f"skin.{entry.name}" for entry in fields(SkinDescription) if entry.name != "sensors")
_KNOWN = {entry.name for kind in KINDS.values() for entry in fields(kind)} | set(_POSITION)
_FLAGS = {"true": True, "false": False}


def is_template(content: str) -> bool:
    """Whether a text begins as the template does."""
    return _separator(content) is not None


def read(stream: BinaryIO, file: str) -> dict[str, Any]:
    """The campaign document of a filled-in template; raises FileError that names the line."""
    content = text.content(stream, file)
    separator = _separator(content)
    if separator is None:
        raise FileError(file, "line 1", f"must be schema,{SCHEMA}")
    return _Template(file, [text.cells(line, separator) for line in text.lines(content)], separator).document()


def _separator(content: str) -> str | None:
    first = text.lines(content[:_FIRST_LINE])[0]
    return next((mark for mark in _SEPARATORS if text.cells(first, mark)[:2] == ["schema", SCHEMA]), None)


class _Template:
    def __init__(self, file: str, rows: list[list[str]], separator: str) -> None:
        self.file = file
        self.rows = rows
        self.decimal = "." if separator == "," else self._decimal()

    def _decimal(self) -> str:
        """A comma where a cell is a number only that way."""
        cells = (cell for row in self.rows for cell in row)
        return "," if any("," in cell and text.number(cell, ",") is not None for cell in cells) else "."

    def document(self) -> dict[str, Any]:
        table = next((index for index, row in enumerate(self.rows) if row[0].lower() == "id"), None)
        if table is None:
            raise FileError(self.file, f"line {len(self.rows)}", "the table is missing: no line begins with id")
        document: dict[str, Any] = {"schema": SCHEMA, "skin": {}, "recordings": []}
        for index, row in enumerate(self.rows[:table]):
            if any(row):
                self._about(document, row, index)
        document["recordings"] = self._recordings(table)
        return document

    def _about(self, document: dict[str, Any], row: list[str], index: int) -> None:
        """A line above the table: of the campaign, of the skin, or a sensor."""
        name, values = row[0], [*row[1:], ""]
        if name == "sensor":
            sensor = {key: self._value(key, cell) for key, cell in zip(("id", "x_mm", "y_mm"), values, strict=False)}
            document["skin"].setdefault("sensors", []).append(sensor)
        elif name == "units_checked":
            document[name] = _FLAGS.get(values[0].lower(), values[0])
        elif name in ("schema", "name"):
            document[name] = values[0]
        else:
            field, factor = self._field(name.removeprefix("skin."), index)
            if f"skin.{field}" not in _SKIN_FIELDS or not name.startswith("skin."):
                raise FileError(self.file, f"line {index + 1}", f"{name!r} is neither of the campaign nor of its skin")
            document["skin"][field] = self._value(f"skin.{field}", values[0], factor)
            if factor != 1.0 and not self._units_checked():
                self._require_meant(name, field, values[0], document["skin"][field], index)

    def _units_checked(self) -> bool:
        return any([cell.lower() for cell in row[:2]] == ["units_checked", "true"] for row in self.rows)

    def _require_meant(self, heading: str, field: str, cell: str, converted: Any, index: int) -> None:
        """Refuses a value that is likely in the field's unit and unlikely in the one that its heading says."""
        number, known = text.number(cell, self.decimal), LAB[field]
        if number is None or known.likely is None or _likely(known, converted) or not _likely(known, number):
            return
        said = f"{cell} {labelled_unit(heading)} is {converted:g} {known.unit}: was {cell} {known.unit} meant?"
        raise FileError(self.file, f"line {index + 1}", f"{heading} = {cell}: {said} (if not, units_checked,true)")

    def _recordings(self, table: int) -> list[dict[str, Any]]:
        headings = self._headings(table)
        recordings: dict[str, dict[str, Any]] = {}
        current: dict[str, Any] | None = None
        for index, row in enumerate(self.rows[table + 1 :], start=table + 1):
            if not any(row):
                continue
            if row[0]:
                current = recordings.setdefault(row[0], {})
            if current is None:
                raise FileError(self.file, f"line {index + 1}", "the first row of the table needs an id")
            if len(row) > len(headings):
                raise FileError(self.file, f"line {index + 1}", f"has {len(row)} cells under {len(headings)} headings")
            cells = [*row, *[""] * (len(headings) - len(row))]
            line = {name: self._value(name, cell, factor) for (name, factor), cell in zip(headings, cells, strict=True)}
            self._add_entries(current, {field: line.pop(field) for field in COLUMNS if field in line})
            for field, value in line.items():
                if value is not None:
                    self._add(current, field, value, index)
        return [_without_unused(recording) for recording in recordings.values()]

    def _headings(self, table: int) -> list[tuple[str, float]]:
        """The field of each column and the factor to its unit, each field once."""
        headings: dict[str, float] = {}
        for cell in self.rows[table]:
            field, factor = self._field(cell, table)
            if field in headings:
                raise FileError(self.file, f"line {table + 1}", f"{cell!r} is a second column of {field}")
            headings[field] = factor
        return list(headings.items())

    def _add_entries(self, recording: dict[str, Any], line: dict[str, Any]) -> None:
        """A row's entries of the columns, if it has any; one that is missing beside others is for the checks."""
        if any(value is not None for value in line.values()):
            for field, value in line.items():
                recording.setdefault(field, []).append(value)

    def _add(self, recording: dict[str, Any], field: str, value: Any, index: int) -> None:
        if field in _POSITION:
            recording.setdefault("position_mm", [None, None])[_POSITION[field]] = value
        elif recording.setdefault(field, value) != value:
            before = recording[field]
            raise FileError(self.file, f"line {index + 1}", f"{field} = {value!r}, but {before!r} above it")

    def _field(self, heading: str, index: int) -> tuple[str, float]:
        """The field of a heading and the factor to its unit."""
        if heading in _KNOWN or f"skin.{heading}" in _SKIN_FIELDS:
            return heading, 1.0
        found = lab_field(heading)
        if found is None:
            raise FileError(self.file, f"line {index + 1}", f"{heading!r} is no field, or its unit is not of the field")
        return found

    def _value(self, field: str, cell: str, factor: float = 1.0) -> Any:
        """The number in a cell; what is no number stays as it is, for the campaign's checks to refuse."""
        if not cell:
            return None
        number = None if field in _TEXTS else text.number(cell, self.decimal)
        return cell if number is None else number * factor


def _likely(known: LabField, value: float) -> bool:
    assert known.likely is not None
    return known.likely[0] <= value <= known.likely[1]


def _without_unused(recording: dict[str, Any]) -> dict[str, Any]:
    """The recording without the columns that it leaves empty, which are another kind's."""
    return {
        name: value
        for name, value in recording.items()
        if name not in COLUMNS or any(entry is not None for entry in value)
    }
