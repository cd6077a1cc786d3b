"""Campaigns of a compressed block or pulled strip of the elastomer."""

from typing import Any

import numpy as np

from underskin.recordings.campaign import Campaign, from_dict
from underskin.units import Floats

HEIGHT_MM, DIAMETER_MM = 10.0, 10.0


def block(
    name: str, *, modulus_mpa: float = 2.0, force: int = 1, travel: int = 1, recorded_at: str | None = None
) -> dict[str, Any]:
    """A document of a block whose stress is its modulus times its strain; `force` and `travel`: −1 where the machine
    counts them negative."""
    depth_mm = np.linspace(0.0, 1.0, 41)
    force_n = modulus_mpa * depth_mm / HEIGHT_MM * np.pi / 4 * DIAMETER_MM**2
    recording: dict[str, Any] = {
        "id": "pressed",
        "kind": "compression",
        "sample_height_mm": HEIGHT_MM,
        "sample_diameter_mm": DIAMETER_MM,
        "displacement_mm": (travel * depth_mm).tolist(),
        "force_n": (force * force_n).tolist(),
    }
    if recorded_at is not None:
        recording["recorded_at"] = recorded_at
    return {"schema": "campaign/1", "name": name, "skin": {"poisson_ratio": 0.5}, "recordings": [recording]}


def sample(
    displacement_mm: Floats, force_n: Floats, height_mm: float = HEIGHT_MM, diameter_mm: float = DIAMETER_MM
) -> Campaign:
    """One curve of a block or strip, read."""
    recording = {
        "id": "b", "kind": "compression", "sample_height_mm": height_mm, "sample_diameter_mm": diameter_mm,
        "displacement_mm": displacement_mm.tolist(), "force_n": force_n.tolist(),
    }  # fmt: skip
    read, problems = from_dict(
        {"schema": "campaign/1", "name": "b", "skin": {"poisson_ratio": 0.5}, "recordings": [recording]}
    )
    assert problems == []
    return read
