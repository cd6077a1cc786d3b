"""Numbers beyond any instrument and any skin, whatever their unit: their products and powers overflow.

The bounds lie far beyond any slip of units: from a picometre to a kilometre, from a millionth of a pascal to the
pressure in neutron stars. `units_checked` does not confirm such numbers.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields
from datetime import datetime
from functools import cache
from typing import Any

import numpy as np

from underskin.errors import InvalidInput, out_of_range
from underskin.recordings.conditions import Sensor

_LENGTH, _FORCE, _TIME = (1e-9, 1e6), (1e-8, 1e8), (1e-12, 1e12)
_PLACE = (0.0, 1e6)  # of what differences and rotations leave where 0 is meant, too
_CHARGE = (1e-9, 1e9)
_STIFFNESS = (1e-12, 1e12)
_BOUNDS = {
    "thickness_mm": _LENGTH,
    "sensor_radius_mm": _LENGTH,
    "youngs_modulus_mpa": _STIFFNESS,
    "d33_pc_per_n": _CHARGE,
    "width_mm": _LENGTH,
    "length_mm": _LENGTH,
    "sensors": _PLACE,
    "indenter_radius_mm": _LENGTH,
    "sample_height_mm": _LENGTH,
    "sample_diameter_mm": _LENGTH,
    "position_mm": _PLACE,
    "displacement_mm": _LENGTH,
    "preload_n": _FORCE,
    "dynamic_force_n": _FORCE,
    "force_n": (1e-13, 1e8),  # the peak of a soft cantilever's curve may be tens of piconewtons
    "frf_re_pc_per_n": _CHARGE,
    "frf_im_pc_per_n": _CHARGE,
    "charge_pc": _CHARGE,
    "dwell_s": _TIME,
    "time_s": _TIME,
    "sample_rate_hz": (1e-6, 1e9),
    "stage_stiffness_n_per_mm": _STIFFNESS,
    "conditions": (0.0, 1e20),  # a lab's own columns: clocks that count nanoseconds have 19 digits
}
# Of what is measured zeros, rounded, may be as small as they like: only a diagnosis is of no use then.
_MEASURED = ("displacement_mm", "force_n", "frf_re_pc_per_n", "frf_im_pc_per_n", "charge_pc", "time_s", "dwell_s")
_YEARS = (1000, 8999)  # an unset clock may write year 1 or 9999, where other time zones lie outside the calendar


@dataclass(frozen=True)
class Excess:
    """A field whose largest magnitude is neither 0 nor from `low` to `high`."""

    field: str
    largest: float
    low: float
    high: float

    @property
    def is_faint(self) -> bool:
        """Whether it is measured, and below its bounds."""
        return self.field in _MEASURED and self.largest < self.low

    @property
    def error(self) -> InvalidInput:
        """As the refusal of the field."""
        allowed = f"must be {self.low:g} to {self.high:g} in magnitude: no skin and no instrument is beyond"
        return out_of_range(self.field, self.largest, allowed)


def excesses(model: Any) -> Iterator[Excess]:
    """Of the fields of a skin's description, or of a recording."""
    kind: Any = type(model)
    for name in _bounded(kind):
        value, (low, high) = getattr(model, name), _BOUNDS[name]
        largest = abs(value) if isinstance(value, float) and math.isfinite(value) else _largest(value)
        if largest and not low <= largest <= high:
            yield Excess(name, float(largest), low, high)


@cache
def _bounded(model: Any) -> tuple[str, ...]:
    return tuple(entry.name for entry in fields(model) if entry.name in _BOUNDS)


def _largest(value: Any) -> float:
    """The largest finite magnitude of a column, a place, the sensors' places, or a lab's own columns; 0 without any."""
    if isinstance(value, dict):
        value = [entry for entry in value.values() if not isinstance(entry, str)]
    elif isinstance(value, tuple) and value and isinstance(value[0], Sensor):
        value = [(sensor.x_mm, sensor.y_mm) for sensor in value]
    if value is None or np.size(value) == 0:
        return 0.0
    size = np.abs(np.asarray(value, dtype=float))
    return float(np.max(size, initial=0.0, where=np.isfinite(size)))


def refusals(model: Any) -> list[InvalidInput]:
    """What a document may not hold: such numbers, and times outside the years that every time zone has."""
    refused = [excess.error for excess in excesses(model) if not excess.is_faint]
    written = getattr(model, "recorded_at", None)
    first, last = _YEARS
    if written is not None and not first <= datetime.fromisoformat(written).year <= last:
        allowed = f"must be in the years {first} to {last}: leave it out where the clock was not set"
        refused.append(out_of_range("recorded_at", written, allowed))
    return refused
