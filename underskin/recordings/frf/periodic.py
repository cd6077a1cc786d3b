"""Periodic forces: a sweep, a burst or noise that begins anew, over and over.

Force and charge then have lines at the multiples of 1/T, T the period, and nothing between. Hann's window over two
periods gives each of them exactly: the window mixes a line with those half a line away alone, which are empty (Pintelon
and Schoukens, System Identification, 2012, chapter 2). A straight line fitted to a block would take a part of the force
with it, another one of the charge, and leave their ratio wrong at the lowest lines; the means of the two periods, which
are equal but for the drift, tell the drift alone.
"""

import numpy as np
from scipy.ndimage import uniform_filter1d

from underskin.units import Floats

_FEWEST_PERIODS = 4
_LEAST_SAMPLES = 16  # of a period
_PARTS = 8  # of a record: the mean over one is taken for drift where likeness is asked for
_ALIKE = 0.9  # correlation of one period with each later one
_AS_GOOD = 0.002  # of the correlation: the shortest of the periods that are as good as the best
_ROUNDING = 1e-9  # of the force, that a constant one may seem to move by
_DIP = 0.5  # a correlation below this ends the likeness of neighbouring samples


def period_of(force: Floats) -> int:
    """The samples after which a force repeats itself, at least four times in all; 0 where it does not."""
    samples = len(force)
    longest = samples // _FEWEST_PERIODS
    if longest < _LEAST_SAMPLES:
        return 0
    width = samples // _PARTS
    steady = (force - uniform_filter1d(force, width))[width:-width]  # filtered alike everywhere: as periodic as before
    power = float(np.mean(steady**2))
    if power <= (_ROUNDING * float(np.abs(force).max())) ** 2:
        return 0
    lags = np.arange(len(steady) // 2 + 1)
    from scipy.signal import correlate  # takes 0.3 s to load, which few need

    products = correlate(steady, steady, method="fft")[len(steady) - 1 :]
    likeness = products[: len(lags)] / (len(steady) - lags) / power
    dips = np.flatnonzero(likeness < _DIP)
    first = max(_LEAST_SAMPLES, int(dips[0])) if len(dips) else longest + 1
    if first > longest:
        return 0
    least = max(_ALIKE, likeness[first : longest + 1].max() - _AS_GOOD)
    lag = np.arange(first, min(longest + 1, len(likeness) - 1))
    peak = (likeness[lag] >= least) & (likeness[lag] >= likeness[lag - 1]) & (likeness[lag] >= likeness[lag + 1])
    return next((int(period) for period in lag[peak] if likeness[period::period].min() > _ALIKE), 0)


def without_drift(blocks: Floats) -> Floats:
    """Blocks of two periods (blocks, samples) less their mean and the drift from the first period to the second."""
    period = blocks.shape[1] // 2
    first, second = blocks[:, :period].mean(axis=1), blocks[:, period:].mean(axis=1)
    time = (np.arange(blocks.shape[1]) - (blocks.shape[1] - 1) / 2) / period
    return np.asarray(blocks - ((first + second) / 2)[:, None] - (second - first)[:, None] * time)
