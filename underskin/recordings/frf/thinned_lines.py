"""FRFs thinned for figures: bins of equal width in log f, of which the extremes are kept, so that no resonance is lost;
only excited lines of a force of a few sines."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from underskin.recordings.frf.flat_zone import Condition
from underskin.recordings.frf.line_choice import excited_lines
from underskin.recordings.frf.spectra import Frf, Stack, stacked
from underskin.units import Complexes, Floats, Indices, Mask, to_lab

MOST_LINES = 240  # of one recording
MOST_BINS = 80  # of a spread


@dataclass(frozen=True)
class FrfLines:
    """One recording: frequency [Hz], magnitude [pC/N], phase [°], coherence γ² (NaN where not recorded)."""

    name: str
    frequency_hz: Floats
    magnitude_pc_per_n: Floats
    phase_deg: Floats
    coherence: Floats


@dataclass(frozen=True)
class FrfSpread:
    """Recordings of one condition: lowest, median and highest value in each bin, each (bins,)."""

    indenter_radius_mm: float
    preload_n: float
    recordings: int
    frequency_hz: Floats
    magnitude_pc_per_n: tuple[Floats, Floats, Floats]
    phase_deg: tuple[Floats, Floats, Floats]
    coherence: tuple[Floats, Floats, Floats]


def lines_of(name: str, frf: Frf) -> FrfLines:
    """A recording's lines, thinned to MOST_LINES: the smallest and the largest magnitude of each bin."""
    (stack,) = stacked([frf])
    stack = _of_sines(stack.at(stack.frequency > 0))
    magnitude, phase = _polar(stack.values[0])
    chosen = _extremes(stack.frequency, magnitude)
    return FrfLines(name, stack.frequency[chosen], magnitude[chosen], phase[chosen], stack.coherence[0, chosen])


def spreads(frfs: Sequence[Frf], conditions: Sequence[Condition]) -> list[FrfSpread]:
    """The spread over the recordings of each condition (indenter and preload), separately for each grid of lines."""
    bands = []
    keys = np.array(conditions)
    for grid in stacked(frfs):
        stack = _of_sines(grid.at(grid.frequency > 0))
        for condition in np.unique(keys[stack.rows], axis=0):
            of_condition = (keys[stack.rows] == condition).all(axis=1)
            bands.append(_spread(stack, of_condition, condition))
    return sorted(bands, key=lambda spread: (spread.indenter_radius_mm, spread.preload_n))


def _spread(stack: Stack, of_condition: Mask, condition: Floats) -> FrfSpread:
    frequency, start = _bins(stack.frequency, MOST_BINS)
    magnitude, phase = _polar(stack.values[of_condition])
    columns = [_levels(part, start) for part in (magnitude, phase, stack.coherence[of_condition])]
    return FrfSpread(float(condition[0]), float(condition[1]), int(of_condition.sum()), frequency, *columns)


def _of_sines(stack: Stack) -> Stack:
    """The excited lines where they are fewer than half of those from the first to the last; else all lines."""
    if len(stack.frequency) < 2:
        return stack
    excited = excited_lines([stack], stack.frequency)
    first, last = np.flatnonzero(excited)[[0, -1]]
    return stack.at(excited) if excited.sum() < (last - first + 1) / 2 else stack


def _levels(values: Floats, start: Indices) -> tuple[Floats, Floats, Floats]:
    """Lowest, median over recordings (mean of a bin's lines), and highest of each bin; `values` (recordings, lines)."""
    low = np.minimum.reduceat(values, start, axis=1).min(axis=0)
    high = np.maximum.reduceat(values, start, axis=1).max(axis=0)
    count = np.diff([*start, values.shape[1]])
    return low, np.median(np.add.reduceat(values, start, axis=1) / count, axis=0), high


def _bins(frequency: Floats, most: int) -> tuple[Floats, Indices]:
    """The middle of each bin that holds lines, and its first line."""
    if len(frequency) <= most:
        return frequency, np.arange(len(frequency))
    edges = np.geomspace(frequency[0], frequency[-1], most + 1)[1:-1]
    start = np.unique(np.concatenate([[0], np.searchsorted(frequency, edges)]))
    start = start[start < len(frequency)]
    count = np.diff([*start, len(frequency)])
    return np.exp(np.add.reduceat(np.log(frequency), start) / count), start


def _extremes(frequency: Floats, magnitude: Floats) -> Indices:
    if len(frequency) <= MOST_LINES:
        return np.arange(len(frequency))
    _, start = _bins(frequency, MOST_LINES // 2)
    parts = np.split(np.arange(len(frequency)), start[1:])
    chosen = [part[[np.argmin(magnitude[part]), np.argmax(magnitude[part])]] for part in parts]
    return np.unique(np.concatenate(chosen))


def _polar(values: Complexes) -> tuple[Floats, Floats]:
    """Magnitude [pC/N], and phase [°] from −270 to 90: past a resonance it falls to −180, where noise must not jump."""
    phase = np.mod(np.degrees(np.angle(values)) + 270.0, 360.0) - 270.0
    return to_lab("frf_pc_per_n", np.abs(values)), phase
