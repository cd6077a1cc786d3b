"""Checks of single fields of documents, and values as error messages may show them.

A check takes the field's name and value and returns the value of the model, or raises InvalidInput that names the
field, the value and what is allowed. A model names the check of each field in its annotation, by one of the types at
the end.
"""

import math
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import MISSING, fields
from datetime import datetime
from functools import cache
from itertools import islice
from typing import Annotated, Any, Self, TypeVar, get_args, get_origin, get_type_hints

import numpy as np

from underskin import errors
from underskin.errors import ErrorCode, InvalidInput
from underskin.physics.charge_response import INCOMPRESSIBLE
from underskin.units import Floats, checked

LONGEST_NAME = 200  # characters


class CellText(str):
    """The text of an invalid cell, and its `place`, such as "line 3, column 2"."""

    place: str

    def __new__(cls, cell: str, place: str) -> Self:
        """The text of `cell` at `place`."""
        instance = super().__new__(cls, cell)
        instance.place = place
        return instance


def shown(value: Any) -> Any:
    """A value as an error may show it: short, and plain JSON."""
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int | float | np.integer | np.floating):
        return _shown_number(value)
    if isinstance(value, str):
        shortened = value if len(value) <= LONGEST_NAME else value[:LONGEST_NAME] + "…"
        return shortened.encode("utf-8", "replace").decode("utf-8")
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    return f"a value of type {type(value).__name__}"


def named(name: Any) -> str:
    """A field's name as an error may show it, an empty one too."""
    return str(shown(name)) or '""'


def _shown_number(value: Any) -> Any:
    try:
        as_float = float(value)
    except OverflowError:
        return "a whole number beyond the range of floats"
    if not math.isfinite(as_float):
        return str(as_float)
    return int(value) if as_float.is_integer() and abs(as_float) < 2**53 else as_float


BuiltModel = TypeVar("BuiltModel")
Check = Callable[[str, Any, bool], Any]  # name, value, units_checked

LARGEST_COUNT = 2**53
FREQUENCIES_HZ = (1e-6, 1e9)
_MOST_UNKNOWN = 20  # unknown fields of one object that are listed; a document may hold millions
COHERENCE_ROUNDING = 1e-6  # single-precision instruments write 1.0000001


def check_fields(
    model: Any, document: Mapping[str, Any], *, units_checked: bool
) -> tuple[dict[str, Any], list[InvalidInput]]:
    """The checked values of a document's fields, by the annotated check of each in `model`, and all errors.

    `model` is a dataclass; a field with a default may be absent or null.
    """
    checks = checks_of(model)
    refused = _unknown_fields(document, checks, f"unknown field; known: {', '.join(checks)}")
    values: dict[str, Any] = {}
    for name, (field_check, default) in checks.items():
        value = document.get(name)
        try:
            if value is None and default is MISSING:
                raise errors.required(name)
            values[name] = default if value is None else field_check(name, value, units_checked)
        except InvalidInput as refusal:
            refused.append(refusal)
    return values, refused


def _unknown_fields(document: Mapping[str, Any], field_names: Collection[str], allowed: str) -> list[InvalidInput]:
    unknown = islice((name for name in document if name not in field_names), _MOST_UNKNOWN)
    code = ErrorCode.UNKNOWN_FIELD
    return [InvalidInput(named(name), shown(document[name]), allowed, code=code) for name in unknown]


def of_schema(noun: str, value: Any, schema: str, field_names: Collection[str]) -> Mapping[str, Any]:
    """A JSON object of this `schema` without unknown fields; `noun` names it in errors."""
    document = mapping(noun, value)
    if unknown := _unknown_fields(document, field_names, f"unknown field of a {noun}"):
        raise unknown[0]
    given = shown(document.get("schema"))
    if given != schema:
        raise errors.not_one_of("schema", given, (schema,))
    return document


_NUMBERED = re.compile(r"(.*?)(\d{1,9})")


def counted_alike(sensors: Sequence[str], recordings: Sequence[Any]) -> None:
    """Raises InvalidInput where the sensors of the recordings' documents are counted from 0 and the skin's from 1, or
    the other way round: then all but one are found, and each recording would be taken for one of a neighbour's."""
    named = [entry.get("sensor") if isinstance(entry, Mapping) else None for entry in recordings]
    ids, used = ({part for one in which if (part := _counted(one))} for which in (sensors, named))
    for step, begins in ((1, used - ids), (-1, ids - used)):
        moved = {(prefix, count + step) for prefix, count in used}
        if moved <= ids and not used <= ids and any(count == 0 for _, count in begins):
            index = next(index for index, name in enumerate(named) if _counted(name) in used - ids)
            numbers = [[count for _, count in part] for part in (used, ids)]
            (first, last), (least, most) = ((min(part), max(part)) for part in numbers)
            reason = f"the recordings' sensors are numbered {first} to {last}, the skin's {least} to {most}: was one of"
            doubt = "them counted from 0? Then each recording would be taken for a neighbour's: number both alike"
            allowed = f"must be the id of one of the skin's sensors; {reason} {doubt}"
            raise InvalidInput(f"recordings[{index}].sensor", named[index], allowed, code=ErrorCode.NOT_ONE_OF)


