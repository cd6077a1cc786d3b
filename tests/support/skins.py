"""Campaigns of FRFs of the virtual rig, several of one skin or of skins of one make."""

from collections.abc import Mapping
from copy import deepcopy
from typing import Any

from rig.description import parse as experiment
from rig.recorded import campaign as campaign_of_lines
from rig.recorded import record_lines
from underskin.recordings.campaign import Campaign, parse

LINES: dict[str, Any] = {
    "schema": "experiment/1",
    "kind": "frf",
    "skin": {
        "thickness_mm": 2.5,
        "youngs_modulus_mpa": 16,
        "sensor_radius_mm": 1.5,
        "d33_pc_per_n": 14,
        "array": {"columns": 4, "rows": 2, "pitch_mm": 8},
    },
    "design": {"indenters_mm": [4, 10], "preloads_n": [0.5, 1, 2, 3, 5], "dynamic_forces_n": [0.09]},
    "lines": {"low_hz": 1, "high_hz": 130, "count": 20},
    "noise": {"gain": 0.02, "line": 0.01, "coherence": True},
}
HEAVY_TIP = {"contact_resonance": {"tip_mass_g": 4, "damping": 0.05}}
Effects = Mapping[str, Mapping[str, float | str]]


def document(
    name: str,
    start: str | None = "2017-05-03T09:00:00Z",
    *,
    effects: Effects | None = None,
    seed: int = 5,
    modulus: float = 16.0,
    d33: float = 14.0,
    thickness: float = 2.5,
    skin: str | None = None,
) -> dict[str, Any]:
    """A campaign/1 of a skin that is declared to have 16 MPa, and the thickness that it has; without times where no
    start is given."""
    described = deepcopy(LINES) | {"name": name, "seed": seed, "effects": effects or {}}
    described["skin"] |= {"youngs_modulus_mpa": modulus, "d33_pc_per_n": d33, "thickness_mm": thickness}
    described["skin"] |= {} if skin is None else {"id": skin}
    described["design"] |= {} if start is None else {"start": start}
    made = campaign_of_lines(record_lines(experiment(described)))
    made["skin"]["youngs_modulus_mpa"] = 16.0
    return made


def made(name: str, start: str = "2017-05-03T09:00:00Z", **changes: Any) -> Campaign:
    """The same, read."""
    return parse(document(name, start, **changes))
