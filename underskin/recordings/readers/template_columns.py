"""Columns and lines of the campaign template.

An FRF in columns of its magnitude and its phase, which stand for its real and imaginary part.

The columns of the CSV template: which field each heading means, and what is no field.

Headings are read in capitals or not. `indenter_diameter_mm` is halved, a magnitude with a phase is a complex value, a
date and a time of day are `recorded_at`. A column without a heading that only counts its rows, as spreadsheets write
it, or is empty, and a column of words that names no field, are left out.

The lines of the CSV template as rows of cells, which may be gone through any number of times.
"""

import cmath
import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

from underskin.errors import FileError
from underskin.recordings.campaign import SCHEMA
from underskin.recordings.readers import text
from underskin.recordings.readers.cells import BlockText, PlainRows, RowStyle
from underskin.recordings.readers.unit_labels import in_brackets, lab_field, unit

MAGNITUDE, PHASE = "frf_magnitude_pc_per_n", "frf_phase_rad"
IN_DEGREES = "frf_phase_deg"
PARTS = ("frf_re_pc_per_n", "frf_im_pc_per_n")
_NAME, _SHORT_NAME = "frf_phase", "phase"  # the second only beside a magnitude
_ANGLES = {"rad": 1.0, "deg": math.pi / 180, "°": math.pi / 180}
_TURN = 2 * math.pi
_EITHER = f"{IN_DEGREES} or {PHASE}"
Meaning = tuple[str, float] | None  # a field, and the factor to its unit


def polar_field(heading: str) -> Meaning:
    """Magnitude or phase, and the factor to its unit, where a heading names one with its unit."""
    name, label = _name_and_unit(heading)
    if name == _NAME and label in _ANGLES:
        return PHASE, _ANGLES[label]
    if heading.lower().replace(" ", "_") == MAGNITUDE:
        return MAGNITUDE, 1.0
    given = unit(label)
    if name == "frf_magnitude" and given is not None and given.dimension == "charge/force":
        return MAGNITUDE, given.to_si / 1e-12
    return None


def with_short_phase(headings: Sequence[str], meanings: Sequence[Meaning]) -> list[Meaning]:
    """The meanings; beside a magnitude without its phase, a heading such as `Phase [deg]` is that."""
    fields = {meant[0] for meant in meanings if meant is not None}
    if MAGNITUDE not in fields or PHASE in fields:
        return list(meanings)
    found: list[Meaning] = []
    for heading, meant in zip(headings, meanings, strict=True):
        name, label = _name_and_unit(heading)
        is_phase = meant is None and name == _SHORT_NAME and label in _ANGLES
        found.append((PHASE, _ANGLES[label]) if is_phase else meant)
    return found


def phase_in(label: str) -> str:
    """The heading of a phase in a unit; empty where that is no angle."""
    return "" if label not in _ANGLES else PHASE if label == "rad" else IN_DEGREES


def is_phase_alone(heading: str) -> bool:
    """Whether a heading is a phase without its unit."""
    return heading.strip().lower().replace(" ", "_") == _NAME


def angle_by_values(heading: str, largest: float) -> float:
    """The factor to rad of a phase without a unit, by the largest of its values; raises ValueError where they may be
    either."""
    if largest > _TURN:
        return _ANGLES["deg"]
    raise ValueError(f"{heading!r} has no unit, and its values may be degrees or radians: call it {_EITHER}")


def lacking(field: str) -> str:
    """What must stand beside magnitude or phase, in words."""
    return f"needs {_EITHER if field == MAGNITUDE else MAGNITUDE} beside it"


def with_parts(line: dict[str, Any]) -> dict[str, Any]:
    """The values of a row, real and imaginary part in place of magnitude and phase."""
    if MAGNITUDE not in line:
        return line
    others = {field: value for field, value in line.items() if field not in (MAGNITUDE, PHASE)}
    magnitude, phase = line[MAGNITUDE], line[PHASE]
    if magnitude is None and phase is None:
        return {**others, **dict.fromkeys(PARTS)}
    if not isinstance(magnitude, float) or not isinstance(phase, float):
        return {**others, PARTS[0]: magnitude, PARTS[1]: phase}  # for the campaign's checks to refuse
    value = cmath.rect(magnitude, phase)
    return {**others, PARTS[0]: value.real, PARTS[1]: value.imag}


