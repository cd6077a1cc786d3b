"""FRFs of a skin and curves of its elastomer by the virtual rig, and what a report on them says."""

from collections.abc import Mapping
from copy import deepcopy
from typing import Any

from rig.description import parse as experiment
from rig.elastomer import campaign_of_curves, record_curves
from tests.support import skins
from tests.support.lean_reports import lean_report
from underskin.recordings.campaign import Campaign, parse
from underskin.surrogate.sigma_table import SigmaTable

LINES: dict[str, Any] = {**skins.LINES, "name": "together"}
SKIN: dict[str, Any] = {name: value for name, value in LINES["skin"].items() if name != "array"}
BLOCK: dict[str, Any] = {
    "heights_mm": [12],
    "diameters_mm": [20],
    "largest_displacement_mm": 1.0,
    "speeds_mm_per_s": [0.1],
    "force_noise_n": 0.05,
}
SPHERE: dict[str, Any] = {
    "indenters_mm": [4],
    "largest_displacement_mm": 0.25,
    "speeds_mm_per_s": [0.05],
    "samples": 300,
    "force_noise_n": 0.002,
}
Effects = skins.Effects


def lines(modulus: float = 16.0, effects: Effects | None = None, seed: int = 5) -> dict[str, Any]:
    """FRFs of a skin of this modulus [MPa], declared to have 16."""
    return skins.document("together", None, modulus=modulus, effects=effects, seed=seed)


def curves(
    kind: str,
    design: Mapping[str, Any],
    modulus: float = 16.0,
    effects: Effects | None = None,
    thickness: float = SKIN["thickness_mm"],
) -> list[Any]:
    """Curves of an elastomer of this modulus [MPa], or of a skin of it of this thickness [mm]."""
    skin = {**LINES["skin"], "youngs_modulus_mpa": modulus, "thickness_mm": thickness}
    described = {"schema": "experiment/1", "name": "c", "seed": 6, "kind": kind, "skin": skin, "curves": dict(design)}
    made = experiment({**described, "effects": effects or {}})
    recordings = campaign_of_curves(made, record_curves(made))["recordings"]
    return [{**entry, "id": f"{kind}-{number}"} for number, entry in enumerate(recordings)]


def of_block(modulus: float, name: str = "block") -> Campaign:
    """A campaign of nothing but a compressed block of the elastomer, which is declared to have 16 MPa."""
    skin = {"youngs_modulus_mpa": 16.0, "poisson_ratio": 0.5}
    recordings = curves("compression", BLOCK, modulus)
    return parse({"schema": "campaign/1", "name": name, "skin": skin, "recordings": recordings})


def report(document: Mapping[str, Any], further: list[Any], table: SigmaTable, *left_out: str) -> dict[str, Any]:
    """With further recordings; outside `make soak` without the mechanisms left out."""
    whole = deepcopy(dict(document))
    whole["recordings"] = [*whole["recordings"], *further]
    return lean_report(parse(whole), table, *left_out)


def named(document: Mapping[str, Any]) -> list[str]:
    return [entry["name"] for entry in document["mechanisms"]]


def modulus_of(document: Mapping[str, Any], kind: str) -> dict[str, Any]:
    (entry,) = [
        entry for entry in document["by_kind"] if (entry["kind"], entry["parameter"]) == (kind, "youngs_modulus")
    ]
    return dict(entry)
