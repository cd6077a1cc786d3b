"""The resonance that the magnitude of an FRF shows.

Of a mass on a spring, 1/(1 − r² + 2iζr) with r = f/f0, the inverse square magnitude (1 − r²)² + 4ζ²r² is quadratic in
f²: a line through three unknowns, whatever turns the phase beside the resonance (Ewins, Modal Testing, 2nd ed., 2000,
section 4.2, has the same of the complex inverse).
"""

from typing import NamedTuple

import numpy as np

from underskin.recordings.frf.estimation import Frf

_STANDS_OUT = 2.0  # times the median magnitude
_FEWEST, _WIDTH = 7, 0.4  # lines around the highest, or all within that share of its frequency
_LEAST_DAMPING = 1e-3


class Resonance(NamedTuple):
    """Natural frequency [Hz] and damping ratio ζ."""

    frequency: float
    damping: float


def resonance(frf: Frf) -> Resonance | None:
    """That of the highest finite line, where one stands out within the band; None where none does."""
    finite = np.isfinite(frf.values)
    if not finite.any():
        return None
    frequency, size = frf.frequency[finite], np.abs(frf.values[finite])
    peak = int(np.argmax(size))
    if not 0 < peak < len(size) - 1 or size[peak] < _STANDS_OUT * np.median(size):
        return None
    away = np.abs(frequency - frequency[peak])
    near = away <= max(_WIDTH * frequency[peak], np.sort(away)[min(_FEWEST, len(away)) - 1])
    square = (frequency[near] / frequency[peak]) ** 2
    relative = size[near] / size[peak]
    # Σ w (1/|y|² − a − b f² − c f⁴)² with w ∝ |y|⁶, as noise of one size on all lines has it.
    columns = np.stack([np.ones_like(square), square, square**2]) * relative**3
    a, b, c = np.linalg.lstsq(columns.T, relative, rcond=None)[0]
    if not (a > 0 and c > 0):
        return None
    natural = (a / c) ** 0.25
    damping = 0.5 * np.sqrt(max(b / np.sqrt(a * c) + 2, 0.0))
    return Resonance(float(frequency[peak] * natural), float(max(damping, _LEAST_DAMPING)))
