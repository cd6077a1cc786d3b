"""An FRF in columns of its magnitude and its phase, which stand for its real and imaginary part."""

import cmath
import math
from collections.abc import Sequence
from typing import Any

from underskin.recordings.readers.unit_labels import in_brackets, unit

MAGNITUDE, PHASE = "frf_magnitude_pc_per_n", "frf_phase_rad"
IN_DEGREES = "frf_phase_deg"
PARTS = ("frf_re_pc_per_n", "frf_im_pc_per_n")
_NAME, _SHORT_NAME = "frf_phase", "phase"  # the second only beside a magnitude
_ANGLES = {"rad": 1.0, "deg": math.pi / 180, "°": math.pi / 180}
_TURN = 2 * math.pi
_EITHER = f"{IN_DEGREES} or {PHASE}"
Meaning = tuple[str, float] | None  # a field, and the factor to its unit


def field_of(heading: str) -> Meaning:
    """Magnitude or phase, and the factor to its unit, where a heading names one with its unit."""
    name, label = _name_and_unit(heading)
    if name == _NAME and label in _ANGLES:
        return PHASE, _ANGLES[label]
    if heading.lower().replace(" ", "_") == MAGNITUDE:
        return MAGNITUDE, 1.0
    given = unit(label)
    if name == "frf_magnitude" and given is not None and given.dimension == "charge/force":
        return MAGNITUDE, given.to_si / 1e-12
    return None


def with_short_phase(headings: Sequence[str], meanings: Sequence[Meaning]) -> list[Meaning]:
    """The meanings; beside a magnitude without its phase, a heading such as `Phase [deg]` is that."""
    fields = {meant[0] for meant in meanings if meant is not None}
    if MAGNITUDE not in fields or PHASE in fields:
        return list(meanings)
    found: list[Meaning] = []
    for heading, meant in zip(headings, meanings, strict=True):
        name, label = _name_and_unit(heading)
        is_phase = meant is None and name == _SHORT_NAME and label in _ANGLES
        found.append((PHASE, _ANGLES[label]) if is_phase else meant)
    return found


def phase_in(label: str) -> str:
    """The heading of a phase in a unit; empty where that is no angle."""
    return "" if label not in _ANGLES else PHASE if label == "rad" else IN_DEGREES


def is_phase_alone(heading: str) -> bool:
    """Whether a heading is a phase without its unit."""
    return heading.strip().lower().replace(" ", "_") == _NAME


def angle_by_values(heading: str, largest: float) -> float:
    """The factor to rad of a phase without a unit, by the largest of its values; raises ValueError where they may be
    either."""
    if largest > _TURN:
        return _ANGLES["deg"]
    raise ValueError(f"{heading!r} has no unit, and its values may be degrees or radians: call it {_EITHER}")


def lacking(field: str) -> str:
    """What must stand beside magnitude or phase, in words."""
    return f"needs {_EITHER if field == MAGNITUDE else MAGNITUDE} beside it"


def with_parts(line: dict[str, Any]) -> dict[str, Any]:
    """The values of a row, real and imaginary part in place of magnitude and phase."""
    if MAGNITUDE not in line:
        return line
    others = {field: value for field, value in line.items() if field not in (MAGNITUDE, PHASE)}
    magnitude, phase = line[MAGNITUDE], line[PHASE]
    if magnitude is None and phase is None:
        return {**others, **dict.fromkeys(PARTS)}
    if not isinstance(magnitude, float) or not isinstance(phase, float):
        return {**others, PARTS[0]: magnitude, PARTS[1]: phase}  # for the campaign's checks to refuse
    value = cmath.rect(magnitude, phase)
    return {**others, PARTS[0]: value.real, PARTS[1]: value.imag}


def _name_and_unit(heading: str) -> tuple[str, str]:
    """The name of a heading in small letters, and its unit: in brackets, or an angle behind the last underscore."""
    bracketed = in_brackets(heading)
    if bracketed is not None:
        return bracketed[0].lower().replace(" ", "_"), bracketed[1]
    whole = heading.strip().lower().replace(" ", "_")
    name, _, label = whole.rpartition("_")
    return (name, label) if label in _ANGLES else (whole, "")
