"""Whether the band that d33 is averaged over is flat enough for the interval that is told."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from underskin.recordings.frf.flat_zone import FlatZone, band_average
from underskin.recordings.frf.stacks import Stack
from underskin.units import Floats

_BEYOND_NOISE = 3.0
_LEAST_CHANGE = 0.003
_OF_A_MEDIAN = 1.25  # its standard error over that of a mean


def lower_half(stacks: Sequence[Stack], zone: FlatZone, level: Floats, noise: Floats) -> str:
    """In words, by how much d33 would differ if it were of the zone's lower half, in log f; empty within the noise.

    A contact resonance above the zone raises its upper end first, and a high-pass lowers its lower end. `level` and
    `noise` (recordings,) are those of the whole zone, as `band_average` has them.
    """
    half = replace(zone, high_hz=float(np.sqrt(zone.low_hz * zone.high_hz)))
    lower, lower_noise, _ = band_average(stacks, half)
    with np.errstate(divide="ignore", invalid="ignore"):  # of a dead sensor
        change, unsure = lower / level - 1, np.hypot(noise, lower_noise) / np.abs(level)
    known = np.isfinite(change) & np.isfinite(unsure)
    if not known.any():
        return ""
    typical = float(np.median(change[known]))
    by_noise = _OF_A_MEDIAN * float(np.median(unsure[known])) / np.sqrt(known.sum())
    if abs(typical) < max(_BEYOND_NOISE * by_noise, _LEAST_CHANGE):
        return ""
    way = "higher" if typical > 0 else "lower"
    return f"; averaged over its lower half alone, d33 would be {100 * abs(typical):.1f} % {way}"