def _counted(name: Any) -> tuple[str, int] | None:
    """The words and the number of a name such as s01; None of others."""
    parts = _NUMBERED.fullmatch(name) if isinstance(name, str) else None
    return None if parts is None else (parts[1], int(parts[2]))


def mapping(field: str, value: Any) -> Mapping[str, Any]:
    """A JSON object."""
    if not isinstance(value, Mapping):
        raise _wrong_type(field, value, "must be an object with named fields")
    return value


def build(model: type[BuiltModel], prefix: str, document: Any, units_checked: bool) -> BuiltModel:
    """A model of a document; raises InvalidInput for the first invalid field, its name preceded by `prefix`."""
    values, refused = check_fields(model, mapping(prefix, document), units_checked=units_checked)
    if refused:
        raise refused[0].at(f"{prefix}.{refused[0].field}")
    return model(**values)


@cache
def checks_of(model: Any) -> dict[str, tuple[Check, Any]]:
    """Each field's check and default."""
    hints = get_type_hints(model, include_extras=True)
    return {field.name: (_annotated_check(hints[field.name]), field.default) for field in fields(model)}


def _annotated_check(hint: Any) -> Check:
    parts = [hint, *get_args(hint)]
    return next(part.__metadata__[0] for part in parts if get_origin(part) is Annotated)


def name(field: str, value: Any, units_checked: bool) -> str:  # noqa: ARG001
    """A short printable text, such as an id."""
    if not isinstance(value, str) or not value.strip() or len(value) > LONGEST_NAME or not value.isprintable():
        raise _wrong_type(field, value, f"must be a printable text of 1 to {LONGEST_NAME} characters")
    return value


def flag(field: str, value: Any, units_checked: bool) -> bool:  # noqa: ARG001
    """true or false."""
    if not isinstance(value, bool):
        raise _wrong_type(field, value, "must be true or false")
    return value


