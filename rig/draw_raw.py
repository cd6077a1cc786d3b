"""Random raw indentation curves as nanoindenters (µm) and testing machines (mm) write them, described as experiments.

Ranges are documented in docs/rig.md; `_log` draws uniformly in the logarithm. Design and instrument do not depend on
what is hidden, except where an effect needs them: a base that is felt, a way back, times.
"""

import math
from typing import Any

import numpy as np

from rig.effects import INDENTATION, UNCATALOGUED
from rig.experiment import SCHEMA
from rig.strengths import evenly_in_log as _log

CATALOGUED = ("adhesion", "contact_creep", "instrument_compliance", "layered_contact", "strain_stiffening")
UNKNOWN = tuple(name for name, effect in UNCATALOGUED.items() if INDENTATION in effect.kinds)
_LARGEST_CELL_N, _THICKEST_MM = 50.0, 80.0
_NEEDS_TIMES = {"contact_creep", "force_drift", "thermal_drift"}
_NEEDS_THE_WAY_BACK = {"plastic_set", "guide_friction"}
_SIGNED = {"force_drift": "n_per_root_s", "thermal_drift": "drift_mm", "nonlinear_cell": "nonlinearity"}


def effect_names(random: np.random.Generator, what: str) -> list[str]:
    """The hidden effects of an experiment: none, single, pair or unknown; ν < 1/2 is visible only on a layer, so it
    comes with one."""
    if what == "none":
        return []
    if what == "unknown":
        return [str(random.choice(UNKNOWN))]
    if what == "single":
        return [str(random.choice(CATALOGUED))]
    pair = sorted(str(name) for name in random.choice([*CATALOGUED, "compressible_layer"], 2, replace=False))
    return ["compressible_layer", "layered_contact"] if "compressible_layer" in pair else pair


def raw_description(random: np.random.Generator, name: str, names: list[str]) -> dict[str, Any]:
    """The description (`experiment/1`) of a random experiment that hides the named effects."""
    small = bool(random.random() < 0.5)
    radius = _log(random, 0.005, 0.1) if small else _log(random, 1, 10)
    modulus = _log(random, 0.3, 5) if small else _log(random, 0.1, 20)
    held = (_LARGEST_CELL_N * 0.5625 / (modulus * math.sqrt(radius))) ** (2 / 3)  # depth at which the cell is full
    depth = min(_log(random, 0.03, 0.35) * radius, held)
    contact = math.sqrt(radius * depth)
    force = 4 / 3 * modulus / 0.75 * contact * depth
    ratio = _log(random, 0.08, 0.8) if "layered_contact" in names else _log(random, 2e-3, 0.02)
    stage = _stage(random, small, modulus, contact, force / depth)
    reach = depth + force / stage  # travel of the stage from touch to peak
    seconds = _log(random, 0.5, 30)
    curves: dict[str, Any] = {
        "indenters_mm": [radius, radius * _log(random, 0.6, 1.0)][: int(random.integers(1, 3))],
        "largest_displacement_mm": depth,
        "samples": int(_log(random, 200, 3000)),
        "speeds_mm_per_s": [reach / seconds, reach / seconds / _log(random, 3, 20)][: int(random.integers(1, 3))],
        "repeats": int(random.integers(1, 4)),
        "hold_s": seconds * _log(random, 0.3, 6) if random.random() < 0.5 else 0.0,
        "retract": bool((names and set(names) & _NEEDS_THE_WAY_BACK) or random.random() < 0.75),
        "approach_mm": reach * _log(random, 0.1, 1.2),
        "retreat_mm": reach * _log(random, 0.1, 1.2),
        "stage_stiffness_n_per_mm": stage,
        "stage_declared": bool(random.random() < 0.5),
        "times": bool(set(names) & _NEEDS_TIMES or random.random() < 0.85),
        "modulus_declared": bool(random.random() < 0.5),
        "modulus_scatter": 0.015,
        "units_checked": small,
        **reading(random, depth, force, reach, seconds),
    }
    skin = {"thickness_mm": min(contact / ratio, _THICKEST_MM), "youngs_modulus_mpa": modulus, "sensor_radius_mm": 1.0,
            "d33_pc_per_n": 10.0}  # fmt: skip
    effects = {name: _strength(random, name, curves, force, seconds, small) for name in names}
    seed = int(random.integers(2**31))
    return {"schema": SCHEMA, "name": name, "seed": seed, "kind": INDENTATION, "skin": skin, "curves": curves,
            "effects": effects}  # fmt: skip


