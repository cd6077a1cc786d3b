"""Units as instruments label them: `[mV]`, `Load (N)`, `height_m`, `m/s^2`."""

import re
from dataclasses import dataclass

from underskin.recordings.shown_values import LONGEST_NAME
from underskin.units import LAB

_PREFIXES = {"": 1.0, "p": 1e-12, "n": 1e-9, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "m": 1e-3, "k": 1e3, "M": 1e6, "G": 1e9}
_BASES = {
    "m": "length",
    "N": "force",
    "Pa": "pressure",
    "C": "charge",
    "s": "time",
    "Hz": "frequency",
    "V": "voltage",
    "A": "current",
}
_LONGEST = 40
_STANDARD_GRAVITY = 9.80665
_WHOLE = {
    "cm": ("length", 1e-2),
    "m/s^2": ("acceleration", 1.0),
    "m/s2": ("acceleration", 1.0),
    "m/s²": ("acceleration", 1.0),
    "g": ("acceleration", _STANDARD_GRAVITY),
    "gf": ("force", 1e-3 * _STANDARD_GRAVITY),
    "kgf": ("force", _STANDARD_GRAVITY),
    "lbf": ("force", 4.4482216152605),
    "in": ("length", 25.4e-3),
    "inch": ("length", 25.4e-3),
    "sec": ("time", 1.0),
    "min": ("time", 60.0),
}
_DIAMETER, _RADIUS = "indenter_diameter", "indenter_radius"
_BEHIND = re.compile(r"(?P<name>.*[^\s,])(\s*/\s*|\s+in\s+|\s*,\s*)(?P<unit>[^\s/,]+(/[^\s/,]+)?)\s*")
_IN_BRACKETS = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\[\]()]*)[\])]\s*$")


@dataclass(frozen=True)
class Unit:
    """What a unit measures (`force`, `charge/force`) and its factor to SI."""

    dimension: str
    to_si: float


def unit(label: str) -> Unit | None:
    """The unit that a label means, or None where it is none that is known here."""
    label = label.strip()
    if len(label) > _LONGEST:
        return None
    if label in _WHOLE:
        return Unit(*_WHOLE[label])
    for base, dimension in _BASES.items():
        prefix = label.removesuffix(base)
        if prefix != label and prefix in _PREFIXES:
            return Unit(dimension, _PREFIXES[prefix])
    above, slash, below = label.rpartition("/")
    if not slash:
        return None
    numerator, denominator = unit(above), unit(below)
    if numerator is None or denominator is None:
        return None
    return Unit(f"{numerator.dimension}/{denominator.dimension}", numerator.to_si / denominator.to_si)


def field_unit(field: str) -> Unit:
    """The unit that a campaign field is kept in."""
    known = unit(LAB[field].unit)
    assert known is not None
    return known


def labelled_unit(heading: str) -> str:
    """The unit in a column's heading, or none (empty): in brackets at its end; or, where it is a known one, behind its
    last underscore, a stroke, a comma or "in" (Kraft / mN)."""
    if heading in LAB:
        return LAB[heading].unit
    bracketed = _IN_BRACKETS.match(heading[-LONGEST_NAME:])
    if bracketed:
        return bracketed["unit"].strip()
    _, underscore, last = heading.rpartition("_")
    if underscore and unit(last) is not None:
        return last
    behind = _BEHIND.fullmatch(heading[-LONGEST_NAME:])
    if behind is None or unit(behind["unit"]) is None:
        return ""
    whole = heading.split()[-1]  # FRF pC/N is not in N
    return "" if "/" in whole and unit(whole) is not None else behind["unit"]


def in_brackets(heading: str) -> tuple[str, str] | None:
    """The name and the unit in brackets behind it; None where there is none."""
    bracketed = _IN_BRACKETS.match(heading[-LONGEST_NAME:])
    return None if bracketed is None else (bracketed["name"].strip(), bracketed["unit"].strip())


def lab_field(heading: str) -> tuple[str, float] | None:
    """The campaign field of a heading and the factor to its unit: `preload [mN]` is `preload_n`, 0.001, and
    `indenter_diameter_mm` is `indenter_radius_mm`, 0.5.

    None where the heading names no field that has a unit, or a unit of another dimension.
    """
    if heading.lower().replace(" ", "_").startswith(_DIAMETER):
        radius = lab_field(_RADIUS + heading[len(_DIAMETER) :])
        return None if radius is None else (radius[0], 0.5 * radius[1])
    bracketed = in_brackets(heading)
    if bracketed is None:
        return (heading, 1.0) if heading in LAB else None
    given = unit(bracketed[1])
    stem = bracketed[0].lower().replace(" ", "_")
    for name in LAB:
        known = field_unit(name) if name.startswith(f"{stem}_") and given else None
        if known and given and known.dimension == given.dimension and stem == _stem(name):
            return name, given.to_si / LAB[name].to_si
    return None


def _stem(field: str) -> str:
    suffix = LAB[field].unit.lower().replace("/", "_per_")
    return field.removesuffix(f"_{suffix}")
