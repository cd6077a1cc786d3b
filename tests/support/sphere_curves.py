"""Curves of a sphere of 2 mm on an elastomer of 1 MPa, with noise of 0.1 % of the largest force, as campaigns."""

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np

from underskin.recordings.campaign import Campaign, from_dict
from underskin.units import Floats

RADIUS_MM, MODULUS_MPA = 2.0, 1.0
Law = Callable[[Floats], Floats]  # N of mm of depth, not below 0


def hertz(depth: Floats) -> Floats:
    """Force [N] at a depth [mm]."""
    return np.asarray(4 / 3 * MODULUS_MPA / 0.75 * np.sqrt(RADIUS_MM) * depth**1.5)


def ways(*corners: float, samples: int = 240) -> Floats:
    """Depths [mm] from corner to corner, so many samples each way."""
    return np.concatenate([np.linspace(*pair, samples) for pair in itertools.pairwise(corners)])


def pressed(depth: Floats, law: Law = hertz, *, seed: int = 0, noise: float = 1e-3) -> Floats:
    """Force [N] with noise at depths from the surface [mm]."""
    force = law(np.maximum(depth, 0.0))
    return np.asarray(force + noise * force.max() * np.random.default_rng(seed).normal(size=len(force)))


def campaign(
    depth: Floats, force: Floats, *, timed: bool = True, skin: dict[str, Any] | None = None, **of_curve: Any
) -> Campaign:
    """One indentation; without times where it is not `timed`."""
    curve = {"id": "c1", "kind": "indentation", "indenter_radius_mm": RADIUS_MM} | of_curve
    columns = {"displacement_mm": depth.round(7).tolist(), "force_n": force.round(7).tolist()}
    times = {"time_s": (0.02 * np.arange(len(depth))).tolist()} if timed else {}
    document = {
        "schema": "campaign/1",
        "name": "curve",
        "units_checked": True,
        "skin": {"poisson_ratio": 0.5} | (skin or {}),
        "recordings": [curve | columns | times],
    }
    read, problems = from_dict(document)
    assert problems == []
    return read
