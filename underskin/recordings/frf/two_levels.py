"""Whether the lines of an FRF lie at two levels, as of two ranges of an amplifier during a sweep.

Neighbouring lines, twelve or all of at least ten, are split in two at a gap of their sorted ln |FRF|. They are of two
levels where all but one lie near the median of their half: within a tenth of the difference of the medians, of which
their usual distance is a twentieth. A law that falls or rises over them, a filter's or a resonance's, spreads its lines
over the range between; noise made one of 15,000 drawn recordings so. Where lines are many, neighbours are also taken at
every second, fourth, … line: the spectra of overlapping blocks blend at a step.
"""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from underskin.units import Complexes, Floats, Mask

_NEIGHBOURS, _FEWEST, _FEWEST_AT_LEVEL = 12, 10, 4  # lines
_FAR, _USUAL = 0.1, 0.05  # of the difference of both levels
_LEAST, _MOST_SCATTER = float(np.log(1.05)), 0.1  # difference of both levels; scatter beyond which neither is one


@dataclass(frozen=True)
class TwoLevels:
    """The level of the higher lines over that of the lower ones as `factor`; of a step `low_hz` and `high_hz`, between
    which it lies, and whether it `rises`; where the levels alternate the range of the lines in which they do."""

    factor: float
    low_hz: float
    high_hz: float
    is_step: bool
    rises: bool


def two_levels(frequency: Floats, values: Complexes, used: Mask) -> TwoLevels | None:
    """The two levels of the used lines (lines,) in order of frequency; None where they have no such two."""
    lines = np.flatnonzero(used & np.isfinite(values) & (values != 0) & (frequency > 0))
    size = np.log(np.abs(values[lines])) if len(lines) else np.zeros(0)
    spacing, found = 1, None
    while found is None and len(size[::spacing]) >= _FEWEST:
        found = _at_neighbours(frequency[lines][::spacing], size[::spacing])
        spacing *= 2
    return found


def _at_neighbours(frequency: Floats, size: Floats) -> TwoLevels | None:
    """Those of the neighbours at which the levels differ most beyond their scatter."""
    windows = sliding_window_view(size, min(_NEIGHBOURS, len(size)))
    ordered = np.sort(windows, axis=1)
    best = (0.0, 0, 0)
    for below in range(_FEWEST_AT_LEVEL, windows.shape[1] - _FEWEST_AT_LEVEL + 1):
        halves = ordered[:, :below], ordered[:, below:]
        low, high = (np.median(half, axis=1) for half in halves)
        step = np.maximum(high - low, 1e-12)
        away = np.abs(np.concatenate([halves[0] - low[:, None], halves[1] - high[:, None]], axis=1))
        scatter = 1.4826 * np.median(away, axis=1)
        alike = (away <= _FAR * step[:, None]).sum(axis=1) >= windows.shape[1] - 1
        alike &= (step >= _LEAST) & (scatter <= np.minimum(_USUAL * step, _MOST_SCATTER))
        quality = np.where(alike, step / np.maximum(scatter, 1e-6), 0.0)
        index = int(np.argmax(quality))
        if quality[index] > best[0]:
            best = float(quality[index]), index, below
    _, first, below = best
    if not below:
        return None
    window, hertz = windows[first], frequency[first : first + windows.shape[1]]
    lower, higher = (float(np.median(half)) for half in np.split(ordered[first], [below]))
    is_high = window > (lower + higher) / 2
    near = np.minimum(np.abs(window - lower), np.abs(window - higher)) <= _FAR * (higher - lower)
    changes = np.flatnonzero(np.diff(is_high[near]))
    is_step = len(changes) == 1
    at = hertz[near][changes[0] : changes[0] + 2] if is_step else hertz[[0, -1]]
    factor = float(np.exp(higher - lower))
    return TwoLevels(factor, float(at[0]), float(at[1]), is_step, bool(is_high[near][-1]))
