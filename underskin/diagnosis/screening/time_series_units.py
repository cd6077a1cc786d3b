"""Contradictions between the force of a time series and what is declared: slips of units, and exchanged channels.

The mean of the force is the preload, unless an AC coupling removed it. Its oscillation is the dynamic force, about: the
peak for sines and blows, √2 times the standard deviation for sines and noise. Drift (a preload that relaxes) is not
oscillation: the straight line through each eighth of the record is removed.
"""

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf.exchanged_channels import exchanged_channels, oscillation_of
from underskin.recordings.frf.signal_checks import mean_of

_SLIP, _WITHIN = 1000.0, 30.0


def contradiction_of(entry: FrfRecording) -> Finding | None:
    """What the force of a recording contradicts, if anything."""
    if entry.force_n is None or entry.charge_pc is None:
        return None
    mean = float(np.mean(entry.force_n))
    preload = mean_of(entry.force_n)
    if (exchanged := exchanged_channels(entry)) is not None:
        return exchanged
    oscillation = oscillation_of(entry.force_n) / entry.dynamic_force_n
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


def _near(ratio: float, factor: float) -> bool:
    return factor / _WITHIN < ratio < factor * _WITHIN
