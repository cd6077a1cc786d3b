"""FRFs put together where they have the same lines, so that they are worked on at once."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from underskin.recordings.frf.estimation import Frf
from underskin.units import Complexes, Floats, Indices, Mask


@dataclass(frozen=True)
class Stack:
    """Recordings of one grid: `rows` are their numbers; frequency (lines,), values (rows, lines), γ² or NaN."""

    rows: Indices
    frequency: Floats
    values: Complexes
    coherence: Floats

    def at(self, lines: Mask) -> "Stack":
        """The same at some of the lines (lines,)."""
        return Stack(self.rows, self.frequency[lines], self.values[:, lines], self.coherence[:, lines])


def stacked(frfs: Sequence[Frf]) -> list[Stack]:
    """The recordings, put together where they share the same lines."""
    members: dict[bytes, list[int]] = {}
    for row, frf in enumerate(frfs):
        members.setdefault(frf.frequency.tobytes(), []).append(row)
    stacks = []
    for rows in members.values():
        values, coherence = ([frfs[row].values for row in rows], [frfs[row].coherence_or_nan for row in rows])
        stacks.append(Stack(np.array(rows), frfs[rows[0]].frequency, np.array(values), np.array(coherence)))
    return stacks
