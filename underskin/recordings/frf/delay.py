"""The delay between force and charge: of two signals, and of the phases of FRFs.

Channels of two recorders, filters and the ends of converters' pipelines delay one of them by anything from a sample to
tenths of a second. Then Re FRF is no measure of the response, cos(ωτ) of it, and may have any sign.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from underskin.recordings.frf.stacks import Stack
from underskin.units import Complexes, Floats

_LARGEST = 0.25  # of a record, that a lag may be
_STANDS_OUT = 8.0  # times the rms of a correlation: noise alone reaches that once in 1e15
_AS_HIGH = 0.9  # of the highest peak: of a force that repeats itself the nearest of several
# Of a block: a lag takes (2π²/3)(lag/block)² from γ² by Hann's window, as noise of a sample in 1e5 does
_UNHARMED = 1e-3
# Of the lines' power that is in phase at the best delay: as much as this without one, and there is none
_IN_PHASE = 0.9
_EXPLAINED = 0.5  # of the lines' power, in phase at the best delay: a turn by half past a resonance leaves 0.4
_STEPS = 6  # delays that are tried for each by which the highest line turns once
_MOST_DELAYS = 8192
_CHUNK = 256  # delays at a time


def lag_between(force: Floats, charge: Floats, block: int) -> int:
    """The samples by which the charge comes late, negative where the force does.

    It is where their cross-correlation is highest, drift and preload removed; 0 where no peak stands out, and where the
    lag is so small beside a `block` (samples) that spectra over blocks do not suffer.

    Source
    ------
    Bendat and Piersol, Random Data, 4th ed., 2010, section 9.3 (bias of a coherence by a delay).
    """
    from scipy.signal import correlate, detrend  # takes 0.3 s to load, which few need

    likeness = np.abs(correlate(detrend(charge), detrend(force), method="fft"))
    lags = np.arange(len(likeness)) - (len(force) - 1)
    near = np.abs(lags) <= min(_LARGEST * len(force), len(force) - block)
    likeness, lags = likeness[near], lags[near]
    highest = float(likeness.max(initial=0.0))
    if not highest > _STANDS_OUT * float(np.sqrt(np.mean(likeness**2))):
        return 0
    peaks = lags[likeness >= _AS_HIGH * highest]
    lag = int(peaks[np.argmin(np.abs(peaks))])
    return lag if abs(lag) > _UNHARMED * block else 0


def common_delay(stacks: Sequence[Stack]) -> float:
    """The delay [s] of the charge that all recordings share, negative where the force is late.

    That which brings most lines in phase with the force, or in antiphase: the largest Σ (Re Σ w u e^(iωτ))² of the
    lines' phase factors u with weights w. It is 0 where the lines are in phase without one, but for the sign of a
    recording, or where none brings most of them in phase, as above a resonance, and of noise.
    """
    parts = [(stack, stack.weights * _phase_factors(stack.values)) for stack in stacks if len(stack.frequency) > 1]
    whole = sum(float((stack.weights.sum(axis=1) ** 2).sum()) for stack, _ in parts)
    if not whole > 0:
        return 0.0

    def in_phase(delays: Floats) -> Floats:
        return (
            sum((_power(stack.frequency, factors, delays) for stack, factors in parts), np.zeros(len(delays))) / whole
        )

    without = float(in_phase(np.zeros(1))[0])
    if without >= _IN_PHASE:
        return 0.0
    highest = max(float(stack.frequency.max()) for stack, _ in parts)
    spacing = max(float(np.median(np.diff(stack.frequency))) for stack, _ in parts)
    count = min(int(np.ceil(_STEPS * highest / spacing)), _MOST_DELAYS)
    step = 1 / (_STEPS * highest)
    delays: Floats = step * np.arange(-(count // 2), count // 2 + 1).astype(np.float64)
    for _ in range(3):
        power = in_phase(delays)
        best = delays[_nearest_peak(delays, power)]
        delays = np.asarray(best + np.arange(-_STEPS, _STEPS + 1) * (step / _STEPS), dtype=np.float64)
        step /= _STEPS
    explained = float(power.max())
    return float(best) if explained > _EXPLAINED and without < _IN_PHASE * explained else 0.0


def without_delay(stacks: Sequence[Stack], delay: float) -> list[Stack]:
    """The FRFs with that delay of the charge [s] taken off."""
    if delay == 0.0:
        return list(stacks)
    return [replace(stack, values=advanced(stack.values, stack.frequency, delay)) for stack in stacks]


def advanced(values: Complexes, frequency: Floats, delay: float) -> Complexes:
    """An FRF (…, lines) with a delay of the charge [s] taken off."""
    return np.asarray(values * np.exp(2j * np.pi * frequency * delay))


def _phase_factors(values: Complexes) -> Complexes:
    known = np.isfinite(values) & (values != 0)
    return np.where(known, np.exp(1j * np.angle(np.where(known, values, 1.0))), 0.0)


def _power(frequency: Floats, factors: Complexes, delays: Floats) -> Floats:
    """Σ over recordings of (Re Σ over lines of factors · e^(2πifτ))² at each delay."""
    return np.concatenate(
        [((factors @ np.exp(2j * np.pi * np.outer(frequency, some))).real ** 2).sum(axis=0) for some in _chunks(delays)]
    )


def _chunks(delays: Floats) -> Iterator[Floats]:
    for first in range(0, len(delays), _CHUNK):
        yield delays[first : first + _CHUNK]


def _nearest_peak(delays: Floats, power: Floats) -> int:
    """Of those nearly as high as the highest the nearest to 0: a band of few lines does not tell them apart."""
    peaks = np.flatnonzero(power >= power.max() * (1 - 1e-9))
    return int(peaks[np.argmin(np.abs(delays[peaks]))])
