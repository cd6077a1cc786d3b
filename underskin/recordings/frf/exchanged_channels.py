"""Time series whose channels of force and charge look exchanged: the charge has the mean and the oscillation that are
declared of the force, and the force has not."""

import numpy as np

from underskin.findings.codes import Reason
from underskin.findings.finding import Finding
from underskin.recordings.campaign import FrfRecording
from underskin.units import Floats

_AS_DECLARED = float(np.log(1.4))
_PARTS = 8  # of a record, of which drift is taken off; its analysis has blocks of that length
_TINY = 1e-300


def exchanged_channels(entry: FrfRecording) -> Finding | None:
    """That the two channels of a recording look exchanged, if they do."""
    if entry.force_n is None or entry.charge_pc is None:
        return None
    if not _declared(entry.charge_pc, entry) or _declared(entry.force_n, entry):
        return None
    means = {"force_mean_n": float(np.mean(entry.force_n)), "charge_mean_pc": float(np.mean(entry.charge_pc))}
    return Finding(Reason.CHANNELS_SWAPPED, entry.id, "force_n", {**means, "preload_n": entry.preload_n})


def oscillation_of(force: Floats) -> Floats:
    """√2 times the deviation of a force less its drift, and its peak [N]."""
    parts = np.arange(0, len(force), max(len(force) // _PARTS, _PARTS))
    from scipy.signal import detrend  # takes 0.3 s to load, which few need

    drift_free = detrend(force, bp=parts)
    return np.array([np.sqrt(2.0) * np.std(drift_free), np.max(np.abs(drift_free))])


def _declared(signal: Floats, entry: FrfRecording) -> bool:
    """Whether the mean of a signal is the declared preload, and what shakes it the declared dynamic force."""
    ratios = np.append(oscillation_of(signal) / entry.dynamic_force_n, np.mean(signal) / entry.preload_n)
    near = np.abs(np.log(np.maximum(ratios, _TINY))) < _AS_DECLARED
    return bool(near[:-1].any() and near[-1])
