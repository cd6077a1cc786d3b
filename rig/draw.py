"""Random experiments of kind frf like a lab's that hide no, one, two or uncatalogued effects; fixed by seed and number.

Skins, arrays, preloads, noise and the effects' strengths are drawn from ranges that labs have, strengths uniformly in
their logarithm, from subtle to strong. An experiment whose contact is outside the rig's range is drawn again. With
wide tails (`rig.wide_tails`) scatter and strengths go beyond that, and arrays of two sensors are frequent.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rig import wide_tails
from rig.description import parse
from rig.effects import EFFECTS, FRF, UNCATALOGUED
from rig.errors import RigError
from rig.experiment import SCHEMA
from rig.recorded import RecordedLines, record_lines
from rig.strengths import drawn_parameters, evenly_in_log, of_frf

SHARES = {"none": 0.2, "single": 0.4, "pair": 0.2, "unknown": 0.2}
_NOT_DRAWN = {"amplifier_low_pass"}  # or the campaigns of every seed, with which answers were kept, would be others
CATALOGUED = tuple(name for name, effect in EFFECTS.items() if FRF in effect.kinds and name not in _NOT_DRAWN)
UNKNOWN = tuple(name for name, effect in UNCATALOGUED.items() if FRF in effect.kinds)
_TWINS = ({"moving_contact_edge", "amplitude_nonlinearity"}, {"modulus_error", "strain_stiffening"})
_INDENTERS = np.array([2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0])
_ARRAYS = ((1, 1), (1, 1), (2, 2), (3, 3), (4, 2), (4, 4), (8, 4), (8, 8))
_WIDEST, _HARDEST = 1.8, 0.06  # a/h and L of the base model
_MOST = 110

# What an effect needs of the design to be visible. The design suits the hidden effects and, where none is of the
# catalogue, one effect of the catalogue that is not hidden: a lab designs an experiment for what it suspects.
_NEEDS_CYCLES = {"ageing", "cracked_electrode"}
_NEEDS_DWELL = {"contact_creep"}
_NEEDS_TIME = {"temperature_drift"}
_NEEDS_SENSORS = {"sensor_spread", "crosstalk", "bending_substrate"}
_NEEDS_POSITIONS = {
    "misalignment", "crosstalk", "interface_slip", "compressible_layer", "thickness_error", "stage_wobble",
}  # fmt: skip
_NEEDS_HIGH_LINES = {"contact_resonance", "timing_delay", "rattle", "cable_motion"}
_NEEDS_AMPLITUDES = {"amplitude_nonlinearity", "mains_pickup"}
_NEEDS_WIDE = {
    "moving_contact_edge", "amplitude_nonlinearity", "layered_contact", "adhesion", "contact_creep", "modulus_error",
    "strain_stiffening",
}  # fmt: skip


def drawn(seed: int, number: int, what: str | None = None, tails: str = wide_tails.USUAL) -> dict[str, Any]:
    """Description of random experiment `number` of a seed; if `what` it hides is not given, it is drawn too.

    `tails` are one of `wide_tails.TAILS`.
    """
    wide = tails == wide_tails.WIDE
    random = np.random.default_rng([seed, number, 17])
    hidden = str(random.choice(list(SHARES), p=list(SHARES.values()))) if what is None else what
    for _ in range(200):
        names = _names(random, hidden)
        sought = set(names) if set(names) & set(CATALOGUED) else {*names, str(random.choice(CATALOGUED))}
        title = f"drawn {seed}/{number}"
        description = random_description(random, title, sought, wide_tails.ARRAYS if wide else _ARRAYS)
        if wide:
            description["noise"] |= wide_tails.scatter(random)
        ranges = (wide_tails.of_frf if wide else of_frf)(description)
        description["effects"] = {name: drawn_parameters(random, name, ranges) for name in names}
        if _feasible(description):
            return description
    raise RuntimeError(f"no feasible experiment {seed}/{number}")


def _feasible(description: Mapping[str, Any]) -> bool:
    """Whether the rig can record the experiment, also without each one of its effects, as `truth_of_lines` needs."""
    effects = description["effects"]
    try:
        for without in (None, *effects):
            remaining = {name: values for name, values in effects.items() if name != without}
            record_lines(parse({**description, "effects": remaining}))
    except RigError:
        return False
    return True


def record(description: Mapping[str, Any]) -> RecordedLines:
    """Record the experiment of a description."""
    return record_lines(parse(description))


def _names(random: np.random.Generator, what: str) -> list[str]:
    if what == "none":
        return []
    if what == "unknown":
        return [str(random.choice(UNKNOWN))]
    while True:
        names = [str(name) for name in random.choice(CATALOGUED, 1 if what == "single" else 2, replace=False)]
        if set(names) not in _TWINS:
            return names


def random_description(
    random: np.random.Generator, name: str, effects: set[str], arrays: Sequence[tuple[int, int]] = _ARRAYS
) -> dict[str, Any]:
    """The description, as yet without effects, of a random experiment of kind frf that suits the named effects, its
    sensors in one of the `arrays` (columns, rows)."""
    skin, spacing = _skin(random, effects, arrays)
    high = bool(effects & _NEEDS_HIGH_LINES) or random.random() < 0.4
    return {
        "schema": SCHEMA,
        "name": name,
        "seed": int(random.integers(2**31)),
        "skin": skin,
        "design": _design(random, skin, spacing, effects),
        "lines": {"low_hz": 1.0, "high_hz": 1000.0 if high else 130.0, "count": int(random.integers(25, 76))},
        "noise": {
            "gain": evenly_in_log(random, 0.01, 0.05),
            "position_mm": evenly_in_log(random, 0.05, 0.3) if random.random() < 0.3 else 0.0,
            "line": evenly_in_log(random, 0.003, 0.03),
            "low": float(random.uniform(0, 1.5)),
            "high": float(random.uniform(0, 1.5)),
            "floor_pc_per_n": evenly_in_log(random, 0.01, 0.1),
            "averages": float(random.choice([8, 16, 32])),
            "coherence": bool(random.random() < 0.7),
        },
    }


def _skin(
    random: np.random.Generator, effects: set[str], arrays: Sequence[tuple[int, int]]
) -> tuple[dict[str, Any], float]:
    """A skin, in a third of cases the prototype's, and its pitch."""
    wide = bool(effects & _NEEDS_WIDE)
    prototype = random.random() < (0.05 if wide else 0.3)
    skin: dict[str, Any] = {"thickness_mm": 2.5, "youngs_modulus_mpa": 16.0, "sensor_radius_mm": 1.5}
    if not prototype:
        skin["thickness_mm"] = evenly_in_log(random, 1.0, 2.5 if wide else 4.0)
        skin["youngs_modulus_mpa"] = evenly_in_log(random, 0.4, 3.0 if wide else 16.0)
        skin["sensor_radius_mm"] = evenly_in_log(
            random, max(0.5, 0.25 * skin["thickness_mm"]), 1.3 * skin["thickness_mm"]
        )
    suitable = [array for array in arrays if math.prod(array) > 1] if effects & _NEEDS_SENSORS else arrays
    columns, rows = suitable[int(random.integers(len(suitable)))]
    pitch = 8.0 if prototype else float(f"{max(3.0, 2.2 * skin['sensor_radius_mm']) * random.uniform(1, 1.8):.2g}")
    skin |= {
        "d33_pc_per_n": evenly_in_log(random, 8, 30),
        "array": {"columns": columns, "rows": rows, "pitch_mm": pitch},
    }
    if "bending_substrate" in effects or random.random() < 0.5:
        skin |= {"length_mm": round(pitch * (columns + 1.5), 1), "width_mm": round(pitch * (rows + 1.5), 1)}
    return skin, pitch