def number(field: str, value: Any, units_checked: bool = False) -> float:  # noqa: ARG001
    """A finite number."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | np.integer | np.floating):
        raise _wrong_type(field, value, "must be a number")
    try:
        result = float(value)
    except OverflowError:
        result = math.inf
    if not math.isfinite(result):
        raise errors.not_finite(field, shown(result))
    return result


def positive(field: str, value: Any, units_checked: bool) -> float:  # noqa: ARG001
    """A measured or chosen quantity greater than 0, of any magnitude."""
    result = number(field, value)
    if result <= 0:
        raise errors.out_of_range(field, result, "must be greater than 0")
    return result


def not_negative(field: str, value: Any, units_checked: bool) -> float:  # noqa: ARG001
    """A number that is 0 or greater."""
    result = number(field, value)
    if result < 0:
        raise errors.out_of_range(field, result, "must be 0 or greater")
    return result


def declared(field: str, value: Any, units_checked: bool) -> float:
    """A declared geometry, modulus, preload or d33 in lab units; an unlikely magnitude is rejected with a guess."""
    result = number(field, value)
    checked(field, result, units_checked=units_checked)
    return result


def poisson_ratio(field: str, value: Any, units_checked: bool) -> float:  # noqa: ARG001
    """0 to 0.5."""
    result = number(field, value)
    if not 0 <= result <= INCOMPRESSIBLE:
        raise errors.out_of_range(field, result, f"must be 0 to {INCOMPRESSIBLE}")
    return result


def count(field: str, value: Any, units_checked: bool) -> int:  # noqa: ARG001
    """A whole number, 0 to 2⁵³, the range in which floats, and so JSON, are exact."""
    result = number(field, value)
    if result < 0 or not result.is_integer() or int(value) > LARGEST_COUNT:
        raise _wrong_type(field, value, f"must be a whole number, 0 to {LARGEST_COUNT}")
    return int(value)


def time_of_day(field: str, value: Any, units_checked: bool) -> str:
    """Date and time in ISO 8601, unchanged."""
    text = name(field, value, units_checked)
    try:
        datetime.fromisoformat(text)
    except ValueError:
        raise errors.wrong_type(field, text, "must be a date and time like 2017-05-03T09:00:00Z") from None
    return text


def position(field: str, value: Any, units_checked: bool) -> tuple[float, float]:
    """x and y."""
    x, y = _pair(field, value)
    return number(f"{field}[0]", x, units_checked), number(f"{field}[1]", y, units_checked)


def _pair(field: str, value: Any) -> tuple[Any, Any]:
    if not isinstance(value, list | tuple | np.ndarray) or len(value) != 2:
        raise _wrong_type(field, value, "must be two numbers, x and y")
    return value[0], value[1]


def series(field: str, value: Any, units_checked: bool) -> Floats:  # noqa: ARG001
    """A column of at least one finite number."""
    column = _column(field, value)
    if column.size == 0:
        raise errors.too_few(field, shown(value), "must hold at least one number")
    _refuse_where(field, column, ~np.isfinite(column), "must be finite", ErrorCode.NOT_FINITE)
    return column


def increasing(field: str, value: Any, units_checked: bool) -> Floats:
    """A column of finite numbers, each greater than the one before."""
    column = series(field, value, units_checked)
    falls = np.diff(column, prepend=-math.inf) <= 0
    _refuse_where(field, column, falls, "must be greater than the entry before", ErrorCode.NOT_INCREASING)
    return column


def rows(field: str, value: Any, units_checked: bool) -> Floats:
    """Rows of finite numbers, equally many in each: (rows, columns)."""
    if not isinstance(value, list | tuple) or not value:
        raise _wrong_type(field, value, "must be a list of rows of numbers")
    columns = [series(f"{field}[{index}]", row, units_checked) for index, row in enumerate(value)]
    for index, row in enumerate(columns):
        if row.size != columns[0].size:
            allowed = f"must have as many as row 0 ({columns[0].size})"
            raise InvalidInput(field, f"{row.size} columns", allowed, index, code=ErrorCode.UNEQUAL_LENGTHS)
    return np.stack(columns)


def frequencies(field: str, value: Any, units_checked: bool) -> Floats:
    """An increasing column of frequencies above 0, from far below to far above what any instrument records."""
    column = increasing(field, value, units_checked)
    low, high = FREQUENCIES_HZ
    for bad, allowed in (
        (column <= 0, "must be greater than 0 (leave out the line at 0 Hz)"),
        ((column < low) | (column > high), f"must be {low:g} to {high:g} Hz"),
    ):
        _refuse_where(field, column, bad, allowed, ErrorCode.OUT_OF_RANGE)
    return column


def not_falling(field: str, value: Any, units_checked: bool) -> Floats:
    """A column of times that do not decrease."""
    column = series(field, value, units_checked)
    falls = np.diff(column, prepend=-math.inf) < 0
    _refuse_where(field, column, falls, "must not be before the entry above it", ErrorCode.NOT_INCREASING)
    return column


_PERCENT = 100.0


def coherence(field: str, value: Any, units_checked: bool) -> Floats:
    """A column of coherences γ², 0 to 1."""
    column = series(field, value, units_checked)
    bad = (column < 0) | (column > 1 + COHERENCE_ROUNDING)
    in_percent = bad.any() and column.min() >= 0 and column.max() <= _PERCENT * (1 + COHERENCE_ROUNDING)
    allowed = "must be 0 to 1; was it given in %?" if in_percent else "must be 0 to 1"
    _refuse_where(field, column, bad, allowed, ErrorCode.OUT_OF_RANGE)
    return column


def _column(field: str, value: Any) -> Floats:
    if isinstance(value, np.ndarray):
        if value.ndim != 1 or value.dtype.kind not in "iuf":
            raise _wrong_type(field, value, "must be a list of numbers")
        return value.astype(np.float64)
    if not isinstance(value, list | tuple):
        raise _wrong_type(field, value, "must be a list of numbers")
    for index, item in enumerate(value):
        if type(item) is not float and type(item) is not int:
            raise _wrong_type(field, item, "must be a number", index)
    try:
        return np.array(value, dtype=np.float64)
    except OverflowError:
        raise errors.out_of_range(field, shown(value), "holds a number too large to keep") from None


def _refuse_where(field: str, column: Floats, bad: Any, allowed: str, code: ErrorCode) -> None:
    if bad.any():
        first = int(np.argmax(bad))
        raise InvalidInput(field, shown(float(column[first])), allowed, index=first, code=code)


def _wrong_type(field: str, value: Any, allowed: str, index: int | None = None) -> InvalidInput:
    place = f" ({value.place})" if isinstance(value, CellText) else ""
    return errors.wrong_type(field, shown(value), f"{allowed}{place}", index=index)


Name = Annotated[str, name]
Number = Annotated[float, number]
Positive = Annotated[float, positive]
NotNegative = Annotated[float, not_negative]
Declared = Annotated[float, declared]
PoissonRatio = Annotated[float, poisson_ratio]
Count = Annotated[int, count]
Flag = Annotated[bool, flag]
TimeOfDay = Annotated[str, time_of_day]
Position = Annotated[tuple[float, float], position]
Series = Annotated[Floats, series]
Increasing = Annotated[Floats, increasing]
Rows = Annotated[Floats, rows]
Frequencies = Annotated[Floats, frequencies]
Times = Annotated[Floats, not_falling]
Coherence = Annotated[Floats, coherence]


CONDITION = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")
MOST_CONDITIONS = 100


def further(field: str, value: Any, units_checked: bool) -> dict[str, float | str]:
    """A lab's own columns by name: numbers or short words; null values are dropped."""
    document = mapping(field, value)
    noted: dict[str, float | str] = {}
    if len(document) > MOST_CONDITIONS:
        raise errors.out_of_range(field, len(document), f"must be at most {MOST_CONDITIONS} columns")
    for key, item in document.items():
        place = f"{field}.{named(key)}"
        if not isinstance(key, str) or not CONDITION.fullmatch(key):
            raise InvalidInput(place, shown(key), "must be a name of letters, digits and underscores")
        if isinstance(item, str):
            noted[key] = name(place, item, units_checked)
        elif item is not None:
            noted[key] = number(place, item)
    return noted
