"""What the force of a time series contradicts: slips of units that an FRF hides, and channels that were exchanged.

The force's mean is the preload, unless a coupling took it away, and what shakes it the dynamic force, about: its peak
for sines and blows, √2 times its deviation for sines and noise. Drift (a preload that relaxes) is no shaking: the
straight line through each eighth of the record is taken off.
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import detrend

from underskin.recordings.campaign import FrfRecording
from underskin.units import Floats

_SLIP, _WITHIN = 1000.0, 30.0
_CLEAR = 3.0  # standard deviations that a force's mean must be from 0 to be a preload, not what a coupling left
_AS_DECLARED = float(np.log(1.4))
_PARTS = 8  # of a record, of which drift is taken off; its analysis has blocks of that length
_TINY = 1e-300


@dataclass(frozen=True)
class Slip:
    """The `field` that is off by what the force itself says, how that is said, in which unit it may be, and the
    finding's `code`."""

    field: str
    statement: str
    unit: str
    code: str = "units_off_by_1000"


def slip_of(entry: FrfRecording) -> Slip | None:
    """What the force itself contradicts."""
    if entry.force_n is None or entry.charge_pc is None:
        return None
    if _declared(entry.charge_pc, entry) and not _declared(entry.force_n, entry):
        text = (
            f"its mean is {np.mean(entry.force_n):.3g} N, and that of charge_pc {np.mean(entry.charge_pc):.3g}, where "
            f"preload_n is {entry.preload_n:g}: force and charge look exchanged"
        )
        return Slip("force_n", f"{text}.", "", "channels_swapped")
    mean, scatter = float(np.mean(entry.force_n)), float(np.std(entry.force_n))
    shaken = _shaking(entry.force_n) / entry.dynamic_force_n
    agrees = any(_near(one, 1.0) for one in shaken)
    nearest = shaken[int(np.argmin(np.abs(np.log(np.maximum(shaken, 1e-300)))))] * entry.dynamic_force_n
    pressed = abs(mean) / entry.preload_n if abs(mean) > _CLEAR * scatter else None
    for factor, own, other in ((_SLIP, "mN", "kN"), (1 / _SLIP, "kN", "mN")):
        word, opposite = ("large", "small") if factor > 1 else ("small", "large")
        off = any(_near(one, factor) for one in shaken)
        if off and (not agrees if pressed is None else _near(pressed, factor)):
            text = f"it is shaken by {nearest:.3g} N, where dynamic_force_n is {entry.dynamic_force_n:g}"
            return Slip("force_n", f"{text}: it looks 1000 × too {word}; was it given in {own}?", own)
        if off and not agrees and pressed is not None and _near(pressed, 1.0):
            text = f"{entry.dynamic_force_n:g} N looks 1000 × too {opposite} beside the recorded force"
            return Slip("dynamic_force_n", f"{text}: was it given in {other}?", other)
        if agrees and pressed is not None and _near(pressed, factor):
            text = f"{entry.preload_n:g} N looks 1000 × too {opposite} beside the recorded force's mean of {mean:.3g} N"
            return Slip("preload_n", f"{text}: was it given in {other}?", other)
    return None


def _shaking(force: Floats) -> Floats:
    """√2 times the deviation of a force less its drift, and its peak [N]."""
    parts = np.arange(0, len(force), max(len(force) // _PARTS, _PARTS))
    oscillation = detrend(force, bp=parts)
    return np.array([np.sqrt(2.0) * np.std(oscillation), np.max(np.abs(oscillation))])


def _near(ratio: float, factor: float) -> bool:
    return factor / _WITHIN < ratio < factor * _WITHIN


def _declared(signal: Floats, entry: FrfRecording) -> bool:
    """Whether the mean of a signal is the declared preload, and what shakes it the declared dynamic force."""
    ratios = np.append(_shaking(signal) / entry.dynamic_force_n, np.mean(signal) / entry.preload_n)
    near = np.abs(np.log(np.maximum(ratios, _TINY))) < _AS_DECLARED
    return bool(near[:-1].any() and near[-1])
