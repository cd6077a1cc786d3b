"""Strengths of drawn effects: log-uniform parameters, from subtle to strong for the experiment."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from rig.effects import ALL_EFFECTS, needed_by_law

Ranges = dict[str, dict[str, tuple[float, float]]]

# Parameters of either sign, and factors above or below 1, with equal probability.
SIGNED = {
    "preload_dependent_d33": "beta_per_mpa",
    "bending_substrate": "amplitude",
    "hysteretic_d33": "amplitude",
    "rattle": "amplitude",
    "cable_motion": "amplitude",
    "force_drift": "n_per_root_s",
}
INVERTED = {"modulus_error", "thickness_error"}


def evenly_in_log(random: np.random.Generator, low: float, high: float) -> float:
    """A draw uniform in the logarithm, to three significant digits."""
    return float(f"{math.exp(random.uniform(math.log(low), math.log(high))):.3g}")


def drawn_parameters(random: np.random.Generator, name: str, ranges: Ranges) -> dict[str, Any]:
    """An effect's parameters within the ranges, and one of its laws."""
    values: dict[str, Any] = {
        parameter: evenly_in_log(random, low, high) for parameter, (low, high) in ranges.get(name, {}).items()
    }
    upside_down = random.random() < 0.5
    if name in SIGNED and upside_down:
        values[SIGNED[name]] *= -1
    if name in INVERTED and upside_down:
        values["factor"] = 1 / values["factor"]
    if ALL_EFFECTS[name].laws:
        values["law"] = str(random.choice(ALL_EFFECTS[name].laws))
        unused = set(ALL_EFFECTS[name].optional) - set(needed_by_law(name, values))
        values = {parameter: value for parameter, value in values.items() if parameter not in unused}
    if name == "misalignment":
        angle = random.uniform(0, 2 * math.pi)
        size = values.pop("x_mm")
        values |= {"x_mm": round(size * math.cos(angle), 3), "y_mm": round(size * math.sin(angle), 3)}
    if name == "mains_pickup":
        values["mains_hz"] = float(random.choice([50, 60]))
    return values


def of_frf(description: Mapping[str, Any]) -> Ranges:
    """The ranges for recordings of kind frf."""
    skin, design, lines = (description[part] for part in ("skin", "design", "lines"))
    h = skin["thickness_mm"]
    cycles = design.get("cycles_per_recording", 1.0) * design["most_recordings"]
    hours = design.get("minutes_per_recording", 5) / 60 * design["most_recordings"]
    stress = 1.5 * design["preloads_n"][-1] / (math.pi * h**2)  # MPa, about, at the highest preload
    charge = 0.2 * skin["d33_pc_per_n"] * design["dynamic_forces_n"][0]  # pC, about
    inside_hz = (8.0, 0.5 * lines["high_hz"])
    return {
        "moving_contact_edge": {"mobile_fraction": (0.3, 1)},
        "misalignment": {"x_mm": (0.08 * h, 0.5 * h)},
        "adhesion": {"work_j_per_m2": (0.2, 4)},
        "strain_stiffening": {"coefficient": (1, 8)},
        "compressible_layer": {"poisson_ratio": (0.3, 0.49)},
        "interface_slip": {"glue_stiffness": (0.01, 2)},
        "preload_dependent_d33": {
            "beta_per_mpa": (0.05 / stress, 0.6 / stress),
            "saturation_mpa": (0.3 * stress, 3 * stress),
        },
        "sensor_spread": {"sd": (0.02, 0.25)},
        "ageing": {"rate": (0.05, 0.35), "cycles": (max(0.02 * cycles, 1.0), 0.5 * cycles + 1)},
        "contact_resonance": {"tip_mass_g": (0.1, 30), "damping": (0.01, 0.15)},
        "amplifier_high_pass": {"corner_hz": (0.05, 3)},
        "sensor_relaxation": {"exponent": (0.003, 0.06), "step": (0.02, 0.5), "corner_hz": (3, 100)},
        "contact_creep": {"fraction": (0.1, 0.7), "time_s": (3, 150)},
        "mains_pickup": {"charge_pc": (0.02 * charge, 0.6 * charge)},
        "amplitude_nonlinearity": {"mobility": (0.3, 1)},
        "crosstalk": {"fraction": (0.05, 0.4)},
        "timing_delay": {"delay_us": (2, 300)},
        "modulus_error": {"factor": (1.08, 1.6)},
        "thickness_error": {"factor": (1.03, 1.25)},
        "bending_substrate": {"amplitude": (0.05, 0.4)},
        "preload_leak": {"corner_hz": (0.1, 3), "power": (0.5, 2)},
        "temperature_drift": {"amplitude": (0.03, 0.25), "period_h": (0.3 * hours, hours)},
        "stage_wobble": {"amplitude_mm": (0.16 * h, h), "period_recordings": (4, 20)},
        "hysteretic_d33": {"amplitude": (0.03, 0.25)},
        "rattle": {"hz": inside_hz, "amplitude": (0.02, 0.3), "damping": (0.03, 0.2)},
        "notch": {"hz": inside_hz, "left": (0.02, 0.95), "width_hz": (3, 30)},
        "cable_motion": {"hz": inside_hz, "amplitude": (0.02, 0.4)},
        "cracked_electrode": {"amplitude": (0.04, 0.3), "at_cycle": (0.2 * cycles, 0.8 * cycles)},
    }


def of_compressions(description: Mapping[str, Any]) -> Ranges:
    """The ranges for recordings of kind compression."""
    curves = description["curves"]
    depth = curves["largest_displacement_mm"]
    seconds = depth / curves["speeds_mm_per_s"][0]
    force = curves["force_noise_n"] / 3e-3  # N, about, the largest
    return {
        "strain_stiffening": {"coefficient": (0.5, 5)},
        "contact_creep": {"fraction": (0.05, 0.6), "time_s": (0.1 * seconds, 3 * seconds)},
        "platen_friction": {"friction": (0.05, 1)},
        "instrument_compliance": {"stiffness_n_per_mm": (1.5 * force / depth, 60 * force / depth)},
        "force_ripple": {"amplitude": (0.01, 0.15), "pitch_mm": (0.08 * depth, 0.4 * depth)},
        "force_drift": {"n_per_root_s": (0.02 * force / math.sqrt(seconds), 0.3 * force / math.sqrt(seconds))},
        "tilted_platen": {"wedge_mm": (0.05 * depth, 0.5 * depth)},
    }
