"""The columns of the CSV template: which field each heading means, and what is no field.

Headings are read in capitals or not. `indenter_diameter_mm` is halved, a magnitude with a phase is a complex value, a
date and a time of day are `recorded_at`. A column without a heading that only counts its rows, as spreadsheets write
it, or is empty, and a column of words that names no field, are left out.
"""

import re
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

from underskin.recordings.readers import polar_columns, text
from underskin.recordings.readers.polar_columns import IN_DEGREES, MAGNITUDE, PARTS, PHASE, Meaning
from underskin.recordings.readers.unit_labels import in_brackets, lab_field

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
        if meant is None and polar_columns.is_phase_alone(heading):
            try:
                meant = PHASE, polar_columns.angle_by_values(heading, others[place].largest)
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
    return polar_columns.with_short_phase(headings, [field_of(heading, known) for heading in headings])


def field_of(heading: str, known: Collection[str]) -> Meaning:
    """The field of a heading and the factor to its unit; None where it names none."""
    heading = heading.strip()
    if heading.lower().startswith(FURTHER):
        return FURTHER + heading[len(FURTHER) :], 1.0
    lower = heading.lower()
    if (whole := lower.replace(" ", "_")) in known:
        return whole, 1.0
    return polar_columns.field_of(heading) or lab_field(heading) or lab_field(lower)


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
    phase = polar_columns.phase_in(labelled[1])
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
        raise NoField(given[0].place, f"{given[0].heading!r} {polar_columns.lacking(given[0].field)}")
    if given and any(part in found for part in PARTS):
        raise NoField(given[0].place, f"{given[0].heading!r} stands beside real and imaginary parts: leave out either")
