"""Why a flat zone ends where it does, in words that a lab checks against its own plots."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from underskin.units import Floats

_PEAK = 1.3  # over the level: a resonance to be named
_NOT_EXCITED = "it was not excited: the charge hardly follows the force (low coherence), or the FRF is 0 there"


@dataclass(frozen=True)
class Idle:
    """Whether lines below a zone and above it were not excited, and how many inside it."""

    below: bool
    above: bool
    inside: int


def reason_of(
    low_hz: float,
    high_hz: float,
    middle_hz: Floats,
    curves: Floats,
    conditions: Sequence[tuple[float, float]],
    bins: tuple[int, int],
    slope: float,
    left_out_hz: Sequence[float],
    idle: Idle,
) -> str:
    """The reason for a zone over `bins` (first, last) of the `curves` (conditions and all, bins) over `middle_hz`."""
    first, last = bins
    departure = curves / levels_of(curves[:, first : last + 1]) - 1
    parts = [f"{low_hz:.4g} to {high_hz:.4g} Hz: no resonance in any recording"]
    if last + 1 < len(middle_hz):
        parts.append(_above(high_hz, middle_hz, departure, conditions, last))
    elif idle.above:
        parts.append(f"above {high_hz:.4g} Hz {_NOT_EXCITED}")
    if first > 0:
        parts.append(_below(low_hz, float(departure[-1, first - 1])))
    elif idle.below:
        parts.append(f"below {low_hz:.4g} Hz {_NOT_EXCITED}")
    if first == 0 and last + 1 == len(middle_hz) and not (idle.below or idle.above):
        parts.append("it is the whole recorded range")
    if abs(slope) > 0.005:
        parts.append(f"inside, all recordings fall alike, by {100 * (1 - 10**slope):.1f} % a decade")
    if idle.inside:
        parts.append(f"{idle.inside} lines inside it were not excited (low coherence) and are left out")
    if left_out_hz:
        parts.append(f"lines left out as mains pick-up: {', '.join(f'{line:g}' for line in left_out_hz)} Hz")
    return "; ".join(parts)


def levels_of(curves: Floats) -> Floats:
    """The mean of each curve over the bins that it has, (curves, 1); NaN where it has none."""
    filled = np.isfinite(curves).sum(axis=1, keepdims=True)
    return np.nansum(curves, axis=1, keepdims=True) / np.where(filled, filled, np.nan)


def _above(
    high_hz: float, middle_hz: Floats, departure: Floats, conditions: Sequence[tuple[float, float]], last: int
) -> str:
    beyond = departure[:-1, last + 1 :]
    peaks = {
        number: float(middle_hz[last + 1 + int(np.nanargmax(row))])
        for number, row in enumerate(beyond)
        if np.isfinite(row).any() and np.nanmax(row) > _PEAK - 1
    }
    if peaks:
        lowest, highest = min(peaks, key=lambda number: peaks[number]), max(peaks.values())
        radius, preload = conditions[lowest]
        where = f"{peaks[lowest]:.3g} Hz" + (
            f" to {highest:.3g} Hz, moving with the contact" if highest > 1.2 * peaks[lowest] else ""
        )
        return (
            f"above, the response rises to a resonance (peak at {where}; lowest with the sphere of {radius:g} mm "
            f"radius at {preload:g} N)"
        )
    side = "rises" if float(departure[-1, last + 1]) > 0 else "falls"
    return f"above {high_hz:.4g} Hz the response {side} or scatters by more than 2 %, without a peak in range"


def _below(low_hz: float, departure: float) -> str:
    if departure < 0:
        return f"below {low_hz:.4g} Hz the response falls off, as behind a high-pass"
    return f"below {low_hz:.4g} Hz the response rises"
