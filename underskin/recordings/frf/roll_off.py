"""Whether the band of d33 lies behind a filter, of the charge or of the force.

The magnitude over frequency, in bins over all recordings and up to where a resonance lifts it, is fitted by a plateau
with a slight power law and two filters of the charge,
    ln |FRF| = a − n ln f − ½ ln(1 + (f1/f)²) − (m/2) ln(1 + (f/f2)^(2k)),   0 ≤ n ≤ `STEEPEST`,
or with one filter of the force, by which the response is divided: it rises behind a low-pass of the force cell. A
filter counts where it explains the course and the plateau lies beyond the band: then the band's average is no d33.
Where all of the course is one flank it may be that of either channel, and d33 too small or too large.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from underskin.recordings.frf.line_choice import bin_of, edges_over
from underskin.recordings.frf.spectra import Stack
from underskin.units import Floats

STEEPEST = 0.1  # fall of ln FRF with ln f that relaxation may have (a loss tangent of 0.16)
OF_A_MEDIAN = 1.25  # its standard error over that of a mean
_FEWEST_BINS = 6
_CORNERS = 60  # corner frequencies tried for each filter
_BELOW, _ABOVE = 30.0, 10.0  # range of corner frequencies, as factors on the ends of the band
_LOW_PASSES = ((1, 1), (2, 1), (4, 1), (1, 2), (2, 2), (1, 4))  # k and m: Butterworth's of order k, m times in a row
_HIGH_PASSES = ((1, 1), (2, 1), (1, 2))
_FIRST_ORDER = (1, 1)
_OF_FORCE = ((1, 1), (2, 1))  # of load cells and their amplifiers
_LEAST_NOISE = 0.003  # of a bin's magnitude
_SEVERAL, _USUAL_NOISE = 4, 0.02  # lines of a bin that determine its scatter, and the default scatter
_LIFTED = 1.05  # of the plateau: a resonance
_LEAST_SHARE = 0.02  # least reported loss, of the plateau
_SPEAKS = 25.0  # least reduction of χ² by a filter
_EXPLAINED = 0.2  # largest remaining rms, of that about a plateau


@dataclass(frozen=True)
class RollOff:
    """The filters of the charge or the force, the loss of the band's level relative to their plateau (a gain is
    negative), and whether those of either channel explain the course."""

    filters: "Filters"
    share: float
    is_open: bool = False

    @property
    def arguments(self) -> dict[str, float | bool]:
        """The corners and the loss as findings state them."""
        corners = {"high_pass_hz": self.filters.high_hz, "low_pass_hz": self.filters.low_hz}
        channel = {"of_force": self.filters.of_force, "either": self.is_open}
        return {**corners, **channel, "percent": 100 * self.share}


def roll_off(stacks: Sequence[Stack], low_hz: float, high_hz: float, level: Floats) -> RollOff | None:
    """The filters behind which a band from `low_hz` to `high_hz` lies; None where it reaches their plateau.

    `level` (recordings,): the average over the band [C/N].
    """
    frequency, magnitude, noise = _curve(stacks, level)
    inside = (frequency >= low_hz) & (frequency <= high_hz)
    lifted = np.flatnonzero(magnitude > _LIFTED * np.median(magnitude[inside])) if inside.any() else np.zeros(0, int)
    lifted = lifted[frequency[lifted] > high_hz]
    if len(lifted) and magnitude[-1] >= 0.8 * magnitude[lifted[0] :].max():
        lifted = lifted[:0]  # no peak: a high-pass that goes on rising
    end = int(lifted[0]) if len(lifted) else len(frequency)
    if end < _FEWEST_BINS:
        return None
    middle = 0.5 * float(np.log(low_hz * high_hz))
    curve = _Curve(np.log(frequency[:end]), np.log(magnitude[:end]), noise[:end] ** -2.0, middle)
    plain = curve.fitted(Filters())[0]
    if plain < _SPEAKS:
        return None
    highs = np.geomspace(frequency[0] / _BELOW, frequency[end - 1] * _ABOVE, _CORNERS).tolist()
    lows = np.geomspace(frequency[0] / _ABOVE, frequency[end - 1] * _BELOW, _CORNERS).tolist()
    single = [Filters(high_hz=high, high_pass=kind) for high in highs for kind in _HIGH_PASSES]
    single += [Filters(low_hz=low, low_pass=kind) for low in lows for kind in _LOW_PASSES]
    pairs = [Filters(high, low) for high, low in product(highs[::2], lows[::2]) if high < low]
    force = [Filters(high_hz=corner, high_pass=kind, of_force=True) for corner in lows for kind in _OF_FORCE]
    force += [Filters(low_hz=corner, low_pass=kind, of_force=True) for corner in highs for kind in _OF_FORCE]
    best, both, divided = (
        curve.refined(min(every, key=lambda filters: curve.fitted(filters)[0])) for every in (single, pairs, force)
    )
    if curve.fitted(best)[0] - curve.fitted(both)[0] > _SPEAKS:
        best = both
    misfit, misfit_divided = curve.fitted(best)[0], curve.fitted(divided)[0]
    explains, explains_divided = (
        plain - left >= _SPEAKS and left <= _EXPLAINED**2 * plain + len(curve.x) for left in (misfit, misfit_divided)
    )
    loss, gain = curve.loss(best), -curve.loss(divided)
    if explains_divided and misfit - misfit_divided > _SPEAKS:
        return RollOff(divided, -gain) if gain >= _LEAST_SHARE else None
    if not explains or loss < _LEAST_SHARE:
        return None
    return RollOff(best, loss, explains_divided and misfit_divided - misfit <= _SPEAKS)


@dataclass(frozen=True)
class Filters:
    """Corner frequencies [Hz], 0 and ∞ without one, and kinds (k, m) of a high-pass and a low-pass, of the charge or of
    the force, by which the response is divided."""

    high_hz: float = 0.0
    low_hz: float = np.inf
    high_pass: tuple[int, int] = _FIRST_ORDER
    low_pass: tuple[int, int] = _FIRST_ORDER
    of_force: bool = False

    def log_gain(self, frequency: Floats) -> Floats:
        """ln of the response's magnitude over that of the plateau at these frequencies [Hz]."""
        (high_order, high_times), (low_order, low_times) = self.high_pass, self.low_pass
        return (0.5 if self.of_force else -0.5) * (
            high_times * np.log1p((self.high_hz / frequency) ** (2 * high_order))
            + low_times * np.log1p((frequency / self.low_hz) ** (2 * low_order))
        )

    def phase(self, frequency: Floats) -> Floats:
        """The response's phase [rad] at these frequencies [Hz], 0 on the plateau."""
        phase = _lag(self.high_hz / frequency, *self.high_pass) - _lag(frequency / self.low_hz, *self.low_pass)
        return -phase if self.of_force else phase


