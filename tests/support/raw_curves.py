"""A raw curve as an atomic force microscope writes it: height and deflection, of a sphere on a soft half space."""

from typing import Any

import numpy as np

MODULUS_MPA, RADIUS_MM, SPRING_N_PER_M = 1.2, 7.5e-3, 3.0
OFFSET_NM = 25.0  # of the deflection in the air
_SAMPLES = 200  # each way

_WAY_IN = np.linspace(-5e-4, 1.5e-3, _SAMPLES)
DEPTH_MM = np.concatenate([_WAY_IN, _WAY_IN[::-1]])
# Hertz on an incompressible half space: F = 16/9 E √R δ^1.5
FORCE_N = 16 / 9 * MODULUS_MPA * np.sqrt(RADIUS_MM) * np.maximum(DEPTH_MM, 0) ** 1.5
DEFLECTION_NM = 1e9 * FORCE_N / SPRING_N_PER_M
TRAVEL_NM = 1e6 * DEPTH_MM + DEFLECTION_NM


def text_of_raw_curve(
    above: str = "", height_sign: int = -1, deflection_sign: int = 1, noise_nm: float = 0.0, seed: int = 0
) -> str:
    """A table of height and deflection in nm; height falls as it presses. `noise_nm` is that of the deflection."""
    noise = noise_nm * np.random.default_rng(seed).standard_normal(len(DEPTH_MM))
    measured = deflection_sign * (DEFLECTION_NM + OFFSET_NM + noise)
    rows = zip(height_sign * (TRAVEL_NM + noise), measured, strict=True)
    lines = [f"{height:.6f}\t{deflection:.6f}" for height, deflection in rows]
    return "\n".join([*([above] if above else []), "Height (nm)\tDeflection (nm)", *lines])


def rig_of_raw_curve(**changes: Any) -> dict[str, Any]:
    """The rig description that derives depth and force from it, with changes."""
    return {
        "schema": "rig/1",
        "kind": "indentation",
        "units_checked": True,
        "skin": {"poisson_ratio": 0.5},
        "recording": {"indenter_radius_mm": RADIUS_MM},
        "derived": {
            "k": f"{SPRING_N_PER_M:g} [N/m]",
            "depth": "-'Height (nm)' - 'Deflection (nm)'",
            "load": "k * 'Deflection (nm)'",
        },
        "channels": {
            "displacement_mm": {"channel": "depth"},
            "force_n": {"channel": "load", "tare_percent": 10},
        },
        **changes,
    }
