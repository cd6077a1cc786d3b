"""Values that a file states about itself, and units, in a campaign field's own."""

from collections.abc import Mapping
from typing import Any

from underskin.errors import FileError, Mention, Requirement
from underskin.recordings.channel_mapping import Property
from underskin.recordings.readers import text
from underskin.recordings.readers.calendar_times import with_zone
from underskin.recordings.readers.unit_labels import field_unit, labelled_unit, unit
from underskin.recordings.time_zone import time_zone
from underskin.units import LAB

Stated = Mapping[str, str | float]
_TEXTS = ("id", "sensor")
_STIFFNESS = "force/length"


def common_value(name: str, value: Any | Property, stated: Stated, file: str) -> Any:
    """A field that the rig says, or that the file says under the rig's name for it, in the field's unit."""
    if not isinstance(value, Property):
        return value
    given = _said(value, stated, file)
    if name == "recorded_at":
        return _in_zone(given)
    number = _number(given)
    if number is None or name in _TEXTS:
        return given
    if name not in LAB:
        return number
    label = labelled_unit(value.property)
    return number * factor(label, name, file, f"property {value.property!r}") if label else number


def _in_zone(given: str | float) -> str | float:
    """A time that an instrument wrote, in the lab's zone where it states none; what is no time as it is, to be
    refused."""
    try:
        return with_zone(str(given), time_zone())
    except ValueError:
        return given


def spring_constant(value: float | Property, stated: Stated, file: str) -> float:
    """A spring constant [N/m] that the rig says, or that the file says, in N/m where no other unit is in its name."""
    if not isinstance(value, Property):
        return value
    place, given = f"property {value.property!r}", _said(value, stated, file)
    number = _number(given)
    if number is None or not 0 < number < float("inf"):
        raise FileError(file, place, f"is {given!r}: must be a number greater than 0, a spring constant")
    label = labelled_unit(value.property)
    known = unit(label or "N/m")
    if known is None or known.dimension != _STIFFNESS:
        raise FileError(file, place, f"its unit {label!r} is not one of {_STIFFNESS}, such as N/m")
    return number * known.to_si


def _number(given: str | float) -> float | None:
    """As a file writes it, with a point or a comma; None where a comma may part thousands."""
    return text.number(given, text.decimal_mark(lambda _: [[given]], "\t")) if isinstance(given, str) else given


def _said(value: Property, stated: Stated, file: str) -> str | float:
    if value.property not in stated:
        known = ", ".join(list(stated)[:20])
        raise FileError(file, f"property {value.property!r}", f"is not in the file, which states {known}")
    return stated[value.property]


def factor(label: str, field: str, file: str, place: str, hint: str = "") -> float:
    """From a unit to the field's; `hint` goes into the error."""
    known, wanted = unit(label), field_unit(field)
    if known is None or known.dimension != wanted.dimension:
        what = "is not known here" if known is None else f"is one of {known.dimension}"
        needs = f" needs one of {wanted.dimension}, such as {LAB[field].unit}{hint}"
        raise FileError(file, place, Requirement(f"its unit {label!r} {what}; ", Mention(field), needs))
    return known.to_si / LAB[field].to_si
