"""An experiment for the rig's tests, and for each effect on recordings of kind frf parameters that show."""

from typing import Any

PARAMETERS: dict[str, dict[str, Any]] = {
    "moving_contact_edge": {"mobile_fraction": 1.0},
    "layered_contact": {},
    "misalignment": {"x_mm": 0.5, "y_mm": 0.2},
    "adhesion": {"work_j_per_m2": 2.0},
    "strain_stiffening": {"coefficient": 15.0},
    "compressible_layer": {"poisson_ratio": 0.45},
    "interface_slip": {"glue_stiffness": 1.0},
    "preload_dependent_d33": {"beta_per_mpa": 1.0, "saturation_mpa": 0.3, "law": "saturating"},
    "sensor_spread": {"sd": 0.1},
    "ageing": {"rate": 0.1, "cycles": 300.0, "law": "exponential"},
    "contact_resonance": {"tip_mass_g": 2.0, "damping": 0.05},
    "amplifier_high_pass": {"corner_hz": 1.0},
    "amplifier_low_pass": {"corner_hz": 300.0},
    "sensor_relaxation": {"exponent": 0.05},
    "contact_creep": {"fraction": 0.6, "time_s": 20.0},
    "mains_pickup": {"charge_pc": 0.05, "mains_hz": 50.0},
    "amplitude_nonlinearity": {"mobility": 1.0},
    "crosstalk": {"fraction": 0.3},
    "timing_delay": {"delay_us": 50.0},
    "modulus_error": {"factor": 1.3},
    "thickness_error": {"factor": 1.1},
    "bending_substrate": {"amplitude": 0.3},
    "preload_leak": {"corner_hz": 1.0, "power": 1.0},
    "temperature_drift": {"amplitude": 0.1, "period_h": 24.0},
    "stage_wobble": {"amplitude_mm": 0.5, "period_recordings": 7.0},
    "hysteretic_d33": {"amplitude": 0.1},
    "rattle": {"hz": 200.0, "amplitude": 0.2, "damping": 0.05},
    "notch": {"hz": 50.0, "left": 0.3, "width_hz": 10.0},
    "cable_motion": {"hz": 300.0, "amplitude": 0.2},
    "cracked_electrode": {"amplitude": 0.1, "at_cycle": 500.0},
}


def described(**changes: Any) -> dict[str, Any]:
    """An experiment on four sensors of the prototype that writes everything down; `changes` go into its parts."""
    description: dict[str, Any] = {
        "schema": "experiment/1",
        "name": "test",
        "seed": 5,
        "skin": {
            "thickness_mm": 2.5, "youngs_modulus_mpa": 16.0, "sensor_radius_mm": 1.5, "d33_pc_per_n": 14.0,
            "array": {"columns": 2, "rows": 2, "pitch_mm": 4.0}, "width_mm": 20.0, "length_mm": 40.0,
        },
        "design": {
            "indenters_mm": [4.0, 10.0], "preloads_n": [0.5, 3.0], "dynamic_forces_n": [0.09],
            "offsets_mm": [[0.0, 0.0], [1.5, 0.0]], "dwells_s": [100.0], "cycles_per_recording": 50.0,
            "start": "2017-05-03T09:00:00Z",
        },
        "lines": {"low_hz": 1.0, "high_hz": 130.0, "count": 20},
    }  # fmt: skip
    for name, value in changes.items():
        merged = isinstance(value, dict) and name in ("skin", "design", "noise")
        description[name] = {**description.get(name, {}), **value} if merged else value
    return {name: value for name, value in description.items() if value is not None}
