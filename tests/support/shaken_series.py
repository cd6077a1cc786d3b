"""Time series of one sensor shaken at random under three preloads, through a chain that a test chooses.

d33 is 14.0 pC/N: h 2.5 mm, E 16 MPa, rT 1.5 mm, sphere R 4 mm make 7.424, 7.396 and 7.347 pC/N at 0.5, 1 and 2 N.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from underskin.recordings.campaign import Campaign, from_dict
from underskin.units import Complexes, Floats

D33 = 14.0
RMS_N = 0.064
_LEVELS = {0.5: 7.4243, 1.0: 7.3958, 2.0: 7.3471}  # pC/N
_SKIN: dict[str, Any] = {
    "thickness_mm": 2.5, "youngs_modulus_mpa": 16, "poisson_ratio": 0.5, "sensor_radius_mm": 1.5,
    "sensors": [{"id": "s01", "x_mm": 0, "y_mm": 0}],
}  # fmt: skip
Filter = Callable[[Floats], Complexes]


def delayed(seconds: float) -> Filter:
    """A delay."""
    return lambda f: np.exp(-2j * np.pi * f * seconds)


def high_pass(corner_hz: float) -> Filter:
    """One pole."""
    return lambda f: 1j * f / (corner_hz + 1j * f)


def low_pass(corner_hz: float, order: int = 1) -> Filter:
    """One pole, or Butterworth's two."""

    def passed(f: Floats) -> Complexes:
        x = 1j * f / corner_hz
        return np.asarray(1 / (1 + x) if order == 1 else 1 / (1 + np.sqrt(2) * x + x**2))

    return passed


def _unchanged(f: Floats) -> Complexes:
    return np.ones(len(f), dtype=complex)


def shaken(
    *,
    seed: int = 40,
    samples: int = 4096,
    rate_hz: float = 800.0,
    high_hz: float = 180.0,
    charge: Filter = _unchanged,
    force: Filter = _unchanged,
    force_noise: float = 0.0,
    charge_noise: float = 0.01,
    **fields: Any,
) -> Campaign:
    """Its force is excited from 1 Hz to `high_hz`; `charge` and `force` are what their channels do.

    `force_noise` is the density of white noise in the force over that of the excited band, `charge_noise` in pC."""
    random = np.random.default_rng(seed)
    frequency = np.fft.rfftfreq(samples, 1 / rate_hz).astype(np.float64)
    frequency[0] = 1e-9
    excited = (frequency >= 1) & (frequency <= high_hz)
    white = RMS_N * np.sqrt(force_noise * rate_hz / (2 * high_hz))
    recordings = []
    for preload, level in _LEVELS.items():
        spectrum = excited * (random.normal(size=(2, len(frequency))).T @ [1, 1j])
        scale = RMS_N / np.std(np.fft.irfft(spectrum, samples))
        seen = np.fft.irfft(spectrum * scale * force(frequency), samples)
        answer = np.fft.irfft(level * spectrum * scale * charge(frequency), samples)
        recordings.append(
            {
                "id": f"r{preload:g}", "sensor": "s01", "indenter_radius_mm": 4, "preload_n": preload,
                "dynamic_force_n": 0.09, "sample_rate_hz": rate_hz,
                "force_n": (preload + seen + white * random.normal(size=samples)).tolist(),
                "charge_pc": (answer + charge_noise * random.normal(size=samples)).tolist(),
                **fields,
            }
        )  # fmt: skip
    document = {"schema": "campaign/1", "name": "shaken", "skin": _SKIN, "recordings": recordings}
    campaign, refused = from_dict(document)
    assert not refused
    return campaign