def _name_and_unit(heading: str) -> tuple[str, str]:
    """The name of a heading in small letters, and its unit: in brackets, or an angle behind the last underscore."""
    bracketed = in_brackets(heading)
    if bracketed is not None:
        return bracketed[0].lower().replace(" ", "_"), bracketed[1]
    whole = heading.strip().lower().replace(" ", "_")
    name, _, label = whole.rpartition("_")
    return (name, label) if label in _ANGLES else (whole, "")


FURTHER = "conditions."  # what else the lab noted, a column each
DATE, CLOCK = "date", "time of day"
_DATED = {"date": DATE, "datum": DATE, "time": CLOCK, "uhrzeit": CLOCK}
READ_AS_DEGREES = "is read as degrees: it has values beyond 2π"
NO_NAME = ("", "unnamed: 0")  # the second by pandas
_ALIKE = 0.8  # of a heading and a field, from which on the one may be meant for the other
# What each FRF needs, without the unit, by its field
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
    """Where a column is, its field, the factor to the field's unit, and the heading as written."""

    place: int
    field: str
    factor: float
    heading: str


class NoField(ValueError):
    """A heading that cannot be read; the message says why, `place` which one."""

    def __init__(self, place: int, reason: str) -> None:
        super().__init__(reason)
        self.place = place


@dataclass
class _Nameless:
    """What stands in the cells of a column that names no field, empty ones left out."""

    count: int = 0
    example: str = ""
    has_numbers: bool = False
    largest: float = 0.0  # magnitude of a number
    counts_from: float | None = None  # the first number, as long as each is one more than that above it

    def see(self, cell: str, decimal: str) -> None:
        """Take the next cell."""
        number = text.number(cell, decimal)
        if not self.count:
            self.example, self.counts_from = cell, number
        elif self.counts_from is not None and number != self.counts_from + self.count:
            self.counts_from = None
        if number is not None:
            self.has_numbers = True
            self.largest = max(self.largest, abs(number))
        self.count += 1

    @property
    def is_index(self) -> bool:
        """Whether it counts the rows, from 0 or 1."""
        return self.counts_from in (0, 1)


def columns(
    headings: Sequence[str],
    under: Callable[[Sequence[int]], Iterable[Sequence[str]]],
    known: Collection[str],
    decimal: str,
) -> tuple[list[Column], list[str]]:
    """The columns that hold fields, and which are left out, in words; `under` gives the cells at some places, row by
    row.

    Raises NoField.
    """
    found: dict[str, Column] = {}
    left_out: list[str] = []
    meanings = fields_of(headings, known)
    if not any(meant is not None and meant[0] == "recorded_at" for meant in meanings):
        meanings = _dated(headings, meanings)
    present = {meant[0] for meant in meanings if meant is not None}
    others = {place: _Nameless() for place, meant in enumerate(meanings) if meant is None}
    for row in under(list(others)) if others else ():
        for cell, column in zip(row, others.values(), strict=True):
            if cell:
                column.see(cell, decimal)
    for place, (heading, meant) in enumerate(zip(headings, meanings, strict=True)):
        if meant is None and is_phase_alone(heading):
            try:
                meant = PHASE, angle_by_values(heading, others[place].largest)
            except ValueError as error:
                raise NoField(place, str(error)) from None
            left_out.append(f"{heading!r} {READ_AS_DEGREES}")
        if meant is None:
            left_out += _without(place, heading, others[place], known, present)
            continue
        field, factor = meant
        if field in found:
            raise NoField(place, f"{heading!r} is a second column of {field}")
        found[field] = Column(place, field, factor, heading)
    _require_whole(found)
    return list(found.values()), left_out


def fields_of(headings: Sequence[str], known: Collection[str]) -> list[Meaning]:
    """The field of each heading and the factor to its unit; of a phase also by the magnitude beside it."""
    return with_short_phase(headings, [field_of(heading, known) for heading in headings])


