"""A sample that is pulled, kind `tension` of a rig description: read as a recording of kind `compression`.

Its height is the free length between the clamps, its diameter that of the circle with the area of its section, and
force and displacement are negative as it is pulled.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from underskin.errors import FileError
from underskin.recordings import validation as field
from underskin.recordings.curve_preparation import pull_is_positive

TENSION, READ_AS = "tension", "compression"


@dataclass(frozen=True)
class Sample:
    """The size of a strip, or of a rod."""

    sample_length_mm: field.Declared | None = None
    sample_width_mm: field.Declared | None = None
    sample_thickness_mm: field.Declared | None = None
    sample_diameter_mm: field.Declared | None = None


SIZES = tuple(size.name for size in fields(Sample))
_LENGTH, _WIDTH, _THICKNESS, _DIAMETER = SIZES


def of_sample(values: Mapping[str, Any], file: str) -> dict[str, Any]:
    """The fields of the recording for those of a sample that is pulled; raises FileError for a size that is missing."""
    sizes = {name: value for name, value in values.items() if name in SIZES and value is not None}
    for name in (_LENGTH, *(() if _DIAMETER in sizes else (_WIDTH, _THICKNESS))):
        if name not in sizes:
            needed = "required of a sample that is pulled: its free length, with width and thickness, or a diameter"
            raise FileError(file, f"recording.{name}", needed)
    diameter = sizes.get(_DIAMETER)
    if diameter is None:
        diameter = 2 * math.sqrt(max(sizes[_WIDTH] * sizes[_THICKNESS], 0.0) / math.pi)
    others = {name: value for name, value in values.items() if name not in SIZES}
    return {**others, "sample_height_mm": sizes[_LENGTH], _DIAMETER: diameter}


def turned(columns: Mapping[str, Any], *, signs_stated: bool) -> dict[str, Any]:
    """The columns with force and displacement negative as the sample is pulled: by the stated signs, which are positive
    then, else by the curve."""
    names = ("force_n", "displacement_mm")
    if not all(name in columns for name in names):
        return dict(columns)
    signs = (True, True) if signs_stated else pull_is_positive(*(np.asarray(columns[name]) for name in names))
    return {**columns, **{name: -columns[name] for name, positive in zip(names, signs, strict=True) if positive}}
