"""Values of a campaign's columns in sentences, in the units in which they read well."""

import numpy as np

from underskin.units import LAB, Floats, readable_unit

_SCALED = ("force_n", "displacement_mm")  # which are small under a small sphere


def readable(field: str, *values: float) -> str:
    """Values of a field in one unit: `0 to 1.787 µN`."""
    largest = max(map(abs, values))
    unit, count = readable_unit(field, largest) if field in _SCALED else (LAB[field].unit, 1.0)
    return f"{' to '.join(f'{count * value + 0.0:.4g}' for value in values)} {unit}"  # 0 instead of -0


def range_of(field: str, column: Floats) -> str:
    """The lowest and the highest of the finite values of a column that has any."""
    finite = column[np.isfinite(column)]
    return readable(field, float(finite.min()), float(finite.max()))