def field_of(heading: str, known: Collection[str]) -> Meaning:
    """The field of a heading and the factor to its unit; None where it names none."""
    heading = heading.strip()
    if heading.lower().startswith(FURTHER):
        return FURTHER + heading[len(FURTHER) :], 1.0
    lower = heading.lower()
    if (whole := lower.replace(" ", "_")) in known:
        return whole, 1.0
    return polar_field(heading) or lab_field(heading) or lab_field(lower)


def misspelt(heading: str, fields: Iterable[str]) -> str | None:
    """The field that a heading which names none is nearly the name of."""
    alike = get_close_matches(_plain(heading), list(fields), 1, _ALIKE)
    return alike[0] if alike else None


def halved(headings: Iterable[str]) -> list[str]:
    """That diameters among the headings of fields are halved, in words."""
    return [f"{heading!r} is halved" for heading in headings if _plain(heading).startswith("indenter_diameter")]


def _plain(heading: str) -> str:
    return heading.strip().lower().replace(" ", "_")


def _dated(headings: Sequence[str], meanings: Sequence[Meaning]) -> list[Meaning]:
    """The meanings, those of a date and of the time of day beside it too; without a date, a time is none of the day."""
    dated = [_DATED.get(heading.strip().lower()) for heading in headings]
    if DATE not in dated:
        return list(meanings)
    return [(of, 1.0) if meant is None and of is not None else meant for of, meant in zip(dated, meanings, strict=True)]


def in_small_letters(name: str) -> str:
    """A name whose letters may be capitals, but those of the unit in brackets behind it as they are."""
    bracket = min((place for mark in "[(" if (place := name.find(mark)) >= 0), default=len(name))
    return name[:bracket].lower() + name[bracket:]


def _without(
    place: int, heading: str, column: _Nameless, known: Collection[str], present: Collection[str]
) -> list[str]:
    """That a column which names none of the fields is left out, in words, if it matters; raises NoField where that
    loses something. `present` are the fields of the other columns."""
    if heading.strip().lower() in NO_NAME:
        if column.count and not (place == 0 and column.is_index):
            raise NoField(place, f"has no heading, but cells such as {column.example!r}")
        return []
    none = f"{heading!r} is no field, or its unit is not of the field"
    words = heading.lower().replace("_", " ")
    if "force" in words and _NO_AMPLITUDE.search(words):
        raise NoField(place, f"{none}; dynamic_force_n is the amplitude: half of peak-to-peak, √2 times rms")
    if alike := misspelt(heading, [*known, MAGNITUDE, PHASE, IN_DEGREES]):
        raise NoField(place, f"{none}; did you mean {alike}?")
    keep = f"{FURTHER}NAME keeps a column of anything else"
    if column.has_numbers:
        lacking = _lacking(heading, present)
        raise NoField(
            place,
            f"{none}; is it {' or '.join(lacking)}, which the table lacks? {keep}" if lacking else f"{none}; {keep}",
        )
    if not column.count:
        return []
    return [f"column {heading!r} holds words and is no field: it is left out ({keep})"]


def _lacking(heading: str, present: Collection[str]) -> list[str]:
    """The fields of an FRF that a table has not and that the unit of a heading is one of."""
    labelled = in_brackets(heading)
    if labelled is None or "displacement_mm" in present:
        return []
    phase = phase_in(labelled[1])
    if phase and not {PHASE, PARTS[1]} & {*present}:
        return [phase]
    has = {*present, *([MAGNITUDE] if PARTS[0] in present else [])}
    return [
        field
        for field, name in _NEEDED.items()
        if field not in has and field_of(f"{name} [{labelled[1]}]", ()) is not None
    ]


def _require_whole(found: dict[str, Column]) -> None:
    """That a magnitude has its phase, and that no parts stand beside them."""
    given = [found[name] for name in (MAGNITUDE, PHASE) if name in found]
    if len(given) == 1:
        raise NoField(given[0].place, f"{given[0].heading!r} {lacking(given[0].field)}")
    if given and any(part in found for part in PARTS):
        raise NoField(given[0].place, f"{given[0].heading!r} stands beside real and imaginary parts: leave out either")


