"""Contradictions between the force of a time series and what is declared: slips of units, and exchanged channels.

The mean of the force is the preload, unless an AC coupling removed it. Its oscillation is the dynamic force, about: the
peak for sines and blows, √2 times the standard deviation for sines and noise. Drift (a preload that relaxes) is not
oscillation: the straight line through each eighth of the record is removed.
"""

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.signal_checks import mean_of
from underskin.units import Floats

_SLIP, _WITHIN = 1000.0, 30.0
_AS_DECLARED = float(np.log(1.4))
_PARTS = 8  # of a record, of which drift is taken off; its analysis has blocks of that length
_TINY = 1e-300


def contradiction_of(entry: FrfRecording) -> Finding | None:
    """What the force of a recording contradicts, if anything."""
    if entry.force_n is None or entry.charge_pc is None:
        return None
    mean = float(np.mean(entry.force_n))
    preload = mean_of(entry.force_n)
    if _declared(entry.charge_pc, entry) and not _declared(entry.force_n, entry):
        means = {"force_mean_n": mean, "charge_mean_pc": float(np.mean(entry.charge_pc))}
        return Finding(Reason.CHANNELS_SWAPPED, entry.id, "force_n", {**means, "preload_n": entry.preload_n})
    oscillation = _oscillation(entry.force_n) / entry.dynamic_force_n
    agrees = any(_near(one, 1.0) for one in oscillation)
    nearest = oscillation[int(np.argmin(np.abs(np.log(np.maximum(oscillation, 1e-300)))))] * entry.dynamic_force_n
    pressed = None if preload is None else abs(preload) / entry.preload_n
    for factor, own, other in ((_SLIP, "mN", "kN"), (1 / _SLIP, "kN", "mN")):
        off = any(_near(one, factor) for one in oscillation)
        dynamic_force = {"dynamic_force_n": entry.dynamic_force_n}
        if off and (not agrees if pressed is None else _near(pressed, factor)):
            arguments = {"oscillation_n": float(nearest), **dynamic_force, "too_large": factor > 1, "given_in": own}
            return Finding(Reason.SERIES_FORCE, entry.id, "force_n", arguments)
        if off and not agrees and pressed is not None and _near(pressed, 1.0):
            arguments = {**dynamic_force, "too_large": factor < 1, "given_in": other}
            return Finding(Reason.SERIES_DYNAMIC_FORCE, entry.id, "dynamic_force_n", arguments)
        if agrees and pressed is not None and _near(pressed, factor):
            arguments = {"preload_n": entry.preload_n, "mean_n": mean, "too_large": factor < 1, "given_in": other}
            return Finding(Reason.SERIES_PRELOAD, entry.id, "preload_n", arguments)
    return None


def _oscillation(force: Floats) -> Floats:
    """√2 times the deviation of a force less its drift, and its peak [N]."""
    parts = np.arange(0, len(force), max(len(force) // _PARTS, _PARTS))
    from scipy.signal import detrend  # takes 0.3 s to load, which few need

    drift_free = detrend(force, bp=parts)
    return np.array([np.sqrt(2.0) * np.std(drift_free), np.max(np.abs(drift_free))])


def _near(ratio: float, factor: float) -> bool:
    return factor / _WITHIN < ratio < factor * _WITHIN


def _declared(signal: Floats, entry: FrfRecording) -> bool:
    """Whether the mean of a signal is the declared preload, and what shakes it the declared dynamic force."""
    ratios = np.append(_oscillation(signal) / entry.dynamic_force_n, np.mean(signal) / entry.preload_n)
    near = np.abs(np.log(np.maximum(ratios, _TINY))) < _AS_DECLARED
    return bool(near[:-1].any() and near[-1])
