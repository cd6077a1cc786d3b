"""Values and names as an error may show them."""

import math
from typing import Any, Self

import numpy as np

LONGEST_NAME = 200  # characters


class CellText(str):
    """A cell of a text that is not what its field needs, and its `place`, such as "line 3, column 2"."""

    place: str

    def __new__(cls, cell: str, place: str) -> Self:
        """Of a cell at a place."""
        made = super().__new__(cls, cell)
        made.place = place
        return made


def shown(value: Any) -> Any:
    """A value as an error may show it: short, and plain JSON."""
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int | float | np.integer | np.floating):
        return _shown_number(value)
    if isinstance(value, str):
        short = value if len(value) <= LONGEST_NAME else value[:LONGEST_NAME] + "…"
        return short.encode("utf-8", "replace").decode("utf-8")
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
