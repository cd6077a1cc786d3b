"""The skin fields common to several forms and the default values of a view: the skin's own or the prototype's, and
which are undeclared."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from service.pages.shared import verdicts
from service.store import AnyRow, Database, campaigns, models, overview, skins
from service.usecases import d33_cache
from underskin.surrogate.sigma_table import SigmaTable

# Field, words, unit.
FIELDS = (
    ("thickness_mm", "thickness h", "mm"),
    ("youngs_modulus_mpa", "Young's modulus E", "MPa"),
    ("sensor_radius_mm", "sensor radius rT", "mm"),
    ("d33_pc_per_n", "d33", "pC/N"),
    ("poisson_ratio", "Poisson's ratio ν", ""),
)
UNITS = "units_checked"
PROTOTYPE = {
    "thickness_mm": 2.5,
    "sensor_radius_mm": 1.5,
    "indenter_radius_mm": 4.0,
    "preload_n": 1.0,
    "youngs_modulus_mpa": 16.0,
    "d33_pc_per_n": 14.0,
    "poisson_ratio": 0.5,
    "pitch_mm": 8.0,
    "dip_percent": 10.0,
}  # Seminara 2018


def start(
    store: Database, table: SigmaTable, skin_id: str | None, words: Mapping[str, tuple[str, str]]
) -> tuple[dict[str, float], list[str]]:
    """The defaults of a view: the values of the campaign that describes the skin, those of its sphere and, if no d33
    is declared, the measured one; else the paper's prototype.

    Also sentences on the undeclared ones of the fields in `words` (each with its words and unit).
    """
    if skin_id is None:
        return dict(PROTOTYPE), []
    with store.reading() as connection:
        root = skins.require_root(connection, skin_id)
        latest = campaigns.describing(connection, root)
        if latest is None:
            return dict(PROTOTYPE), ["The skin has no campaign in use: all values are those of the paper's prototype"]
        recordings = campaigns.recordings_of(connection, latest.number)
        measured = overview.medians(connection, [latest.number], table.sha256).get(latest.number)
        sensors = overview.measured_sensors(connection, [latest.number], table.sha256).get(latest.number, (0, 0))
    described = latest.about["skin"]
    values = {name: float(described[name]) for name in PROTOTYPE if described.get(name) is not None}
    values |= _pressed([recording.scalars for recording in recordings if "preload_n" in recording.scalars])
    values |= _pitch(described["sensors"])
    taken = []
    if "d33_pc_per_n" not in values and measured is not None and measured > 0:
        values["d33_pc_per_n"], sentence = _measured_d33(store, table, root, latest, measured, sensors)
        taken += [f"{sentence}; the skin declares none"] if "d33_pc_per_n" in words else []
    lacking = [name for name in words if name in PROTOTYPE and name not in values]
    sentence = ", ".join(f"{words[name][0]} {PROTOTYPE[name]:g} {words[name][1]}".strip() for name in lacking)
    if lacking:
        taken.append(f"Not declared, so taken from the paper's prototype: {sentence}")
    return {**PROTOTYPE, **values}, taken


def _measured_d33(
    store: Database, table: SigmaTable, root: str, row: AnyRow, by_paper: float, sensors: tuple[int, int]
) -> tuple[float, str]:
    """d33 [pC/N] of the campaign `row` to four digits, by the skin's adopted model if one is in force and applies,
    else by the paper's, of the array or, without one, `by_paper`, the median over the sensors; and a sentence on its
    origin and whether it may be quoted. `sensors`: for how many the campaign has d33, and how many the skin has."""
    array = overview.of_array(d33_cache.answer(store, table, row, None))
    by_paper = by_paper if array is None else array
    measured, all_sensors = sensors
    part = f", from {measured} of {all_sensors} sensors" if measured < all_sensors else ""
    whose = "the median of the sensors" if array is None else "that of the array"
    paper = f"d33 {by_paper:.4g} pC/N is {whose} in {row.name[:60]}{part}, by the paper's model"
    with store.reading() as connection:
        model = models.in_force(connection, root)
        if model is None:
            return float(f"{by_paper:.4g}"), paper
        adopted = verdicts.adopted_versions(connection, [model])[0]
    answer, lacking = verdicts.answer_by_it(store, table, row)
    by_model = overview.of_array(answer)
    if by_model is None:
        why = lacking or "it gives none of this campaign"
        return float(f"{by_paper:.4g}"), f"{paper}; the skin's adopted model is in force, but {why.rstrip('.')}"
    sentence = (
        f"d33 {by_model:.4g} pC/N is that of {row.name[:60]}{part}{',' if part else ''} by the skin's adopted model"
    )
    quoted = "" if adopted.quotable else ", and not to be quoted yet"
    return float(f"{by_model:.4g}"), f"{sentence} (by the paper's {by_paper:.4g}){quoted}"


def shown(
    store: Database,
    table: SigmaTable,
    given: Mapping[str, str],
    skin_id: str | None,
    fields: Sequence[tuple[str, str, str]] = FIELDS,
) -> tuple[dict[str, str], list[str]]:
    """The values of a form: as sent, even if empty, or else the defaults with the sentences of `start`."""
    missing = {name: (words, unit) for name, words, unit in fields if name not in given}
    start_values, taken = start(store, table, skin_id, missing)
    return {name: given.get(name, f"{start_values[name]:g}") for name, *_ in fields}, taken


def _pressed(scalars: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """The smallest sphere and the median preload."""
    if not scalars:
        return {}
    smallest = float(np.min([conditions["indenter_radius_mm"] for conditions in scalars]))
    return {
        "indenter_radius_mm": smallest,
        "preload_n": float(np.median([conditions["preload_n"] for conditions in scalars])),
    }


def _pitch(sensors: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """The least distance of two sensors in different places."""
    places = np.array([[sensor["x_mm"], sensor["y_mm"]] for sensor in sensors], dtype=float)
    if len(places) < 2:
        return {}
    apart = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))
    return {"pitch_mm": float(apart[apart > 0].min())} if apart.any() else {}