def _lag(ratio: Floats, order: int, times: int) -> Floats:
    """The lag [rad] of Butterworth's low-pass, so many times in a row, at these multiples of its corner."""
    poles = np.exp(0.5j * np.pi * (2 * np.arange(order) + order + 1) / order)
    return np.asarray(times * np.angle(1j * ratio[:, None] - poles).sum(axis=1))


@dataclass(frozen=True)
class _Curve:
    """ln f `x`, ln of the magnitude `y` and its `weight` (bins,), and ln of the frequency `at` which the plateau is
    stated."""

    x: Floats
    y: Floats
    weight: Floats
    at: float

    def fitted(self, filters: Filters) -> tuple[float, float]:
        """χ² of the best plateau and slope behind these filters, and the logarithm of the plateau at `at`."""
        total, middle, x, variance = self._centred
        y = self.y - filters.log_gain(self._frequency)
        level = float((y * self.weight).sum() / total)
        slope = float(np.clip((self.weight * x * y).sum() / variance, -STEEPEST, 0.0))
        return float((self.weight * (y - level - slope * x) ** 2).sum()), level + slope * (self.at - middle)

    def loss(self, filters: Filters) -> float:
        """What the band lacks of the plateau behind these filters, as a share of it; a gain is negative."""
        return 1 - float(np.exp(-self.fitted(filters)[1]))

    @cached_property
    def _frequency(self) -> Floats:
        return np.exp(self.x)

    @cached_property
    def _centred(self) -> tuple[float, float, Floats, float]:
        """Sum of the weights, weighted mean of `x`, `x` less it, and its weighted sum of squares."""
        total = float(self.weight.sum())
        middle = float((self.x * self.weight).sum() / total)
        x = self.x - middle
        return total, middle, x, float((self.weight * x**2).sum())

    def refined(self, filters: Filters) -> Filters:
        """The filters with the corners that fit best near their own."""
        from scipy.optimize import minimize  # takes 0.3 s to load, which few need

        names = [name for name in ("high_hz", "low_hz") if 0 < getattr(filters, name) < np.inf]
        start: Floats = np.log(np.array([getattr(filters, name) for name in names], dtype=np.float64))

        def moved(corners: Floats) -> Filters:
            return replace(filters, **dict(zip(names, np.exp(corners).tolist(), strict=True)))

        def misfit(corners: Floats) -> float:
            return self.fitted(moved(corners))[0]

        near = start[:, None] + np.log(_BELOW) * np.array([-1.0, 1.0])
        return moved(np.asarray(minimize(misfit, start, method="Nelder-Mead", bounds=near).x, dtype=np.float64))


