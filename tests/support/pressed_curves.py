"""Indentation curves of a soft half space behind a stage that gives, by Hertz' law alone."""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq

from underskin.recordings.campaign import Campaign, parse

MODULUS, NOISE = 2.0, 5e-4  # MPa, and of the largest force


def force_on_stage(travel: float, radius: float, stiffness: float) -> float:
    """F [N] of Hertz' contact behind a stage of that stiffness [N/mm], travel and radius in mm."""

    def beyond(force: float) -> float:
        return force - 16 / 9 * MODULUS * np.sqrt(radius) * max(travel - force / stiffness, 0.0) ** 1.5

    return float(brentq(beyond, 0.0, 100.0)) if travel > 0 else 0.0


def pressed(stiffness: float, radii: Sequence[float], depth: float = 0.3) -> Campaign:
    """Curves with air before them and a way back, pressed through a stage of that stiffness [N/mm]; radii in mm."""
    random = np.random.default_rng(4)
    way_in = depth * np.linspace(-1 / 6, 1.0, 150)
    travel = np.concatenate([way_in, way_in[::-1]])
    recordings = []
    for number, radius in enumerate(radii):
        force = np.array([force_on_stage(one, radius, stiffness) for one in travel])
        force += NOISE * force.max() * random.normal(size=len(force))
        curve = {"displacement_mm": travel.tolist(), "force_n": force.tolist()}
        time = np.linspace(0, 20, len(travel)).tolist()
        named = {"id": f"c{number}", "kind": "indentation", "indenter_radius_mm": radius}
        recordings.append({**named, **curve, "time_s": time})
    skin = {"thickness_mm": 80.0, "poisson_ratio": 0.5}
    return parse(
        {"schema": "campaign/1", "name": "pressed", "units_checked": True, "skin": skin, "recordings": recordings}
    )
