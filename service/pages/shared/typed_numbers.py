"""Numbers that somebody typed into a form."""

import re

from underskin.errors import wrong_type
from underskin.recordings.readers import text

_BETWEEN = re.compile(r"[;\s]+|,(?:\s+|$)")  # numbers in a line: a comma without a space may be a decimal one


def number(name: str, typed: str) -> float:
    """A number that somebody typed; raises InvalidInput."""
    try:
        return float(typed)
    except ValueError:
        raise wrong_type(name, typed[:80]) from None


def numbers(name: str, line: str) -> list[float]:
    """The numbers of a line that somebody typed, with decimal points or with decimal commas; raises InvalidInput.

    Between them are spaces, tabs, semicolons, or commas and a space: `7,06` is one number.
    """
    typed = [cell for cell in _BETWEEN.split(line) if cell]
    decimal = "," if any("," in cell for cell in typed) else "."
    values = [text.number(cell, decimal) for cell in typed]
    if decimal == "," and None in values:
        allowed = "must be numbers with spaces between them, with decimal points or with decimal commas, not both"
        raise wrong_type(name, line[:80], allowed)
    return [number(name, cell) if value is None else value for cell, value in zip(typed, values, strict=True)]
