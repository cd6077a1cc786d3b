"""Which lines of a recording's time series a diagnosis uses.

Lines where the force has little power (beside the excited band, between the lines of a periodic sweep) say next to
nothing, and their noise is unlike that of the others. Where charge follows force well, the relative standard
uncertainty √((1 − γ²)/(2nγ²)) of a line is below a fifth and below five times that of the best; elsewhere a line is
left out if the force's power is below a 25th of what it has there: the noise of an FRF goes as 1/√power, so five times
again. A line that is uncertain although the force has its power (mains, a weak response) is kept.
Neighbouring lines of tapered blocks share their noise (a Hann window's by 4/9), two apart hardly (1/36): none is kept
beside another, and the two next to 0 Hz are left out where others are enough: the straight line taken off each block
is a part of them and the window mixes them with 0 Hz, so that beside an amplifier's high-pass their FRF is wrong.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import detrend, welch

from underskin.recordings.campaign import FrfRecording
from underskin.recordings.frf_estimation import Frf
from underskin.recordings.signal_check import damaged
from underskin.units import Floats

_UNSURE, _BESIDE_BEST, _BEST = 0.2, 5.0, 0.1  # the best: this quantile
_LEAST_LINES = 8  # so that of a record of few lines all are kept
_BIASED = 2  # lines, next to 0 Hz
_MAINS_HZ, _HARMONICS = (50.0, 60.0), 5
_BETWEEN, _AROUND = 2.5, 12.5  # lines from a multiple of the mains: what is usual there
_STANDS_OUT = 10.0  # times the median power around; noise averaged over eight blocks reaches 3
_MATTERS = 0.02  # relative uncertainty of a line


@dataclass(frozen=True)
class Choice:
    """The `lines` that are used, of `measured` many; how many are left out as `faint` or `beside` others; and the
    `mains` [Hz] at a multiple of which the charge stands out and the force does not, 0 where there are none."""

    lines: list[int]
    measured: int
    faint: int = 0
    beside: int = 0
    mains: float = 0.0


def telling(entry: FrfRecording, measured: Frf) -> Choice:
    """The choice; no line where charge follows force at none."""
    uncertainty = measured.relative_uncertainty
    lines = list(range(len(measured.frequency)))
    if uncertainty is None or np.isnan(uncertainty).any():
        return Choice(lines, len(lines))
    sure = uncertainty <= min(_UNSURE, _BESIDE_BEST * float(np.quantile(uncertainty, _BEST)))
    if not sure.any():
        return Choice([], len(lines))
    size = _block_size(entry, measured)
    if not size:  # tones that the force dwells on: it has its power at each
        return Choice(lines, len(lines))
    force, charge = (_power(entry, name, measured, size) for name in ("force_n", "charge_pc"))
    powerful = force >= np.median(force[sure]) / _BESIDE_BEST**2
    strong = np.flatnonzero(sure | powerful)
    enough = len(strong) >= _LEAST_LINES
    kept = _apart(strong[strong >= _BIASED]) if enough else [int(line) for line in strong]
    mains = _mains(measured, uncertainty, force, charge)
    return Choice(kept, len(lines), len(lines) - len(strong), len(strong) - len(kept), mains)


def _apart(lines: NDArray[np.intp]) -> list[int]:
    """Those of which none is the next to another."""
    kept: list[int] = []
    for line in lines:
        if not kept or line > kept[-1] + 1:
            kept.append(int(line))
    return kept


def _block_size(entry: FrfRecording, measured: Frf) -> int:
    """The samples of the blocks that the FRF was averaged over, whose lines fill the band; 0 where it is not so."""
    assert entry.sample_rate_hz is not None
    size = round(entry.sample_rate_hz / measured.frequency[0])
    even = np.fft.rfftfreq(size, 1 / entry.sample_rate_hz)[1 : (size + 1) // 2]
    return size if len(even) == len(measured.frequency) and np.allclose(even, measured.frequency) else 0


def _power(entry: FrfRecording, name: str, measured: Frf, size: int) -> Floats:
    """Power of force or charge at the lines, damaged samples bridged."""
    signal = np.asarray(getattr(entry, name), dtype=np.float64)
    whole = ~damaged(list(measured.found), len(signal))
    bridged = np.interp(np.arange(len(signal)), np.flatnonzero(whole), signal[whole])
    power = welch(bridged, nperseg=size, detrend=detrend)[1][1 : (size + 1) // 2]
    return np.asarray(power, dtype=np.float64)


def _mains(measured: Frf, uncertainty: Floats, force: Floats, charge: Floats) -> float:
    """The mains at a multiple of which the charge that does not follow the force stands out, beyond the force."""
    assert measured.coherence is not None
    stray = charge * (1 - measured.coherence)
    found = {0.0: _STANDS_OUT}
    for mains in _MAINS_HZ:
        for multiple in mains * np.arange(1, _HARMONICS + 1):
            away = np.abs(measured.frequency - multiple) / measured.frequency[0]
            near, around = (away <= 1) & (uncertainty >= _MATTERS), (away > _BETWEEN) & (away <= _AROUND)
            if away.min() <= 1 and near.any() and around.any() and _BETWEEN * measured.frequency[0] < np.ptp(_MAINS_HZ):
                of_force = float(force[near].max() / np.median(force[around]))
                out = float(stray[near].max() / np.median(stray[around])) / max(of_force, 1.0)
                found[mains] = max(found.get(mains, 0.0), out)
    return max(found, key=lambda mains: found[mains])
