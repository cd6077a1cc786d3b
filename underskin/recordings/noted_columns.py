"""What else a lab noted of a recording: columns of its own, by names that no field or axis has."""

import re
from typing import Annotated, Any

from underskin import errors
from underskin.errors import InvalidInput
from underskin.recordings import validation
from underskin.recordings.shown_values import named, shown

CONDITION = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")
MOST_CONDITIONS = 100
BUILT_IN_AXES = frozenset(  # that no column of `conditions` may be called
    (
        *("id", "kind", "sensor", "indenter_radius_mm", "preload_n", "dynamic_force_n", "recorded_at", "load_cycles"),
        *("dwell_s", "position_mm", "frequency_hz", "frf_re_pc_per_n", "frf_im_pc_per_n", "coherence", "conditions"),
        *("sample_rate_hz", "force_n", "charge_pc", "displacement_mm", "time_s", "stage_stiffness_n_per_mm"),
        *("sample_height_mm", "sample_diameter_mm", "order", "time_of_day", "previous_preload_n", "x_mm", "y_mm"),
        *("phase", "day"),
    )
)


def further(field: str, value: Any, units_checked: bool) -> dict[str, float | str]:
    """What else a lab noted, by names of its own: numbers or short words; null where it was not noted."""
    document = validation.mapping(field, value)
    noted: dict[str, float | str] = {}
    if len(document) > MOST_CONDITIONS:
        raise errors.out_of_range(field, len(document), f"must be at most {MOST_CONDITIONS} columns")
    for key, entry in document.items():
        place = f"{field}.{named(key)}"
        if not isinstance(key, str) or not CONDITION.fullmatch(key):
            raise InvalidInput(place, shown(key), "must be a name of letters, digits and underscores")
        if key in BUILT_IN_AXES:
            raise InvalidInput(place, shown(key), "is the name of a field or an axis of its own; choose another")
        if isinstance(entry, str):
            noted[key] = validation.name(place, entry, units_checked)
        elif entry is not None:
            noted[key] = validation.number(place, entry)
    return noted


Further = Annotated[dict[str, float | str], further]
