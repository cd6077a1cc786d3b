"""Stepped sine: the dwells of a force on tones, and the amplitudes of force and charge over their whole cycles.

A step of a stepped sine is a run of cycles of one period between rising crossings of the middle; its frequency is
refined by the advance of the phase over the step. Amplitude X means x = Re(X e^(iωt)).
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from underskin.units import Complexes, Floats, Mask

_SAME_PERIOD = 0.05
_DRIFT = 0.025  # of the period, from a run's first half to its second: a sweep's runs drift by about 0.05
_FEWEST_CYCLES = 4
_FINE = 8  # samples a cycle
_COVERED = 0.7  # least share of the time that a stepped-sine force dwells on tones
_BLOCK = 16  # least number of samples in the whole cycles of a block of the average
_SETTLING = 0.1  # of a step, and at least one cycle: the transient after the step


@dataclass(frozen=True)
class Step:
    """Samples `first` to `last` (excluded) of a tone of `frequency` [Hz]."""

    first: int
    last: int
    frequency: float


def find_steps(force: Floats, sample_rate: float) -> list[Step]:
    """The dwells of a stepped-sine force.

    Parameters
    ----------
    force : (samples,) array
        [N].
    sample_rate : float
        [Hz].

    Returns
    -------
    list of Step
        In order of time; empty where the force does not dwell on tones for most of its time.
    """
    crossings = _rising_crossings(force)
    if len(crossings) > 1 and np.median(np.diff(crossings)) < _FINE:  # too few samples a cycle to place a crossing
        from scipy.signal import resample_poly  # takes 0.3 s to load, which few need

        crossings = _rising_crossings(resample_poly(force - np.median(force), _FINE, 1)) / _FINE
    if len(crossings) <= _FEWEST_CYCLES:
        return []
    steps = [
        Step(int(np.ceil(start)), int(end), _refined(force, start, end, cycles) * sample_rate)
        for start, end, cycles in _even_runs(crossings)
    ]
    return steps if sum(step.last - step.first for step in steps) >= _COVERED * len(force) else []


def settled(step: Step, sample_rate: float) -> int:
    """The sample from which the transient after the step has decayed."""
    return step.first + int(np.ceil(max(sample_rate / step.frequency, _SETTLING * (step.last - step.first))))


def step_amplitudes(
    force: Floats, charge: Floats, sample_rate: float, step: Step, bad: Mask
) -> tuple[Complexes, Complexes]:
    """Complex amplitudes of force and charge in each settled, undamaged block of whole cycles.

    Amplitude X of a signal x at the angular frequency ω of the step means x = Re(X e^(iωt)).

    Parameters
    ----------
    force, charge : (samples,) arrays
        [N], [C].
    sample_rate : float
        [Hz].
    step : Step
        The samples, and the frequency [Hz] that the force dwells on.
    bad : (samples,) array of bool
        Which samples are damaged.

    Returns
    -------
    force, charge : (blocks,) complex arrays
        [N], [C]; empty where no block has settled.
    """
    period = sample_rate / step.frequency
    first = settled(step, sample_rate)
    block = period * np.ceil(_BLOCK / period)
    blocks = int((step.last - first) / block)
    if blocks < 1:
        return np.empty(0, complex), np.empty(0, complex)
    edges = first + np.round(np.arange(blocks + 1) * block).astype(int)
    undamaged = np.array([not bad[a:b].any() for a, b in pairwise(edges)])
    time = np.arange(edges[0], edges[-1]) / sample_rate
    good = ~bad[edges[0] : edges[-1]]
    pair = []
    for signal in (force, charge):
        part = signal[edges[0] : edges[-1]]
        level = _level_and_drift(part, time, step.frequency, good)
        pair.append(_block_amplitudes(part - level, time, step.frequency, edges - edges[0])[undamaged])
    return pair[0], pair[1]


def _level_and_drift(signal: Floats, time: Floats, frequency: float, good: Mask) -> Floats:
    """DC and drift of a tone: the straight line of a least-squares fit of line, cosine and sine."""
    angle = 2 * np.pi * frequency * time
    line = np.column_stack([np.ones_like(time), time - time.mean()])
    basis = np.column_stack([line, np.cos(angle), np.sin(angle)])
    if good.sum() < basis.shape[1]:
        return np.zeros_like(signal)
    coefficients = np.linalg.lstsq(basis[good], signal[good], rcond=None)[0]
    return line @ coefficients[:2]


def _block_amplitudes(signal: Floats, time: Floats, frequency: float, edges: NDArray[np.int_]) -> Complexes:
    """Least squares on cosine and sine in each block."""
    angle = 2 * np.pi * frequency * time
    cosine, sine = np.cos(angle), np.sin(angle)
    sums = [
        np.add.reduceat(product, edges[:-1])
        for product in (cosine * cosine, cosine * sine, sine * sine, cosine * signal, sine * signal)
    ]
    cc, cs, ss, cx, sx = sums
    determinant = cc * ss - cs**2
    return ((ss * cx - cs * sx) - 1j * (cc * sx - cs * cx)) / determinant


def _rising_crossings(signal: Floats) -> Floats:
    """Positions (fractional samples) where the signal rises through its median, with hysteresis against noise."""
    middle = signal - np.median(signal)
    threshold = 0.3 * np.quantile(np.abs(middle), 0.9)
    state = np.where(middle > threshold, 1, np.where(middle < -threshold, -1, 0))
    marks = np.flatnonzero(state)
    rising = (state[marks[1:]] == 1) & (state[marks[:-1]] == -1)
    before, rises = marks[:-1][rising], marks[1:][rising]
    low, high = middle[before], middle[rises]
    return before + (rises - before) * low / (low - high)


def _even_runs(crossings: Floats) -> list[tuple[float, float, int]]:
    """First and last crossing and number of cycles of each run of nearly equal periods."""
    places = crossings.tolist()
    runs, start = [], 0
    for index in range(1, len(places)):
        if index + 1 < len(places):
            mean = (places[index] - places[start]) / (index - start)
            if abs(places[index + 1] - places[index] - mean) < _SAME_PERIOD * mean:
                continue
        if index - start >= _FEWEST_CYCLES and not _drifts(places[start : index + 1]):
            runs.append((places[start], places[index], index - start))
        start = index
    return runs


def _drifts(crossings: list[float]) -> bool:
    """Whether the period changes over a run, as in a sweep, which dwells on no tone."""
    half = len(crossings) // 2
    first, second = crossings[half] - crossings[0], crossings[-1] - crossings[-1 - half]
    return abs(second - first) > _DRIFT * first


def _refined(signal: Floats, start: float, end: float, cycles: int) -> float:
    """Cycles per sample by the phase of the second half of a run relative to the first."""
    frequency = cycles / (end - start)
    samples = np.arange(int(np.ceil(start)), int(end))
    size = int(cycles // 2 / frequency)
    if size < _BLOCK:
        return frequency
    phases = []
    for part in (samples[:size], samples[-size:]):
        values = signal[part] - signal[part].mean()
        phases.append(values @ (np.hanning(len(part)) * np.exp(-2j * np.pi * frequency * part)))
    advance = np.angle(phases[1] / phases[0])
    return float(frequency + advance / (2 * np.pi * (samples[-size] - samples[0])))
