"""Columns and lines of the CSV template of campaigns.

Headings are read in capitals or not. `indenter_diameter_mm` is halved; magnitude and phase become real and imaginary
part; a date and a time of day become `recorded_at`. A column without a heading that only counts the rows, as
spreadsheets write it, or is empty, and a column of words that names no field, are left out.
"""

import math
import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

from underskin.recordings.campaign import SCHEMA
from underskin.recordings.readers import text
from underskin.recordings.readers.unit_labels import in_brackets, lab_field, unit

MAGNITUDE, PHASE = "frf_magnitude_pc_per_n", "frf_phase_rad"
IN_DEGREES = "frf_phase_deg"
PARTS = ("frf_re_pc_per_n", "frf_im_pc_per_n")
_NAME, _SHORT_NAME = "frf_phase", "phase"  # the second only with a magnitude
_ANGLES = {"rad": 1.0, "deg": math.pi / 180, "°": math.pi / 180}
_TURN = 2 * math.pi
_EITHER = f"{IN_DEGREES} or {PHASE}"
Meaning = tuple[str, float] | None  # a field, and the factor to its unit


def _polar_field(heading: str, phases: Collection[str] = (_NAME,)) -> Meaning:
    """Magnitude or phase, and the factor to its unit, where a heading names one with its unit."""
    name, label = _name_and_unit(heading)
    if name in phases and label in _ANGLES:
        return PHASE, _ANGLES[label]
    given = unit(label)
    if name == "frf_magnitude" and given is not None and given.dimension == "charge/force":
        return MAGNITUDE, given.to_si / 1e-12
    return (MAGNITUDE, 1.0) if _plain(heading) == MAGNITUDE else None


def is_phase_without_unit(heading: str) -> bool:
    """Whether a heading is a phase without its unit."""
    return _plain(heading) == _NAME


def angle_by_values(heading: str, largest: float) -> float:
    """The factor to rad of a phase without a unit, by the largest of its values; raises ValueError where they may be
    either."""
    if largest > _TURN:
        return _ANGLES["deg"]
    raise ValueError(f"{heading!r} has no unit, and its values may be degrees or radians: call it {_EITHER}")


def lacking(field: str) -> str:
    """The missing counterpart of magnitude or phase, in words."""
    return f"needs {_EITHER if field == MAGNITUDE else MAGNITUDE} with it"


def _name_and_unit(heading: str) -> tuple[str, str]:
    """The name of a heading in lower case, and its unit: in brackets, or an angle after the last underscore."""
    bracketed = in_brackets(heading)
    if bracketed is not None:
        return bracketed[0].lower().replace(" ", "_"), bracketed[1]
    name, _, label = _plain(heading).rpartition("_")
    return (name, label) if label in _ANGLES else (_plain(heading), "")


FURTHER = "conditions."  # prefix of a lab's own columns
DATE, CLOCK = "date", "time of day"
_DATED = {"date": DATE, "datum": DATE, "time": CLOCK, "uhrzeit": CLOCK}
READ_AS_DEGREES = "is read as degrees: it has values beyond 2π"
NO_NAME = ("", "unnamed: 0")  # the second by pandas
_ALIKE = 0.8  # similarity of a heading and a field from which on a misspelling is assumed
# Required fields of an FRF, by field, without the unit
_NEEDED = {
    "indenter_radius_mm": "indenter_radius",
    "preload_n": "preload",
    "dynamic_force_n": "dynamic_force",
    "frequency_hz": "frequency",
    MAGNITUDE: "frf_magnitude",
}
_NO_AMPLITUDE = re.compile(r"\b(p[- ]?p|pk[- ]?pk|peak.to.peak|rms)\b")


@dataclass(frozen=True)
class Column:
    """The `index` of a column, its field, the factor to the field's unit, and the heading as written."""

    index: int
    field: str
    factor: float
    heading: str


class NoField(ValueError):
    """A heading that cannot be read; the message says why, `index` is its position."""

    def __init__(self, index: int, reason: str) -> None:
        super().__init__(reason)
        self.index = index


