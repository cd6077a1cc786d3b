"""Random curves of a skin's elastomer, described as experiments: a block between platens, a sphere on the skin."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from rig.draw_raw import reading
from rig.effects import COMPRESSION, EFFECTS, INDENTATION
from rig.experiment import SCHEMA
from rig.strengths import evenly_in_log as _log

_PAPERS_BLOCK = (4.0, 2.5)  # height and diameter [mm]
_LARGEST_BLOCK = (30.0, 50.0)
_LOCKING = 0.9  # of the limited law: coefficient times strain
_SMALL_MM = 0.5  # spheres that look like a slip of the unit


def block_description(
    random: np.random.Generator, name: str, skin: Mapping[str, Any], effects: Mapping[str, Any]
) -> dict[str, Any]:
    """One to three compressions of a block of the skin's elastomer, with a friction of its own in most draws."""
    height, diameter = _PAPERS_BLOCK
    if random.random() < 0.7:
        height = _log(random, 3, _LARGEST_BLOCK[0])
        diameter = min(_log(random, 0.5 * height, 1.8 * height), _LARGEST_BLOCK[1])
    shared = _acting_on(COMPRESSION, effects)
    strain = min(_log(random, 0.02, 0.3), 0.8 * _locking_strain(shared))
    depth, seconds = strain * height, _log(random, 1, 30)
    force = math.pi / 4 * diameter**2 * skin["youngs_modulus_mpa"] * strain
    two_speeds = bool(random.random() < 0.3)
    curves: dict[str, Any] = {
        "heights_mm": [height],
        "diameters_mm": [diameter],
        "largest_displacement_mm": depth,
        "tension": bool(random.random() < 0.2),
        "samples": int(random.integers(80, 301)),
        "speeds_mm_per_s": [depth / seconds, *([depth / seconds / _log(random, 3, 10)] if two_speeds else [])],
        "repeats": 1 if two_speeds else int(random.integers(1, 4)),
        "hold_s": seconds * _log(random, 0.3, 6) if "contact_creep" in shared or random.random() < 0.3 else 0.0,
        "gain": _log(random, 2e-3, 3e-2),
        "cell_gain": 0.01,
        "contact_point_mm": 0.03 * depth,
        "force_noise_n": force * _log(random, 1e-3, 1e-2),
        "displacement_noise_mm": depth * _log(random, 1e-5, 1e-3) if random.random() < 0.5 else 0.0,
    }
    if random.random() < 0.6:
        shared["platen_friction"] = {"friction": _log(random, 0.05, 1)}
    return _described(random, name, COMPRESSION, skin, curves, shared)


def indentation_description(
    random: np.random.Generator, name: str, skin: Mapping[str, Any], effects: Mapping[str, Any]
) -> dict[str, Any]:
    """One to four raw curves of one sphere; where the base is not felt, the sphere is small beside the thickness."""
    shared = _acting_on(INDENTATION, effects)
    if "adhesion" in shared:
        work = float(shared["adhesion"]["work_j_per_m2"])
        shared["adhesion"]["work_of_separation_j_per_m2"] = max(work, work * _log(random, 1, 3))
    share = _log(random, 0.03, min(0.35, (4 * _locking_strain(shared)) ** 2))  # of depth in R; the strain is 0.2 √share
    ratio = _log(random, 0.08, 0.8) if "layered_contact" in shared else _log(random, 0.005, 0.04)
    contact = ratio * float(skin["thickness_mm"])
    radius = float(f"{contact / math.sqrt(share):.3g}")
    depth = share * radius
    force = 4 / 3 * float(skin["youngs_modulus_mpa"]) / 0.75 * math.sqrt(radius) * depth**1.5
    stage, seconds = force / depth * _log(random, 2, 300), _log(random, 0.5, 30)
    reach = depth + force / stage  # travel of the stage from touch to peak
    two_speeds = bool(random.random() < 0.5)
    curves: dict[str, Any] = {
        "indenters_mm": [radius],
        "largest_displacement_mm": depth,
        "samples": int(_log(random, 200, 1500)),
        "speeds_mm_per_s": [reach / seconds, *([reach / seconds / _log(random, 3, 20)] if two_speeds else [])],
        "repeats": int(random.integers(1, 3 if two_speeds else 5)),
        "hold_s": seconds * _log(random, 0.3, 6) if "contact_creep" in shared or random.random() < 0.3 else 0.0,
        "retract": bool(random.random() < 0.75),
        "approach_mm": reach * _log(random, 0.1, 1.2),
        "retreat_mm": reach * _log(random, 0.1, 1.2),
        "stage_stiffness_n_per_mm": stage,
        "stage_declared": bool(random.random() < 0.5),
        "units_checked": radius < _SMALL_MM,
        **reading(random, depth, force, reach, seconds),
    }
    return _described(random, name, INDENTATION, skin, curves, shared)


def _acting_on(kind: str, effects: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """The effects of the elastomer that act on curves of the kind; E is the true one there."""
    return {
        name: dict(values)
        for name, values in effects.items()
        if kind in EFFECTS[name].kinds and name != "modulus_error"
    }


def _locking_strain(effects: Mapping[str, Any]) -> float:
    values = effects.get("strain_stiffening", {})
    return _LOCKING / float(values["coefficient"]) if values.get("law") == "limited" else math.inf


def _described(
    random: np.random.Generator, name: str, kind: str, skin: Mapping[str, Any], curves: dict[str, Any],
    effects: dict[str, Any],
) -> dict[str, Any]:  # fmt: skip
    return {"schema": SCHEMA, "name": name, "seed": int(random.integers(2**31)), "kind": kind,
            "skin": dict(skin), "curves": curves, "effects": effects}  # fmt: skip