def _stage(random: np.random.Generator, small: bool, modulus: float, contact: float, secant: float) -> float:
    """Stiffness [N/mm]: a cantilever of 0.3–50 N/m near that of the contact, a load cell well above it."""
    if small:
        punch = 2 * modulus / 0.75 * contact
        return min(max(_log(random, 0.1, 10) * punch, 3e-4), 5e-2)
    return secant * _log(random, 2, 300)


def reading(
    random: np.random.Generator, depth: float, force: float, reach: float, seconds: float
) -> dict[str, float]:  # fmt: skip
    """Scatter, drift, noise and steps of the instrument."""
    drift = random.choice(["none", "n_per_s", "n_per_mm"], p=[0.4, 0.3, 0.3])
    size = force * _log(random, 2e-3, 3e-2)
    travel_noise = depth * _log(random, 1e-5, 1e-3) if random.random() < 0.5 else 0.0
    return {
        "contact_point_mm": 3 * depth,
        "force_zero_n": force * _log(random, 5e-3, 5e-2),
        "gain": _log(random, 2e-3, 3e-2),
        "cell_gain": 0.01,
        "force_noise_n": force * _log(random, 3e-4, 5e-3),
        "displacement_noise_mm": travel_noise,
        "force_step_n": force * _log(random, 1e-5, 1e-3) if random.random() < 0.6 else 0.0,
        "displacement_step_mm": depth * _log(random, 1e-5, 1e-3) if random.random() < 0.6 else 0.0,
        **({"drift_n_per_s": size / seconds} if drift == "n_per_s" else {}),
        **({"drift_n_per_mm": size / reach} if drift == "n_per_mm" else {}),
    }


def _strength(
    random: np.random.Generator, name: str, curves: dict[str, Any], force: float, seconds: float,
    small: bool,
) -> dict[str, Any]:  # fmt: skip
    """An effect's parameters, from subtle to strong."""
    depth, radius = curves["largest_displacement_mm"], curves["indenters_mm"][0]
    if name == "adhesion":
        work = _log(random, 0.01, 0.1) if small else _log(random, 0.02, 2)
        return {"work_j_per_m2": work, "work_of_separation_j_per_m2": max(work, work * _log(random, 1, 3))}
    if name == "contact_creep":
        values = {"fraction": _log(random, 0.05, 0.6), "time_s": seconds * _log(random, 0.05, 5)}
        if random.random() < 0.4:
            largest = 0.9 - values["fraction"]
            later = values["time_s"] * _log(random, 5, 50)
            values |= {"fraction_2": largest * float(random.uniform(0.2, 0.8)), "time_2_s": later}
        return values
    if name == "strain_stiffening":
        law = str(random.choice(["linear", "limited"]))
        strain = 0.2 * math.sqrt(depth / min(curves["indenters_mm"]))
        highest = min(20.0, (0.85 if law == "limited" else 20.0) / strain)
        return {"law": law, "coefficient": _log(random, min(1.0, 0.3 * highest), highest)}
    ranges: dict[str, dict[str, tuple[float, float]]] = {
        "layered_contact": {},
        "compressible_layer": {"poisson_ratio": (0.3, 0.49)},
        "instrument_compliance": {"stiffness_n_per_mm": (1.5 * force / depth, 60 * force / depth)},
        "force_ripple": {"amplitude": (0.003, 0.1), "pitch_mm": (0.08 * depth, 0.5 * depth)},
        "force_drift": {"n_per_root_s": (0.005 * force / math.sqrt(seconds), 0.2 * force / math.sqrt(seconds))},
        "thermal_drift": {"drift_mm": (0.005 * depth, 0.2 * depth), "time_s": (0.3 * seconds, 3 * seconds)},
        "guide_friction": {"friction": (0.003, 0.1), "slip_mm": (0.01 * depth, 0.3 * depth)},
        "nonlinear_cell": {"nonlinearity": (0.02, 0.3), "range_n": (force, 3 * force)},
        "plastic_set": {"ratio": (0.01, 0.3)},
        "flattened_tip": {"radius_mm": (0.1 * math.sqrt(radius * depth), 0.8 * math.sqrt(radius * depth))},
        "rough_surface": {"height_mm": (0.005 * depth, 0.1 * depth), "force_n": (0.003 * force, 0.1 * force)},
    }
    drawn = {parameter: _log(random, low, high) for parameter, (low, high) in ranges[name].items()}
    if name in _SIGNED and random.random() < 0.5:
        drawn[_SIGNED[name]] *= -1
    return drawn