@dataclass
class OtherColumn:
    """Statistics of the non-empty cells of a column that names no field."""

    count: int = 0
    example: str = ""
    has_numbers: bool = False
    largest: float = 0.0  # magnitude of a number
    counts_from: float | None = None  # the first number, as long as each is one more than that above it

    @classmethod
    def of(cls, cells: Iterable[str], decimal: str) -> "OtherColumn":
        """Of all cells of a column."""
        column = cls()
        for cell in filter(None, cells):
            column.see(cell, decimal)
        return column

    def see(self, cell: str, decimal: str) -> None:
        """Add the next cell."""
        number = text.number(cell, decimal)
        if not self.count:
            self.example, self.counts_from = cell, number
        elif self.counts_from is not None and number != self.counts_from + self.count:
            self.counts_from = None
        if number is not None:
            self.has_numbers = True
            self.largest = max(self.largest, abs(number))
        self.count += 1

    def only_counts(self, index: int, heading: str) -> bool:
        """Whether it is the column at an index without a heading that is empty or counts the rows, from 0 or 1, as
        spreadsheets write it."""
        is_first = index == 0 and self.counts_from in (0, 1)
        return heading.strip().lower() in NO_NAME and (not self.count or is_first)


def columns(
    headings: Sequence[str], rows: Iterable[Sequence[str]], field_names: Collection[str], decimal: str
) -> tuple[list[Column], list[str]]:
    """The columns that hold fields, and messages on the others, by the cells of the `rows` under them.

    Raises NoField.
    """
    by_field: dict[str, Column] = {}
    messages: list[str] = []
    meanings = fields_of(headings, field_names)
    if not any(meaning is not None and meaning[0] == "recorded_at" for meaning in meanings):
        meanings = _dated(headings, meanings)
    present = {meaning[0] for meaning in meanings if meaning is not None}
    others = {index: OtherColumn() for index, meaning in enumerate(meanings) if meaning is None}
    for row in rows if others else ():
        for index, column in others.items():
            if index < len(row) and row[index]:
                column.see(row[index], decimal)
    for index, (heading, meaning) in enumerate(zip(headings, meanings, strict=True)):
        if meaning is None and is_phase_without_unit(heading):
            try:
                meaning = PHASE, angle_by_values(heading, others[index].largest)
            except ValueError as error:
                raise NoField(index, str(error)) from None
            messages.append(f"{heading!r} {READ_AS_DEGREES}")
        if meaning is None:
            messages += _without(index, heading, others[index], field_names, present)
            continue
        field, factor = meaning
        if field in by_field:
            raise NoField(index, f"{heading!r} is a second column of {field}")
        by_field[field] = Column(index, field, factor, heading)
    _require_complete(by_field)
    return list(by_field.values()), messages


def fields_of(headings: Sequence[str], field_names: Collection[str]) -> list[Meaning]:
    """The field of each heading and the factor to its unit; `Phase [deg]` beside a magnitude without one is its
    phase."""
    meanings = [field_of(heading, field_names) for heading in headings]
    fields = {meaning[0] for meaning in meanings if meaning is not None}
    if MAGNITUDE not in fields or PHASE in fields:
        return meanings
    both = zip(headings, meanings, strict=True)
    return [meaning or _polar_field(heading, (_SHORT_NAME,)) for heading, meaning in both]


def field_of(heading: str, field_names: Collection[str]) -> Meaning:
    """The field of a heading and the factor to its unit; None where it names none."""
    heading = heading.strip()
    lower = heading.lower()
    if lower.startswith(FURTHER):
        return FURTHER + heading[len(FURTHER) :], 1.0
    if (name := _plain(heading)) in field_names:
        return name, 1.0
    if in_brackets(lower) == ("coherence", "%"):
        return "coherence", 0.01
    return _polar_field(heading) or lab_field(heading) or lab_field(lower)


def misspelt(heading: str, fields: Iterable[str]) -> str | None:
    """The field that a heading may be a misspelling of."""
    alike = get_close_matches(_plain(heading), list(fields), 1, _ALIKE)
    return alike[0] if alike else None


def halved(headings: Iterable[str]) -> list[str]:
    """Messages that diameters among the headings are halved."""
    return [f"{heading!r} is halved" for heading in headings if _plain(heading).startswith("indenter_diameter")]


def _plain(heading: str) -> str:
    return heading.strip().lower().replace(" ", "_")


def _dated(headings: Sequence[str], meanings: Sequence[Meaning]) -> list[Meaning]:
    """The meanings including a date and its time of day; without a date, a time is no time of day."""
    dated = [_DATED.get(heading.strip().lower()) for heading in headings]
    if DATE not in dated:
        return list(meanings)
    return [
        (field, 1.0) if meaning is None and field is not None else meaning
        for field, meaning in zip(dated, meanings, strict=True)
    ]


