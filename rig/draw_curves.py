"""Random experiments of kind indentation and compression that hide no, one, two or uncatalogued effects."""

from typing import Any

import numpy as np

from rig.description import parse
from rig.draw import SHARES
from rig.draw_raw import effect_names, raw_description
from rig.effects import COMPRESSION, EFFECTS, INDENTATION, UNCATALOGUED
from rig.elastomer import RecordedCurve, record_curves
from rig.errors import RigError
from rig.experiment import SCHEMA, Experiment
from rig.strengths import drawn_parameters, evenly_in_log, of_compressions


def drawn_curves(seed: int, number: int, kind: str, what: str | None = None) -> tuple[Experiment, list[RecordedCurve]]:
    """Draw and record random experiment `number` of a seed; if `what` it hides is not given, it is drawn too."""
    random = np.random.default_rng([seed, number, 23])
    hidden = str(random.choice(list(SHARES), p=list(SHARES.values()))) if what is None else what
    title = f"drawn {kind} {seed}/{number}"
    for _ in range(200):
        if kind == INDENTATION:
            description = raw_description(random, title, effect_names(random, hidden))
        else:
            description = _compression(random, title, hidden)
        try:
            experiment = parse(description)
            return experiment, record_curves(experiment)
        except RigError:
            continue
    raise RuntimeError(f"no feasible experiment {seed}/{number}")


def _compression(random: np.random.Generator, name: str, what: str) -> dict[str, Any]:
    source = UNCATALOGUED if what == "unknown" else EFFECTS
    drawable = [effect for effect in source if COMPRESSION in source[effect].kinds]
    modulus, depth = evenly_in_log(random, 0.05, 3), 10 * evenly_in_log(random, 0.05, 0.35)
    heights = [10.0, 5.0][: int(random.integers(1, 3))]
    curves: dict[str, Any] = {
        "heights_mm": heights,
        "diameters_mm": [20.0],
        "largest_displacement_mm": min(float(f"{depth:.3g}"), 0.3 * heights[-1]),
        "tension": bool(random.random() < 0.3),
        "samples": int(random.integers(80, 301)),
        "speeds_mm_per_s": [float(f"{depth * rate:.3g}") for rate in (0.05, 0.5)[: int(random.integers(1, 3))]],
        "repeats": int(random.integers(1, 4)),
        "hold_s": float(random.choice([0.0, 5.0, 20.0])),
        "force_noise_n": 31.4 * modulus * depth * evenly_in_log(random, 1e-3, 1e-2),
        "contact_point_mm": 0.03 * depth,
        "modulus_declared": bool(random.random() < 0.6),
    }
    skin = {"thickness_mm": 10.0, "youngs_modulus_mpa": modulus, "sensor_radius_mm": 1.0, "d33_pc_per_n": 10.0}
    description = {"schema": SCHEMA, "name": name, "seed": int(random.integers(2**31)), "kind": COMPRESSION,
                   "skin": skin, "curves": curves}  # fmt: skip
    names = [
        str(name_of_effect)
        for name_of_effect in random.choice(drawable, {"none": 0, "pair": 2}.get(what, 1), replace=False)
    ]
    ranges = of_compressions(description)
    return {
        **description,
        "effects": {name_of_effect: drawn_parameters(random, name_of_effect, ranges) for name_of_effect in names},
    }
