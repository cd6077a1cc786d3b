"""Pads of elastomer that the virtual rig presses: campaigns of indentation curves."""

from collections.abc import Mapping
from typing import Any

from rig.description import parse
from rig.elastomer import campaign_of_curves, record_curves


def pressed(
    name: str, seed: int, thickness_mm: float, curves: Mapping[str, Any], effects: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """The campaign of a pad of 0.5 MPa under spheres of 2.5 and 5 mm."""
    skin = {"thickness_mm": thickness_mm, "youngs_modulus_mpa": 0.5, "sensor_radius_mm": 1.5, "d33_pc_per_n": 14}
    described = parse(
        {
            "schema": "experiment/1",
            "name": name,
            "seed": seed,
            "kind": "indentation",
            "skin": skin,
            "curves": {"indenters_mm": [2.5, 5], **curves},
            "effects": dict(effects or {}),
        }
    )
    return campaign_of_curves(described, record_curves(described))