def _curve(stacks: Sequence[Stack], level: Floats) -> tuple[Floats, Floats, Floats]:
    """For non-empty bins of equal width in ln f: the middle of its lines [Hz], the median over recordings of the
    magnitude over their level, and its relative noise."""
    lines = [stack.frequency[stack.used.any(axis=0)] for stack in stacks]
    edges = edges_over(np.unique(np.concatenate(lines)))
    cells: list[list[Floats]] = [[] for _ in edges[1:]]  # (recordings, 4): middle, magnitude, scatter, lines
    for stack in stacks:
        bins, own_level = bin_of(stack.frequency, edges), level[stack.rows]
        known = np.isfinite(own_level) & (own_level != 0)
        size, used = np.abs(stack.values[known]) / np.abs(own_level[known, None]), stack.used[known]
        for bin_index in np.unique(bins).tolist() if known.any() else ():
            inside = np.flatnonzero(bins == bin_index)
            choices, choice_of_row = np.unique(used[:, inside], axis=0, return_inverse=True)  # mostly all lines
            choice_of_row = choice_of_row.reshape(-1)  # NumPy 2.0 returns (rows, 1)
            for number in np.flatnonzero(choices.any(axis=1)).tolist():
                of_choice = inside[choices[number]]
                chosen = size[np.ix_(choice_of_row == number, of_choice)]
                middle_hz = np.median(stack.frequency[of_choice])
                columns = middle_hz, np.median(chosen, axis=1), np.std(chosen, axis=1), len(of_choice)
                cells[bin_index].append(np.stack(np.broadcast_arrays(*columns), axis=1).astype(np.float64))
    tables = [np.concatenate(of_bin).T for of_bin in cells if of_bin]
    several = np.concatenate([scatter[count >= _SEVERAL] for _, _, scatter, count in tables]) if tables else np.zeros(0)
    usual = float(np.median(several)) if len(several) else _USUAL_NOISE
    filled = [part for part in tables if np.median(part[1]) > 0]
    middle, magnitude = np.array([np.median(part[:2], axis=1) for part in filled]).reshape(-1, 2).T
    # Of a median over recordings; with few lines their deviation is at least the usual one
    errors = [np.maximum(part[2], np.where(part[3] < _SEVERAL, usual, 0.0)) / np.sqrt(part[3]) for part in filled]
    noise = np.array([OF_A_MEDIAN * float(np.median(error)) / len(error) ** 0.5 for error in errors])
    return middle, magnitude, np.maximum(noise / magnitude, _LEAST_NOISE)
