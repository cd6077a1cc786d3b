"""Which recordings are one and the same, whatever they are called."""

import hashlib
from collections.abc import Iterable
from itertools import chain

import numpy as np
import orjson

from underskin.recordings.campaign import COLUMNS, Recording
from underskin.units import Floats

_DESCRIBED = (
    "kind",
    "sensor",
    "indenter_radius_mm",
    "preload_n",
    "dynamic_force_n",
    "position_mm",
    "sample_height_mm",
    "sample_diameter_mm",
)
_GIVEN = ("frequency_hz", "time_s")  # columns that are chosen, not measured
_FEWEST_VALUES = 16  # different ones: noise makes no two measurements agree in so many


def digest(recording: Recording) -> str | None:
    """A text that two recordings share where they are identical; None where nothing can show that another one is.

    Identical are recordings of one kind, sensor, indenter, preload, dynamic force, position and sample
    with the same numbers, digit for digit, in every column: ids, times and other conditions may differ. Where what was
    measured takes fewer than 16 different values, as in a table typed by hand, two measurements can agree by chance:
    then `recorded_at` must be the same, too, and without one no recording is identical to another.
    """
    columns = {name: values for name in COLUMNS if (values := getattr(recording, name, None)) is not None}
    measured = [values for name, values in columns.items() if name not in _GIVEN]
    described = {name: getattr(recording, name, None) for name in _DESCRIBED}
    if _agree_by_chance(measured):
        if recording.recorded_at is None:
            return None
        described["recorded_at"] = recording.recorded_at
    made = hashlib.blake2b(orjson.dumps(described), digest_size=16)
    for name, values in columns.items():
        made.update(f"{name} {len(values)} ".encode())
        made.update(np.asarray(values, "<f8").tobytes())
    return made.hexdigest()


def _agree_by_chance(measured: Iterable[Floats]) -> bool:
    """Whether other measurements could take the same values."""
    values = set()
    for value in chain.from_iterable(measured):
        values.add(value)
        if len(values) == _FEWEST_VALUES:
            return False
    return True
