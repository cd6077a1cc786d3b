"""Wider distributions than those of `rig.draw`: scatter of gain and position, few sensors, and strengths from faint
to extreme.

For tests of the priors of a diagnosis on rigs and effects that they hardly expect.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from rig.strengths import Ranges, evenly_in_log
from rig.strengths import of_frf as usual_strengths

USUAL, WIDE = TAILS = ("usual", "wide")
ARRAYS = ((1, 1), (2, 1), (2, 1), (2, 1), (2, 2), (4, 2), (8, 4))  # columns, rows: of two sensors in three of seven


def scatter(random: np.random.Generator) -> dict[str, float]:
    """Entries of `noise`: scatter of gain 0.5 to 8 %, of position 0.02 to 0.5 mm in half of the rigs, else none."""
    return {
        "gain": evenly_in_log(random, 0.005, 0.08),
        "position_mm": evenly_in_log(random, 0.02, 0.5) if random.random() < 0.5 else 0.0,
    }


def of_frf(description: Mapping[str, Any]) -> Ranges:
    """The ranges of strengths for recordings of kind frf, in place of `rig.strengths.of_frf`."""
    usual = usual_strengths(description)
    h = description["skin"]["thickness_mm"]
    stress = 1.5 * description["design"]["preloads_n"][-1] / (math.pi * h**2)  # MPa, about, at the highest preload
    wide: Ranges = {
        "moving_contact_edge": {"mobile_fraction": (0.1, 1)},
        "misalignment": {"x_mm": (0.04 * h, 0.8 * h)},
        "adhesion": {"work_j_per_m2": (0.05, 5)},
        "strain_stiffening": {"coefficient": (0.3, 16)},
        "compressible_layer": {"poisson_ratio": (0.25, 0.495)},
        "interface_slip": {"glue_stiffness": (0.003, 8)},
        "preload_dependent_d33": {"beta_per_mpa": (0.02 / stress, 1.2 / stress)},
        "sensor_spread": {"sd": (0.01, 0.5)},
        "ageing": {"rate": (0.02, 0.6)},
        "contact_resonance": {"tip_mass_g": (0.03, 150), "damping": (0.003, 0.4)},
        "amplifier_high_pass": {"corner_hz": (0.02, 10)},
        "sensor_relaxation": {"exponent": (0.001, 0.15), "step": (0.01, 1.2), "corner_hz": (1, 300)},
        "contact_creep": {"fraction": (0.05, 0.8), "time_s": (1, 500)},
        "amplitude_nonlinearity": {"mobility": (0.1, 1)},
        "crosstalk": {"fraction": (0.02, 0.6)},
        "timing_delay": {"delay_us": (1, 1500)},
        "modulus_error": {"factor": (1.05, 4)},
        "thickness_error": {"factor": (1.02, 1.45)},
    }
    return usual | {name: usual[name] | ranges for name, ranges in wide.items()}
