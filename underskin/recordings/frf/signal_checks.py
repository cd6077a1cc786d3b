"""Defects of a sampled signal: overload (clipping), held samples and jumps.

The blocks that a defect touches are left out of the FRF, and the rest is used.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from underskin.findings.arguments import DefectKind
from underskin.recordings.frf.periodic import period_of
from underskin.units import Floats, Mask

_CLIPPED_RUN = 3  # samples in a row at the extreme value
_CLIPPED_RATIO = 5.0  # a quantised sine's top level holds at most 1/(√2 − 1) = 2.4 times the samples of the next
_HELD_RUN = 5  # samples in a row of one value
_COARSE = 0.2  # share of samples that equal the one before, above which the levels are coarse
_ONE_LEVEL = 1.5
_BY_CHANCE = 1e-3  # runs as long in the whole signal
_JUMP = 12.0  # second difference over its scale among neighbours; a sine stays below 1.5, noise below 6
_BLOW, _RINGING = 20.0, 6.0  # kurtosis; a sine has 1.5, noise 3, a hammer's blow hundreds, what rings after it tens
_AS_SHARP = 0.5  # of a jump: the bend at its place in the next period, where a periodic signal begins anew
_GIVE_OR_TAKE = 2  # samples: a period need not be a whole number of them
_CLEAR = 3.0  # standard deviations from 0
_LOCAL = 64  # samples that make a neighbourhood


@dataclass(frozen=True)
class Defect:
    """A run of `samples` from `first_sample` of a `channel` that cannot be trusted."""

    kind: DefectKind
    channel: str
    samples: int
    first_sample: int


def mean_of(force: Floats) -> float | None:
    """The mean of a force where it is a preload; None where an AC coupling may have removed that.

    Then the mean lies within three standard deviations of 0.
    """
    mean, scatter = float(np.mean(force)), float(np.std(force))
    return mean if abs(mean) > _CLEAR * scatter else None


def defects_of_pair(force: Floats, charge: Floats) -> list[Defect]:
    """Every defect of force and charge.

    Jumps are no defects where the force is a blow that the charge answers, nor where a periodic force, such as a sweep,
    begins anew: these recur in each period.
    """
    every = [*defects("force_n", force), *defects("charge_pc", charge)]
    if _kurtosis(force) > _BLOW and _kurtosis(charge) > _RINGING:
        return [defect for defect in every if defect.kind != DefectKind.JUMP]
    if all(defect.kind != DefectKind.JUMP for defect in every):
        return every
    period = period_of(force)
    recurs = {name: _recurs(signal, period) for name, signal in (("force_n", force), ("charge_pc", charge))}
    return [
        defect for defect in every if defect.kind != DefectKind.JUMP or not recurs[defect.channel][defect.first_sample]
    ]


def _recurs(signal: Floats, period: int) -> Mask:
    """Where a signal bends as sharply a period before or after; nowhere without a period."""
    bend = np.pad(np.abs(np.diff(signal, n=2)), 1)
    if not period:
        return np.zeros(len(signal), dtype=bool)
    around = maximum_filter1d(bend, 2 * _GIVE_OR_TAKE + 1)
    before, after = np.zeros((2, len(signal)))
    before[period:], after[:-period] = around[:-period], around[period:]
    return np.asarray(np.maximum(before, after) > _AS_SHARP * bend)


def _kurtosis(signal: Floats) -> float:
    centred = signal - signal.mean()
    power = float(np.mean(centred**2))
    return float(np.mean(centred**4)) / power**2 if power > 0 else 0.0


def defects(channel: str, signal: Floats) -> list[Defect]:
    """Every defect of a signal, in order of its kind.

    Dropped samples are seen as a held value, or as a jump where the signal is sampled finely enough to be smooth. Fewer
    than three samples show none.
    """
    if len(signal) < 3:
        return []
    clipped = _overload(signal)
    held = _held(signal) & ~clipped
    jump = _jumps(signal) & ~clipped & ~held
    kinds = ((DefectKind.OVERLOAD, clipped), (DefectKind.HELD_SAMPLES, held), (DefectKind.JUMP, jump))
    return [Defect(kind, channel, count, first) for kind, mask in kinds for first, count in _runs(mask)]


def damaged(every: list[Defect], samples: int) -> Mask:
    """Which of the samples any of the defects touches."""
    mask = np.zeros(samples, dtype=bool)
    for defect in every:
        mask[defect.first_sample : defect.first_sample + defect.samples] = True
    return mask


def _overload(signal: Floats) -> Mask:
    mask = np.zeros(len(signal), dtype=bool)
    levels, counts = np.unique(signal, return_counts=True)
    if len(levels) < 3:
        return mask
    for end, neighbour in ((0, 1), (-1, -2)):
        if counts[end] > _CLIPPED_RATIO * counts[neighbour]:
            for first, count in _runs(signal == levels[end]):
                if count >= _CLIPPED_RUN:
                    mask[first : first + count] = True
    return mask


def _held(signal: Floats) -> Mask:
    """Runs of one value that end in more than one level's step (a slow signal turns on one level); where levels are so
    coarse that neighbours are alike by chance, those that end in a leap."""
    step = np.abs(np.diff(signal))
    same = np.concatenate([[False], step == 0])
    mask = np.zeros(len(signal), dtype=bool)
    usual, width = float(same.mean()), 2 * _LOCAL + 1
    around = uniform_filter1d(same.astype(float), width)
    level, leap = float(step[step > 0].min(initial=np.inf)), 2 * np.quantile(step, 0.999)
    for first, count in _runs(same):
        after = step[first + count - 1] if first + count < len(signal) else 2 * level
        alike = max(usual, around[first + count // 2] - count / width)
        by_chance = usual > _COARSE or len(signal) * alike**count > _BY_CHANCE
        if count >= _HELD_RUN - 1 and after > (leap if by_chance else _ONE_LEVEL * level):
            mask[first - 1 : first + count] = True
    return mask


def _jumps(signal: Floats) -> Mask:
    mask = np.zeros(len(signal), dtype=bool)
    bend = np.abs(np.diff(signal, n=2))
    # In parts of two lengths, so that they are taken at once: a long series has some ten thousand.
    length, longer = divmod(len(bend), max(1, len(bend) // _LOCAL))
    parts = np.split(bend, [longer * (length + 1)])
    sizes = (length + 1, length)
    medians = [np.median(part.reshape(-1, size), axis=1) for part, size in zip(parts, sizes, strict=True)]
    usual = 1.4826 * np.concatenate(medians)
    around = np.max([np.roll(usual, shift) for shift in (-1, 0, 1)], axis=0)
    scale = np.repeat(around, np.repeat(sizes, [len(of_size) for of_size in medians]))
    mask[1:-1] = (bend > _JUMP * scale) & (scale > 0)
    return mask


def _runs(mask: Mask) -> list[tuple[int, int]]:
    """First index and length of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(first), int(last - first)) for first, last in zip(edges[::2], edges[1::2], strict=True)]
