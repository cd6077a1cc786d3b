"""FRFs put together where they have the same lines, so that they are worked on at once."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import median_filter

from underskin.recordings.frf.spectral_average import Frf
from underskin.units import Complexes, Floats, Indices, Mask

_AROUND = 11  # lines whose median γ² is that to be expected in their middle


@dataclass(frozen=True)
class Stack:
    """Recordings of one grid: `rows` are their numbers; frequency (lines,), values (rows, lines), γ² or NaN, and which
    lines of each recording are `used`, all where nobody looked."""

    rows: Indices
    frequency: Floats
    values: Complexes
    coherence: Floats
    used: Mask

    def at(self, lines: Mask) -> "Stack":
        """The same at some of the lines (lines,)."""
        columns = (self.values[:, lines], self.coherence[:, lines], self.used[:, lines])
        return Stack(self.rows, self.frequency[lines], *columns)

    @cached_property
    def weights(self) -> Floats:
        """γ²/(1 − γ²) of the lines that are used (rows, lines), by which the variance of a line goes, with the γ² to be
        expected; rounding of γ² near 1 is kept from ruling."""
        weights = np.zeros(self.coherence.shape)
        for row, (coherence, used) in enumerate(zip(self.coherence, self.used, strict=True)):
            weights[row, used] = information(expected_coherence(coherence[used]))
        return weights


def information(coherence: Floats) -> Floats:
    """γ²/(1 − γ²) of lines (lines,), 1 where γ² is not known."""
    weight = coherence / np.maximum(1 - coherence, 1e-3)
    return np.where(np.isfinite(coherence), np.maximum(weight, 1e-9), 1.0)


def expected_coherence(coherence: Floats) -> Floats:
    """γ² of each line (lines,) by those around it: weights by a line's own γ² prefer those that came out too large."""
    if not np.isfinite(coherence).all() or len(coherence) < _AROUND:
        return coherence
    return np.asarray(median_filter(coherence, _AROUND, mode="nearest"))


def stacked(frfs: Sequence[Frf]) -> list[Stack]:
    """The recordings, put together where they share the same lines."""
    members: dict[bytes, list[int]] = {}
    for row, frf in enumerate(frfs):
        members.setdefault(frf.frequency.tobytes(), []).append(row)
    stacks = []
    for rows in members.values():
        own = [frfs[row] for row in rows]
        values = np.array([frf.values for frf in own])
        coherence = np.array([frf.coherence_or_nan for frf in own])
        used = np.array([frf.used_or_all for frf in own])
        stacks.append(Stack(np.array(rows), frfs[rows[0]].frequency, values, coherence, used))
    return stacks