def in_small_letters(name: str) -> str:
    """A name in lower case, with its unit in brackets unchanged."""
    bracket = min((position for mark in "[(" if (position := name.find(mark)) >= 0), default=len(name))
    return name[:bracket].lower() + name[bracket:]


def _without(
    index: int, heading: str, column: OtherColumn, field_names: Collection[str], present: Collection[str]
) -> list[str]:
    """A message that a column without a field is left out, if it matters; raises NoField where data would be lost.
    `present` are the fields of the other columns."""
    if column.only_counts(index, heading):
        return []
    if heading.strip().lower() in NO_NAME:
        raise NoField(index, f"has no heading, but cells such as {column.example!r}")
    reason = f"{heading!r} is no field, or its unit is not of the field"
    words = heading.lower().replace("_", " ")
    if "force" in words and _NO_AMPLITUDE.search(words):
        raise NoField(index, f"{reason}; dynamic_force_n is the amplitude: half of peak-to-peak, √2 times rms")
    if alike := misspelt(heading, [*field_names, MAGNITUDE, PHASE, IN_DEGREES]):
        raise NoField(index, f"{reason}; did you mean {alike}?")
    keep = f"{FURTHER}NAME keeps a column of anything else"
    if column.has_numbers:
        lacking = _lacking(heading, present)
        raise NoField(
            index,
            f"{reason}; is it {' or '.join(lacking)}, which the table lacks? {keep}"
            if lacking
            else f"{reason}; {keep}",
        )
    if not column.count:
        return []
    return [f"column {heading!r} holds words and is no field: it is left out ({keep})"]


def _lacking(heading: str, present: Collection[str]) -> list[str]:
    """The missing fields of an FRF whose dimension is that of a heading's unit."""
    bracketed = in_brackets(heading)
    if bracketed is None or "displacement_mm" in present:
        return []
    if bracketed[1] in _ANGLES and not {PHASE, PARTS[1]} & {*present}:
        return [PHASE if bracketed[1] == "rad" else IN_DEGREES]
    has = {*present, *([MAGNITUDE] if PARTS[0] in present else [])}
    return [
        field
        for field, name in _NEEDED.items()
        if field not in has and field_of(f"{name} [{bracketed[1]}]", ()) is not None
    ]


def _require_complete(by_field: dict[str, Column]) -> None:
    """Raise NoField for a magnitude without its phase, and for both with real and imaginary parts."""
    given = [by_field[name] for name in (MAGNITUDE, PHASE) if name in by_field]
    if len(given) == 1:
        raise NoField(given[0].index, f"{given[0].heading!r} {lacking(given[0].field)}")
    if given and any(part in by_field for part in PARTS):
        raise NoField(given[0].index, f"{given[0].heading!r} is given with real and imaginary parts: leave out either")


_FIRST_LINE = 2000
_TO_SPREADSHEETS = re.compile(r"sep=\S?\s*", re.IGNORECASE)
_SEPARATORS = ("\t", ";", ",")


def separator_of(start: str) -> str | None:
    """The separator of a template with this start; None where it is no template."""
    first = next((line for line in text.lines(start[:_FIRST_LINE]) if not is_empty_line(line)), "")
    return next((mark for mark in _SEPARATORS if _first_cells(first, mark) == ["schema", SCHEMA]), None)


def _first_cells(line: str, separator: str) -> list[str]:
    try:
        return [cell.lower() for cell in text.cells(line, separator)[:2]]
    except ValueError:
        return []


def is_empty_line(line: str) -> bool:
    """Whether a line is blank, a comment, or states the separator for spreadsheets."""
    bare = line.strip().strip('"')
    return not bare or bare.startswith("#") or _TO_SPREADSHEETS.fullmatch(bare) is not None


def is_note(row: Sequence[str]) -> bool:
    """Whether a row may be a note: its first cell is not empty, and no cell holds a number."""
    return bool(row[0]) and not any(text.is_grouped(cell) or is_number(cell) for cell in row)


def note_message(number: int, row: Sequence[str]) -> str:
    """The message that a note on a line, counted from 1, is left out."""
    return f"line {number} under the table, {', '.join(filter(None, row))!r}, is left out"


def is_number(cell: str) -> bool:
    """Whether a cell holds a number, with either decimal mark."""
    return any(text.number(cell, mark) is not None for mark in ".,")
