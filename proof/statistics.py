"""Shares with their intervals, and the calibration of probabilities."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from underskin.units import Floats

_95 = float(norm.ppf(0.975))
BINS = 10


@dataclass(frozen=True)
class Share:
    """`right` of `count`, with Wilson's 95 % interval; nan where count is 0."""

    right: int
    count: int

    @property
    def value(self) -> float:
        """The share."""
        return self.right / self.count if self.count else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's score interval, 95 %: p̃ ± z √(p(1−p)/n + z²/4n²)/(1 + z²/n), p̃ = (p + z²/2n)/(1 + z²/n)."""
        if not self.count:
            return float("nan"), float("nan")
        squared = _95**2 / self.count
        middle = (self.value + squared / 2) / (1 + squared)
        half = _95 * np.sqrt(self.value * (1 - self.value) / self.count + squared / (4 * self.count)) / (1 + squared)
        return float(max(middle - half, 0.0)), float(min(middle + half, 1.0))


def share(right: Sequence[bool]) -> Share:
    """The share of true entries."""
    return Share(sum(right), len(right))


@dataclass(frozen=True)
class Calibration:
    """Stated probabilities against the share that was right, in ten equal bins; empty bins are left out.

    Attributes
    ----------
    count, stated, right, low, high : tuple, (bins,)
        Entries, mean stated probability, share that was right, and its 95 % interval.
    error : float
        Expected calibration error Σ (n_bin/n) |right − stated|.
    chance_range : tuple
        95 % range of `error` for a perfectly calibrated tool that states the same probabilities.
    """

    count: tuple[int, ...]
    stated: tuple[float, ...]
    right: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    error: float
    chance_range: tuple[float, float]


def calibration(probabilities: Sequence[float], right: Sequence[bool], draws: int = 4000) -> Calibration:
    """Calibration of stated probabilities; the range by chance is simulated with a fixed seed.

    Parameters
    ----------
    probabilities : sequence of float
    right : sequence of bool
        Whether each answer was right.
    draws : int
        Simulated tools.
    """
    stated, hit = np.array(probabilities, dtype=float), np.array(right, dtype=float)
    bin_index = np.minimum((stated * BINS).astype(int), BINS - 1)
    used = np.unique(bin_index)
    members = [bin_index == number for number in used]
    chance = np.random.default_rng(1).random((draws, len(stated))) < stated
    errors = [_error(members, stated, row) for row in chance.astype(float)]
    shares = [Share(int(hit[member].sum()), int(member.sum())) for member in members]
    low, high = np.quantile(errors, [0.025, 0.975])
    return Calibration(
        count=tuple(bin_share.count for bin_share in shares),
        stated=tuple(float(stated[member].mean()) for member in members),
        right=tuple(bin_share.value for bin_share in shares),
        low=tuple(bin_share.interval[0] for bin_share in shares),
        high=tuple(bin_share.interval[1] for bin_share in shares),
        error=_error(members, stated, hit),
        chance_range=(float(low), float(high)),
    )


def chance_of_so_few(probabilities: Sequence[float], hits: int) -> float:
    """P(X ≤ hits) of the number X of right answers if each is right with its stated probability."""
    count = np.ones(1)  # the distribution of X
    for probability in probabilities:
        count = np.convolve(count, [1 - probability, probability])
    return float(count[: hits + 1].sum())


def _error(members: Sequence[np.ndarray], stated: Floats, hit: Floats) -> float:
    return float(sum(abs((hit[member] - stated[member]).sum()) for member in members) / len(stated))


def bootstrap(
    values: Sequence[float], statistic: Callable[[Floats], Floats], draws: int = 2000
) -> tuple[float, float, float]:
    """A statistic with its 95 % bootstrap interval, with a fixed seed.

    Parameters
    ----------
    values : sequence of float
    statistic : callable
        Maps (draws, values) to (draws,).
    draws : int

    Returns
    -------
    value, low, high : float
    """
    sample = np.array(values, dtype=float)
    again = np.random.default_rng(2).choice(sample, (draws, len(sample)))
    low, high = np.quantile(statistic(again), [0.025, 0.975])
    return float(statistic(sample[None])[0]), float(low), float(high)