def _design(random: np.random.Generator, skin: Mapping[str, Any], pitch: float, effects: set[str]) -> dict[str, Any]:
    """Indenters, preloads up to what the skin bears, and what else the lab writes down."""
    sensors = skin["array"]["columns"] * skin["array"]["rows"]
    spheres = _INDENTERS[2 * skin["thickness_mm"] < _INDENTERS] if effects & _NEEDS_WIDE else _INDENTERS
    indenters = sorted(random.choice(spheres, random.integers(1, 4), replace=False).tolist())
    lowest = float(random.choice([0.2, 0.3, 0.5]))
    highest = min(_bearable(skin, indenters), float(random.uniform(1.5, 4.0)))
    count = int(random.integers(3, 11))
    preloads = sorted({float(f"{force:.2g}") for force in np.geomspace(min(lowest, 0.4 * highest), highest, count)})
    dynamic = sorted({evenly_in_log(random, 0.02, 0.2) for _ in range(2 if effects & _NEEDS_AMPLITUDES else 1)})
    design: dict[str, Any] = {
        "indenters_mm": indenters,
        "preloads_n": preloads,
        "dynamic_forces_n": [min(force, 0.5 * preloads[0]) for force in dynamic],
        "shuffled": bool(random.random() < 0.6),
        "most_recordings": int(random.integers(24, _MOST + 1)),
        "repeats": 1 if sensors > 1 else int(random.integers(1, 4)),
    }
    if effects & _NEEDS_POSITIONS or random.random() < 0.25:
        reach = min(0.7 * pitch if sensors > 1 else math.inf, 1.2 * skin["thickness_mm"])
        angles = random.uniform(0, 2 * math.pi, 5)
        ring = [[round(reach * s * math.cos(t), 2), round(reach * s * math.sin(t), 2)] for s, t in zip(
            (0.3, 0.5, 0.7, 0.85, 1.0), angles, strict=True)]  # fmt: skip
        design["offsets_mm"] = [[0.0, 0.0], *ring[: int(random.integers(3, 6))]]
    total = sensors * len(indenters) * len(preloads) * design["repeats"] * len(design.get("offsets_mm", [0]))
    design["most_recordings"] = min(total, design["most_recordings"])
    if effects & _NEEDS_DWELL or random.random() < 0.3:
        design["dwells_s"] = [1.0, 5.0, 20.0, 60.0, 300.0][: int(random.integers(3, 6))]
    if effects & _NEEDS_CYCLES or random.random() < 0.4:
        design["cycles_per_recording"] = evenly_in_log(random, 10, 1000)
    if effects & _NEEDS_TIME or random.random() < 0.6:
        design |= {"start": "2021-03-01T09:00:00Z", "minutes_per_recording": float(random.choice([3, 5, 10, 30]))}
    return design


def _bearable(skin: Mapping[str, Any], indenters: list[float]) -> float:
    """The force at which the contact of the base model leaves the range of the tables."""
    modulus, h = skin["youngs_modulus_mpa"], skin["thickness_mm"]
    wide = (_WIDEST * h) ** 3 * modulus / (0.5625 * max(indenters))
    return float(min(wide, _HARDEST * min(indenters) ** 2 * modulus))
