"""Errors of a form in its own words: the labels that the reader sees, not the fields of the request behind them."""

import re
from collections.abc import Mapping, Sequence

from underskin import InvalidInput, UnderskinError
from underskin.units import CONFIRM_UNITS

_CONTACT = re.compile(r"contacts\[(\d+)\](?:\.(\w+))?(?:\[(\d)\])?")
_OF_LOAD = {"x_mm": "x", "y_mm": "y", "indenter_radius_mm": "R", "normal_force_n": "F"}
_TANGENTIAL = ("Fx", "Fy")
_EVERYDAY = ("rows", "columns")  # names that mean what they say, within a sentence


def said(error: UnderskinError, labels: Mapping[str, str], lines: Sequence[int] = (), unlikely: str = "") -> str:
    """An error; `labels`: of fields as the form has them, `lines`: of the loads in its text, from 1; `unlikely`: how
    the form takes an unlikely magnitude, where it does."""
    if not isinstance(error, InvalidInput):
        return str(error)
    names = {name: label for name, label in labels.items() if name not in _EVERYDAY}
    allowed = _in_words(error.allowed.replace(CONFIRM_UNITS, f" ({unlikely})" if unlikely else ""), names, lines)
    field = _in_words(error.field, labels, lines)
    came = "" if error.value is None else f": {error.value}"
    return f"{field}{came} – {allowed}"


def _in_words(text: str, labels: Mapping[str, str], lines: Sequence[int]) -> str:
    text = _CONTACT.sub(lambda found: _load(found, lines), text)
    return re.sub(r"\b\w+\b", lambda found: labels.get(found[0], found[0]), text)


def _load(found: re.Match[str], lines: Sequence[int]) -> str:
    """`contacts[0].normal_force_n` as `load in line 1, F`."""
    number, field, part = int(found[1]), found[2], found[3]
    place = f"load in line {lines[number] if number < len(lines) else number + 1}"
    if field is None:
        return place
    name = _TANGENTIAL[int(part)] if field == "tangential_force_n" and part is not None else _OF_LOAD.get(field, field)
    return f"{place}, {name}"
