"""Numbers in sentences as pages and figures set them: a minus sign for a hyphen, small forces and lengths in a unit in
which they read well. Stored findings and reports stay as they are."""

import re

from underskin.units import readable_unit

_MINUS = re.compile(r"(?<![\w.−-])-(?=\d)")
_NUMBER = r"[+−-]?\d+(?:\.\d+)?(?:e-\d+)?"
_MEASURED = re.compile(rf"(?<![\w.])({_NUMBER}) (N|mm)\b(?: \(({_NUMBER}) to ({_NUMBER})\))?")
FIELD_OF = {"N": "force_n", "mm": "displacement_mm"}  # a field of each unit that has smaller ones


def with_minus(text: str) -> str:
    """A text with the sign of its negative numbers as a minus; names and dates keep their hyphens."""
    return _MINUS.sub("−", text)


def in_readable_units(sentence: str) -> str:
    """A sentence with each force and length in the unit in which it reads well, as figures have it, and minus signs."""
    return with_minus(_MEASURED.sub(_readable, sentence))


def without_powers(sentence: str) -> str:
    """A sentence with those forces and lengths in such a unit that are written as a power of ten, and the interval
    behind each."""
    return _MEASURED.sub(lambda found: _readable(found) if "e-" in found[1] else found[0], sentence)


def _readable(found: re.Match[str]) -> str:
    unit, count = readable_unit(FIELD_OF[found[2]], abs(_value(found[1])))
    if count == 1:
        return found[0]
    value, *ends = (_scaled(text, count) for text in found.group(1, 3, 4) if text is not None)
    return f"{value} {unit}" + (f" ({ends[0]} to {ends[1]})" if ends else "")


def _value(text: str) -> float:
    return float(text.replace("−", "-"))


def _scaled(text: str, count: float) -> str:
    return f"{count * _value(text):{'+' if text.startswith('+') else ''}.4g}"
