"""Checks of an experiment's description: each returns the value or raises RigError with field, value and allowed
values."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from rig.errors import RigError

_UNITS = {
    "_pc_per_n": "pC/N", "_n_per_mm": "N/mm", "_n_per_root_s": "N/√s", "_mm_per_s": "mm/s", "_j_per_m2": "J/m²",
    "_per_mpa": "1/MPa", "_mm": "mm", "_mpa": "MPa", "_n": "N", "_pc": "pC", "_hz": "Hz", "_s": "s", "_us": "µs",
    "_g": "g", "_h": "h",
}  # fmt: skip


def in_unit(field: str) -> str:
    """The unit at the end of a field's name, after a space; empty if it has none."""
    name = field.split("[")[0].rsplit(".", 1)[-1]
    return next((f" {unit}" for ending, unit in _UNITS.items() if f"_{name}".endswith(ending)), "")


def mapping(field: str, value: Any, allowed: Sequence[str]) -> Mapping[str, Any]:
    """A mapping whose names are all known."""
    if not isinstance(value, Mapping):
        raise RigError(field, value, "must be a mapping of names to values")
    for name in value:
        if name not in allowed:
            raise RigError(f"{field}.{name}", value[name], f"unknown; known: {', '.join(allowed)}")
    return value


def number(field: str, value: Any, low: float, high: float) -> float:
    """A finite number from low to high, limits included."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise RigError(field, value, f"must be a number, {low:g} to {high:g}{in_unit(field)}")
    if not (math.isfinite(value) and low <= value <= high):
        raise RigError(field, value, f"must be {low:g} to {high:g}{in_unit(field)}")
    return float(value)


def integer(field: str, value: Any, low: int, high: int) -> int:
    """A whole number from low to high."""
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise RigError(field, value, f"must be a whole number, {low} to {high}")
    return value


def numbers(field: str, value: Any, low: float, high: float) -> tuple[float, ...]:
    """A list of at least one number; a single number counts as a list of one."""
    entries = value if isinstance(value, list | tuple) else [value]
    if not entries:
        raise RigError(field, value, "must hold at least one number")
    return tuple(number(f"{field}[{index}]", element, low, high) for index, element in enumerate(entries))


def pair(field: str, value: Any, low: float, high: float) -> tuple[float, float]:
    """Two numbers, x and y."""
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise RigError(field, value, "must be two numbers, x and y")
    return number(f"{field}[0]", value[0], low, high), number(f"{field}[1]", value[1], low, high)


def text(field: str, value: Any) -> str:
    """A text of 1 to 200 printable characters."""
    if not isinstance(value, str) or not 0 < len(value) <= 200 or not value.isprintable():
        raise RigError(field, value, "must be a printable text of 1 to 200 characters")
    return value


def choice(field: str, value: Any, allowed: Sequence[str]) -> str:
    """One of the texts."""
    if value not in allowed:
        raise RigError(field, value, f"must be one of {', '.join(allowed)}")
    return str(value)


def flag(field: str, value: Any) -> bool:
    """true or false."""
    if not isinstance(value, bool):
        raise RigError(field, value, "must be true or false")
    return value
