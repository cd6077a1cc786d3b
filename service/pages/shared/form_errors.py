"""Errors of a form in its own words: the labels that the reader sees, not the fields of the request behind them."""

import re
from collections.abc import Mapping, Sequence

from underskin import InvalidInput, UnderskinError
from underskin.errors import UNITS_CHECKED, Mention, Requirement

_LOAD_PATH = re.compile(r"contacts\[(\d+)\](?:\.(\w+))?(?:\[(\d)\])?")  # of `POST /v1/stress`
_OF_LOAD = {"x_mm": "x", "y_mm": "y", "indenter_radius_mm": "R", "normal_force_n": "F"}
_TANGENTIAL = ("Fx", "Fy")


def in_form_words(
    error: UnderskinError, labels: Mapping[str, str], lines: Sequence[int] = (), unlikely: str = ""
) -> str:
    """An error; `labels`: of fields as the form has them, `lines`: of the loads in its text, from 1; `unlikely`: how
    the form takes an unlikely magnitude, where it does."""
    if not isinstance(error, InvalidInput):
        return str(error)

    def word(mention: Mention) -> str:
        if mention == UNITS_CHECKED:
            return f" ({unlikely})" if unlikely else ""
        return _label(mention.field, labels, lines)

    allowed = error.allowed.worded(word) if isinstance(error.allowed, Requirement) else error.allowed
    value = "" if error.value is None else f": {error.value}"
    return f"{_label(error.field, labels, lines)}{value} – {allowed}"


def _label(field: str, labels: Mapping[str, str], lines: Sequence[int]) -> str:
    """A field as the form calls it; of a path its known parts."""
    load = _LOAD_PATH.fullmatch(field)
    return _load(load, lines) if load else ".".join(labels.get(part, part) for part in field.split("."))


def _load(path: re.Match[str], lines: Sequence[int]) -> str:
    """`contacts[0].normal_force_n` as `load in line 1, F`."""
    number, field, part = int(path[1]), path[2], path[3]
    place = f"load in line {lines[number] if number < len(lines) else number + 1}"
    if field is None:
        return place
    name = _TANGENTIAL[int(part)] if field == "tangential_force_n" and part is not None else _OF_LOAD.get(field, field)
    return f"{place}, {name}"