_FIRST_LINE = 2000
_TO_SPREADSHEETS = re.compile(r"sep=\S?\s*", re.IGNORECASE)
_SEPARATORS = ("\t", ";", ",")


def separator_of(start: str) -> str | None:
    """The separator of a template that begins so; None where this is none."""
    first = next((line for line in text.lines(start[:_FIRST_LINE]) if not _says_nothing(line)), "")
    return next((mark for mark in _SEPARATORS if _first_cells(first, mark) == ["schema", SCHEMA]), None)


def _first_cells(line: str, separator: str) -> list[str]:
    try:
        return [cell.lower() for cell in text.cells(line, separator)[:2]]
    except ValueError:
        return []


def _says_nothing(line: str) -> bool:
    """Whether a line is blank, a comment, or tells a spreadsheet its separator."""
    bare = line.strip().strip('"')
    return not bare or bare.startswith("#") or _TO_SPREADSHEETS.fullmatch(bare) is not None


def is_note(row: Sequence[str]) -> bool:
    """Whether a row may be a note: it begins with its first cell, and none holds a number."""
    return bool(row[0]) and not any(text.is_grouped(cell) or _is_number(cell) for cell in row)


def note_told(number: int, row: Sequence[str]) -> str:
    """That a note on a line, counted from 1, is left out, in words."""
    return f"line {number} under the table, {', '.join(filter(None, row))!r}, is left out"


def _is_number(cell: str) -> bool:
    return any(text.number(cell, mark) is not None for mark in ".,")


class TemplateLines:
    """The lines, and the cells of each; a line that says nothing has one empty cell."""

    def __init__(self, source: BlockText, separator: str, file: str) -> None:
        self._source = source
        self.separator = separator
        self._file = file

    def __iter__(self) -> Iterator[list[str]]:
        for index, line in enumerate(self._source.lines()):
            yield self.cells(index, line)

    def cells(self, index: int, line: str) -> list[str]:
        """The cells of the line at an index, from 0; raises FileError where its quotes do not close."""
        try:
            cells = text.cells(line, self.separator)
        except ValueError as error:
            if not _says_nothing(line):
                raise FileError(self._file, f"line {index + 1}", str(error)) from None
            cells = [""]
        # An id may begin with #, as numbers of presses do: then numbers follow it.
        counts = any(map(_is_number, cells[1:]))
        return cells if counts or not _says_nothing(line) else [""]

    def holding(self, mark: str) -> Iterator[list[str]]:
        """The cells of the lines that hold a mark."""
        first = 0
        for block in self._source.blocks():
            lines = block.split("\n")
            if mark in block:
                for index, line in enumerate(lines, start=first):
                    if mark in line:
                        yield self.cells(index, line)
            first += len(lines)

    def blocks(self, start: int, end: int | None = None) -> Iterator[tuple[int, list[str]]]:
        """The lines from one index to another, some at a time, with the index of the first of them."""
        first = 0
        for block in self._source.blocks():
            lines = block.split("\n")
            some = lines[max(0, start - first) : None if end is None else max(0, end - first)]
            if some:
                yield max(start, first), some
            first += len(lines)

    def under(self, places: Sequence[int], width: int, start: int, end: int) -> Iterator[list[str]]:
        """The cells at some of `width` places, of each line from one index to another."""
        style = RowStyle(self.separator, ".", (), width, is_template=True)
        for first, lines in self.blocks(start, end):
            rows = PlainRows(lines, style)
            taken = 0
            for line, row, behind in rows.runs():
                yield from self._under(places, first + taken, lines[taken:line])
                columns = [[cell.strip() for cell in rows.texts(place, row, behind)] for place in places]
                yield from map(list, zip(*columns, strict=True))
                taken = line + behind - row
            yield from self._under(places, first + taken, lines[taken:])

    def _under(self, places: Sequence[int], first: int, lines: Sequence[str]) -> Iterator[list[str]]:
        for index, line in enumerate(lines, start=first):
            cells = self.cells(index, line)
            yield [cells[place] if place < len(cells) else "" for place in places]
