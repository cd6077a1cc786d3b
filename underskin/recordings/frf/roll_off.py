"""Whether the band that d33 is averaged over lies behind a high-pass or a low-pass: what its level is of the plateau's.

The magnitude over frequency, gathered in bins over all recordings, is fitted by a plateau with a slight power law (a
sensor's relaxation) and two filters,
    ln |FRF| = a − n ln f − ½ ln(1 + (f1/f)²) − (m/2) ln(1 + (f/f2)^(2k)),   0 ≤ n ≤ `STEEPEST`,
up to where a resonance lifts it. A filter counts where it explains the fall and the plateau lies beyond the band: then
the band's average is no d33, however flat the band is.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from underskin.recordings.frf.excitation import bin_of, edges_over
from underskin.recordings.frf.flat_zone import STEEPEST, FlatZone
from underskin.recordings.frf.stacks import Stack
from underskin.units import Floats

_FEWEST_BINS = 6
_CORNERS = 60  # of each filter, that are tried
_BELOW, _ABOVE = 30.0, 10.0  # times the band's ends: how far off corners are tried
_LOW_PASSES = ((1, 1), (2, 1), (4, 1), (1, 2), (2, 2), (1, 4))  # k and m: Butterworth's of order k, m times in a row
_ONE_POLE = (1, 1)
_SLOPES = np.linspace(0.0, STEEPEST, 6)
_LEAST_NOISE = 0.003  # of a bin's magnitude
_SEVERAL, _USUAL_NOISE = 4, 0.02  # lines of a bin that tell their scatter, and one where none does
_LIFTED = 1.05  # of the plateau: a resonance
_LEAST_SHARE = 0.02  # of the plateau, that is worth saying
_SPEAKS = 25.0  # χ² that a filter must explain
_EXPLAINED = 0.2  # of the rms about a plateau, that may be left


@dataclass(frozen=True)
class RollOff:
    """The corners [Hz] of the filters, 0 and ∞ where there is none, and by how much the band's level lies below the
    plateau, as a share of that."""

    high_pass_hz: float
    low_pass_hz: float
    share: float


def roll_off(stacks: Sequence[Stack], zone: FlatZone, level: Floats) -> RollOff | None:
    """The filters that the band lies behind; None where it reaches their plateau. `level` (recordings,) is the average
    over the zone [C/N]."""
    frequency, magnitude, noise = _curve(stacks, level)
    inside = (frequency >= zone.low_hz) & (frequency <= zone.high_hz)
    lifted = np.flatnonzero(magnitude > _LIFTED * np.median(magnitude[inside])) if inside.any() else np.zeros(0, int)
    lifted = lifted[frequency[lifted] > zone.high_hz]
    if len(lifted) and not _falls_after(magnitude, int(lifted[0])):
        lifted = lifted[:0]  # a high-pass that goes on rising
    end = int(lifted[0]) if len(lifted) else len(frequency)
    if end < _FEWEST_BINS:
        return None
    x, y, weight = np.log(frequency[:end]), np.log(magnitude[:end]), noise[:end] ** -2.0
    plain = _fitted(x, y, weight, 0.0, np.inf)
    if plain[0] < _SPEAKS:
        return None
    highs = [0.0, *np.geomspace(frequency[0] / _BELOW, frequency[end - 1] * _ABOVE, _CORNERS).tolist()]
    lows = [np.inf, *np.geomspace(frequency[0] / _ABOVE, frequency[end - 1] * _BELOW, _CORNERS).tolist()]
    single = [(high, np.inf, _ONE_POLE) for high in highs] + [
        (0.0, low, order) for low in lows for order in _LOW_PASSES
    ]
    best = min(single, key=lambda one: _fitted(x, y, weight, *one)[0])
    in_order = [(high, low, _ONE_POLE) for high, low in product(highs[1::2], lows[1::2]) if high < low]
    both = min(in_order, key=lambda one: _fitted(x, y, weight, *one)[0])
    if _fitted(x, y, weight, *best)[0] - _fitted(x, y, weight, *both)[0] > _SPEAKS:
        best = both
    misfit, plateau = _fitted(x, y, weight, *best)
    share = 1 - float(np.exp(-plateau))
    is_explained = plain[0] - misfit >= _SPEAKS and misfit <= _EXPLAINED**2 * plain[0] + len(x)
    return RollOff(best[0], best[1], share) if is_explained and share >= _LEAST_SHARE else None


def _falls_after(magnitude: Floats, place: int) -> bool:
    """Whether the magnitude has a peak beyond a place rather than a plateau."""
    return bool(magnitude[-1] < 0.8 * magnitude[place:].max())


def _fitted(
    x: Floats, y: Floats, weight: Floats, high: float, low: float, kind: tuple[int, int] = _ONE_POLE
) -> tuple[float, float]:
    """χ² of the best plateau and slope with these corners and this kind of low-pass (k, m), and the logarithm of the
    plateau where the slope is that of none: at the band's middle."""
    frequency = np.exp(x)
    order, times = kind
    filters = -0.5 * (np.log1p((high / frequency) ** 2) + times * np.log1p((frequency / low) ** (2 * order)))
    laws = filters - np.outer(_SLOPES, x - x.mean())
    plateaus = (weight * (y - laws)).sum(axis=1) / weight.sum()
    misfits = (weight * (y - laws - plateaus[:, None]) ** 2).sum(axis=1)
    best = int(np.argmin(misfits))
    return float(misfits[best]), float(plateaus[best])


def _curve(stacks: Sequence[Stack], level: Floats) -> tuple[Floats, Floats, Floats]:
    """Of bins of equal width in ln f that hold lines with a magnitude: the middle [Hz], the median over recordings of
    the magnitude over their level, and its relative noise."""
    lines = [stack.frequency[stack.used.any(axis=0)] for stack in stacks]
    edges = edges_over(np.unique(np.concatenate(lines)))
    ratios: list[list[float]] = [[] for _ in edges[1:]]
    spreads: list[list[tuple[float, int]]] = [[] for _ in edges[1:]]
    for stack in stacks:
        bins = bin_of(stack.frequency, edges)
        for row, number in enumerate(stack.rows.tolist()):
            if not (np.isfinite(level[number]) and level[number] != 0):
                continue
            size = np.abs(stack.values[row]) / abs(level[number])
            for place in np.unique(bins[stack.used[row]]).tolist():
                of_bin = size[stack.used[row] & (bins == place)]
                ratios[place].append(float(np.median(of_bin)))
                spreads[place].append((float(np.std(of_bin)), len(of_bin)))
    known = [place for place, of_bin in enumerate(ratios) if of_bin and np.median(of_bin) > 0]
    middle = np.sqrt(edges[1:] * edges[:-1])[known]
    magnitude = np.array([float(np.median(ratios[place])) for place in known])
    several = [deviation for of_bin in spreads for deviation, count in of_bin if count >= _SEVERAL]
    usual = float(np.median(several)) if several else _USUAL_NOISE
    noise = np.array([_noise_of(spreads[place], usual) for place in known])
    return middle, magnitude, np.maximum(noise / magnitude, _LEAST_NOISE)


def _noise_of(spreads: Sequence[tuple[float, int]], usual: float) -> float:
    """Of a median over recordings, by the standard deviation and number of their lines in a bin; a bin of few lines has
    the `usual` deviation at least."""
    each = [max(deviation, usual if count < _SEVERAL else 0.0) / count**0.5 for deviation, count in spreads]
    return 1.25 * float(np.median(each)) / len(each) ** 0.5
