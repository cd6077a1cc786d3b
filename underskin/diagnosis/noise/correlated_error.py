"""What the samples of a curve share under every hypothesis: what the cell adds, and that no law is exact.

A cell shows its zero F0 and a drift b in time (without times, in the order of the samples) or along the travel beside
the force (its gain is the recording's, as of FRFs): columns P with normal coefficients, whose scale is the prior's
standard deviation. Where samples in the air show the zero, F0 is as good as free; else a tared cell is within a
hundredth of what it measures. The drift over the curve is 2 % of the largest force, or as much as a plain drift or
the air before a snap-in shows where that is more, and none is looked for where no air shows it.

The position of the surface, friction in a stage and the idealisation of every law bend a curve a little. Neighbouring
samples share that error too. Within each curve, with s the force (or, near the contact's beginning and in the air, 0.7
and 0.2 of the largest), x the place along the curve from 0 to 1 and η the size,

    ε ~ N(0, η² B + P Pᵀ),  B = s s' k(x − x'),

k the mean of Matérn-3/2 kernels of length 0.025 and 0.1 (the beginning of a contact, a grip that seats) and 0.4 (the
idealisation of a law). η is a parameter of every hypothesis: log-uniform from 0.1 to 1 %, falling off outside, slowly
downwards. An unmodelled discrepancy is the same process with η from 2 to 50 %.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import numpy as np

from underskin.diagnosis.noise.noise_priors import Plateau
from underskin.units import Floats, Indices

USUAL = Plateau.of((1e-3, 1e-2), (1.0, 0.25))
UNNAMED = Plateau.of((2e-2, 0.5), (0.05, 0.05))
TYPICAL = 3e-3
_LENGTHS = (0.025, 0.1, 0.4)
USUAL_DRIFT = 0.02  # of the largest force, over the curve
_COLUMNS = 3


@dataclass(frozen=True)
class CurveError:
    """Of all rows of a campaign's curves, one curve after another."""

    scale: Floats  # (rows,) [N]: the deviation is η times this
    place: Floats  # (rows,) along the curve, 0 to 1
    columns: Floats  # (rows, columns) [N] of each curve's own coefficients
    count: Floats  # (rows,) raw samples that each row is the mean of
    slope: Floats  # (rows,) [N per sample] of the straight line through these
    about_line: Floats  # (rows,) [N²] the sum of their squares about it
    slow: Floats  # (rows,) [N] the noise of its curve that neighbouring samples share, as the air shows it

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Of several curves."""
        columns = [part.columns for part in parts] or [np.zeros((0, 0))]

        def of(name: str) -> Floats:
            return np.concatenate([*(getattr(part, name) for part in parts), np.zeros(0)])

        return cls(
            of("scale"), of("place"), np.concatenate(columns), *map(of, ("count", "slope", "about_line", "slow"))
        )

    def part(self, order: Indices) -> Self:
        """Of some of the rows."""
        rows = (self.scale, self.place, self.columns, self.count, self.slope, self.about_line, self.slow)
        return type(self)(*(entry[order] for entry in rows))

    def within(self, force: Floats, curves: Sequence[slice]) -> float:
        """The sum of squares [N²] of raw samples about a law beyond that of their means, of whole curves.

        The law's force (rows,) is straight between rows, and so are the samples of a row but for their noise.
        """
        middle = np.cumsum(self.count) - self.count / 2
        slope = np.concatenate([np.gradient(force[own], middle[own]) for own in curves])
        square = self.count * (self.count**2 - 1) / 12
        return float((self.about_line + square * (self.slope - slope) ** 2).sum())

    def covariance(self, size: float) -> Floats:
        """Of rows that are one curve's, with η = `size` (rows, rows)."""
        return np.asarray(size**2 * np.outer(self.scale, self.scale) * _likeness(self.place))


def instrument_columns(displacement: Floats, time: Floats, zero: float, drift: float) -> Floats:
    """P of one curve (rows, 3): zero, drift in time, drift along the travel; `zero` and `drift` are deviations [N]."""
    columns = np.zeros((len(displacement), _COLUMNS))
    columns[:, 0] = zero
    for place, axis in ((1, time), (2, displacement)):
        if np.ptp(axis) > 0:
            columns[:, place] = drift * ((axis - axis[0]) / np.ptp(axis))
    return columns


class Whitening:
    """κ² D + η² B as κ² times a unit matrix: each curve's rows over d, turned to where B is diagonal, and weighed."""

    def __init__(self, error: CurveError, deviation: Floats, recording: Indices) -> None:
        """Find the directions of each curve; `deviation` is D's square root (rows,)."""
        self._deviation = deviation
        edges = np.flatnonzero(np.diff(recording, prepend=-1, append=-1))
        self._spans = [slice(low, high) for low, high in pairwise(edges)]
        self._turns, sizes = [], []
        for span in self._spans:
            relative = error.scale[span] / deviation[span]
            size, turn = np.linalg.eigh(relative[:, None] * _likeness(error.place[span]) * relative)
            self._turns.append(turn.T)
            sizes.append(np.maximum(size, 0.0))
        self._size = np.concatenate(sizes)
        self.columns = self.turned(error.columns.T)  # (columns, rows)

    def log_determinant(self, ratio: Floats) -> Floats:
        """log|I + (η/κ)² D^(−½) B D^(−½)| at ratios η/κ (…, 1)."""
        return np.asarray(np.log1p(ratio**2 * self._size).sum(axis=-1, keepdims=True))

    def weight(self, ratio: Floats) -> Floats:
        """What products of turned rows weigh at ratios η/κ (…, 1): (…, rows)."""
        return np.asarray(1 / (1 + ratio**2 * self._size))

    def turned(self, rows: Floats) -> Floats:
        """The rows (…, rows), forces, such that their covariance is κ² diag(1/weight)."""
        scaled = rows / self._deviation
        parts = [scaled[..., span] @ turn.T for span, turn in zip(self._spans, self._turns, strict=True)]
        return np.concatenate(parts, axis=-1)


def _likeness(place: Floats) -> Floats:
    """k between all places of a curve."""
    total = np.zeros((len(place), len(place)))
    for length in _LENGTHS:
        distance = np.sqrt(3.0) * np.abs(place[:, None] - place) / length
        total += (1 + distance) * np.exp(-distance) / len(_LENGTHS)
    return total
