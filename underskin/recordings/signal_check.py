"""What may be wrong with a sampled signal: overload (clipping), held samples and jumps.

A defect is a finding: the blocks it touches are left out of the FRF, and the rest is used.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underskin.units import Floats

_CLIPPED_RUN = 3  # samples in a row at the extreme value
_CLIPPED_RATIO = 5.0  # a quantised sine's top level holds at most 1/(√2 − 1) = 2.4 times the samples of the next
_HELD_RUN = 5  # samples in a row of one value
_COARSE = 0.2  # share of samples that equal the one before, above which the levels are coarse
_JUMP = 12.0  # second difference over its scale among neighbours; a sine stays below 1.5, noise below 6
_BLOW, _ANSWER = 20.0, 6.0  # kurtosis; a sine has 1.5, noise 3, a hammer's blow hundreds, what rings after it tens
_BEGINNINGS, _ALIKE = 3, 0.9  # jumps at one distance at least, and the correlation of what lies between them
_LOCAL = 64  # samples that make a neighbourhood


@dataclass(frozen=True)
class Defect:
    """A run of samples that cannot be trusted: `kind` is overload, held_samples or jump."""

    kind: str
    channel: str
    first_sample: int
    samples: int

    @property
    def statement(self) -> str:
        """The defect in words."""
        reason = {
            "overload": "stay at the end of the range: overload",
            "held_samples": "repeat one value: samples were dropped and the last one held",
            "jump": "break the signal's course: samples were dropped, or a spike",
        }[self.kind]
        return f"{self.channel}: {self.samples} samples from sample {self.first_sample} {reason}"


def defects_of_pair(force: Floats, charge: Floats) -> list[Defect]:
    """Every defect of force and charge; no defect are the jumps where the force is a blow that the charge answers, and
    those where a periodic force, such as a sweep, begins anew."""
    found = [*defects("force_n", force), *defects("charge_pc", charge)]
    if _kurtosis(force) > _BLOW and _kurtosis(charge) > _ANSWER:
        return [defect for defect in found if defect.kind != "jump"]
    jumps = [defect.first_sample for defect in found if (defect.kind, defect.channel) == ("jump", "force_n")]
    period = _period(force, jumps)
    return [
        defect
        for defect in found
        if defect.kind != "jump" or not period or _apart(defect.first_sample - jumps[0], period) > 1
    ]


def _period(signal: Floats, jumps: list[int]) -> int:
    """The samples after which a signal that jumps at these places repeats itself, 0 where it does not."""
    steps = np.diff(jumps)
    if len(steps) < _BEGINNINGS - 1:
        return 0
    period = int(steps.min())
    if period < _LOCAL or any(_apart(int(step), period) > 1 for step in steps):
        return 0
    first, repeated = signal[:-period], signal[period:]
    return period if np.corrcoef(first, repeated)[0, 1] > _ALIKE else 0


def _apart(distance: int, period: int) -> int:
    """How far a distance is from the next multiple of a period."""
    return min(distance % period, -distance % period)


def _kurtosis(signal: Floats) -> float:
    centred = signal - signal.mean()
    power = float(np.mean(centred**2))
    return float(np.mean(centred**4)) / power**2 if power > 0 else 0.0


def defects(channel: str, signal: Floats) -> list[Defect]:
    """Every defect of a signal, in order of its kind.

    Dropped samples are seen as a held value, or as a jump where the signal is sampled finely enough to be smooth.
    """
    clipped = _overload(signal)
    held = _held(signal) & ~clipped
    jump = _jumps(signal) & ~clipped & ~held
    return [
        Defect(kind, channel, first, count)
        for kind, mask in (("overload", clipped), ("held_samples", held), ("jump", jump))
        for first, count in _runs(mask)
    ]


def damaged(found: list[Defect], samples: int) -> NDArray[np.bool_]:
    """Which of the samples any of the defects touches."""
    mask = np.zeros(samples, dtype=bool)
    for defect in found:
        mask[defect.first_sample : defect.first_sample + defect.samples] = True
    return mask


def _overload(signal: Floats) -> NDArray[np.bool_]:
    mask = np.zeros(len(signal), dtype=bool)
    levels, counts = np.unique(signal, return_counts=True)
    if len(levels) < 3:
        return mask
    for end, neighbour in ((0, 1), (-1, -2)):
        if counts[end] > _CLIPPED_RATIO * counts[neighbour]:
            mask |= _in_long_runs(signal == levels[end], _CLIPPED_RUN)
    return mask


def _held(signal: Floats) -> NDArray[np.bool_]:
    """Runs of one value; in a signal of coarse levels, which stays on each for a while, those that end in a leap."""
    step = np.abs(np.diff(signal))
    same = np.concatenate([[False], step == 0])
    mask = np.zeros(len(signal), dtype=bool)
    coarse = same.mean() > _COARSE
    leap = 2 * np.quantile(step, 0.999)
    for first, count in _runs(same):
        after = step[first + count - 1] if first + count < len(signal) else 0.0
        if count >= _HELD_RUN - 1 and (not coarse or after > leap):
            mask[first - 1 : first + count] = True
    return mask


def _jumps(signal: Floats) -> NDArray[np.bool_]:
    mask = np.zeros(len(signal), dtype=bool)
    bend = np.abs(np.diff(signal, n=2))
    blocks = max(1, len(bend) // _LOCAL)
    parts = np.array_split(bend, blocks)
    usual = np.array([1.4826 * np.median(part) for part in parts])
    around = np.max([np.roll(usual, shift) for shift in (-1, 0, 1)], axis=0)
    scale = np.repeat(around, [len(part) for part in parts])
    mask[1:-1] = (bend > _JUMP * scale) & (scale > 0)
    return mask


def _in_long_runs(mask: NDArray[np.bool_], shortest: int) -> NDArray[np.bool_]:
    long = np.zeros_like(mask)
    for first, count in _runs(mask):
        if count >= shortest:
            long[first : first + count] = True
    return long


def _runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First index and length of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(first), int(last - first)) for first, last in zip(edges[::2], edges[1::2], strict=True)]
