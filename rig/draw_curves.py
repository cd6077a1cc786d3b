"""Random experiments of kind indentation and compression that hide no, one, two or uncatalogued effects."""

import math
from typing import Any

import numpy as np

from rig.description import parse
from rig.draw import SHARES
from rig.effects import EFFECTS, INDENTATION, UNCATALOGUED
from rig.elastomer import RecordedCurve, record_curves
from rig.errors import RigError
from rig.experiment import SCHEMA, Experiment
from rig.strengths import drawn_parameters, evenly_in_log, of_curves


def drawn_curves(seed: int, number: int, kind: str, what: str | None = None) -> tuple[Experiment, list[RecordedCurve]]:
    """Draw and record random experiment `number` of a seed; if `what` it hides is not given, it is drawn too."""
    random = np.random.default_rng([seed, number, 23])
    hidden = str(random.choice(list(SHARES), p=list(SHARES.values()))) if what is None else what
    for _ in range(200):
        description = _description(random, kind, f"drawn {kind} {seed}/{number}")
        names = _names(random, kind, hidden)
        ranges = of_curves(description)
        description["effects"] = {name: drawn_parameters(random, name, ranges) for name in names}
        try:
            experiment = parse(description)
            return experiment, record_curves(experiment)
        except RigError:
            continue
    raise RuntimeError(f"no feasible experiment {seed}/{number}")


def _names(random: np.random.Generator, kind: str, what: str) -> list[str]:
    source = UNCATALOGUED if what == "unknown" else EFFECTS
    names = [name for name, effect in source.items() if kind in effect.kinds]
    return [str(name) for name in random.choice(names, {"none": 0, "pair": 2}.get(what, 1), replace=False)]


def _description(random: np.random.Generator, kind: str, name: str) -> dict[str, Any]:
    modulus = evenly_in_log(random, 0.05, 3)
    thickness = evenly_in_log(random, 2, 12)
    radius = evenly_in_log(random, 1, 5)
    depth = evenly_in_log(random, 0.05, 0.35) * (min(radius, 0.4 * thickness) if kind == INDENTATION else 10.0)
    largest = (
        1.8 * modulus * math.sqrt(radius) * depth**1.5 if kind == INDENTATION else 314 * modulus * depth / 10
    )  # N, about
    curves: dict[str, Any] = {
        "largest_displacement_mm": float(f"{depth:.3g}"),
        "samples": int(random.integers(80, 301)),
        "speeds_mm_per_s": [float(f"{depth * rate:.3g}") for rate in (0.05, 0.5)[: int(random.integers(1, 3))]],
        "repeats": int(random.integers(1, 4)),
        "hold_s": float(random.choice([0.0, 5.0, 20.0])),
        "force_noise_n": largest * evenly_in_log(random, 1e-3, 1e-2),
        "contact_point_mm": 0.03 * depth,
        "modulus_declared": bool(random.random() < 0.6),
    }
    if kind == INDENTATION:
        curves["indenters_mm"] = [radius, 2 * radius][: int(random.integers(1, 3))]
    else:
        curves |= {"heights_mm": [10.0, 5.0][: int(random.integers(1, 3))], "diameters_mm": [20.0]}
        curves["tension"] = bool(random.random() < 0.3)
        curves["largest_displacement_mm"] = min(curves["largest_displacement_mm"], 0.3 * curves["heights_mm"][-1])
    skin = {"thickness_mm": thickness, "youngs_modulus_mpa": modulus, "sensor_radius_mm": 1.0, "d33_pc_per_n": 10.0}
    seed = int(random.integers(2**31))
    return {"schema": SCHEMA, "name": name, "seed": seed, "kind": kind, "skin": skin, "curves": curves}
