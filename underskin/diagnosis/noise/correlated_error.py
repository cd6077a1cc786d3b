"""The smooth error of a curve under every hypothesis: no law of a soft contact holds to better than a percent.

The zero and gain of a load cell, the position of the surface, friction in a stage and the idealisation of every law
bend a curve a little. Neighbouring samples share that error, so they are not independent. Within each curve, with
F_max its largest force, x the place along the curve from 0 to 1 and η the size,

    ε ~ N(0, η² B),  B = F_max² k(x − x'),

k the mean of Matérn-3/2 kernels of length 0.1 (the beginning of a contact, a grip that seats) and 0.4 (the
idealisation of a law). η is a parameter of every hypothesis: log-uniform from 0.1 to 1 %, falling off outside, more
slowly downwards. An unmodelled discrepancy is the same process with η from 2 to 50 %.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from underskin.diagnosis.noise.noise_priors import Plateau
from underskin.units import Floats

USUAL = Plateau.of((1e-3, 1e-2), (1.0, 0.25))
UNNAMED = Plateau.of((2e-2, 0.5), (0.05, 0.05))
TYPICAL = 3e-3
_LENGTHS = (0.1, 0.4)


@dataclass(frozen=True)
class SmoothError:
    """Of all rows of a campaign's curves, one curve after another."""

    scale: Floats  # (rows,) [N]: the deviation is η times this
    place: Floats  # (rows,) along the curve, 0 to 1

    def part(self, order: NDArray[np.intp]) -> "SmoothError":
        """Of some of the rows."""
        return SmoothError(self.scale[order], self.place[order])


class Whitening:
    """κ² D + η² B as κ² times a unit matrix: each curve's rows over d, turned to where B is diagonal, and weighed."""

    def __init__(self, error: SmoothError, deviation: Floats, recording: NDArray[np.intp]) -> None:
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
