"""What the cell of each curve adds under a prediction: its zero and drift, and the gain of the recording."""

from dataclasses import dataclass

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.noise.noise_levels import NoiseLevels
from underskin.units import Floats, Mask


@dataclass(frozen=True)
class CellResponse:
    """The most probable zero and drift (rows,) [N], gain (recordings,) relative, and the variance (rows,) [N²] that
    not knowing them leaves."""

    offset: Floats
    gain: Floats
    variance: Floats

    def reading(self, lines: Lines, force: Floats) -> Floats:
        """What the cells show of a force (rows,) [N]."""
        return force * (1 + self.gain[lines.recording]) + self.offset


def cell_response(lines: Lines, levels: NoiseLevels, force: Floats, known: Mask | None = None) -> CellResponse:
    """From the rows that are `known` (default: all): y = F (1 + g) + P c + ε, with the priors of g and c.

    `force` (rows,) is what is predicted without them.
    """
    assert lines.smooth is not None
    known = np.ones(len(force), dtype=bool) if known is None else known
    offset, variance, gain = np.zeros(len(force)), np.zeros(len(force)), []
    for own in lines.spans:
        design = np.column_stack([levels.gain * force[own], lines.smooth.columns[own]])
        rows = np.flatnonzero(known[own])
        of_known = lines.smooth.part(own.start + rows)
        noise = of_known.covariance(levels.smooth) + np.diag((levels.level * lines.deviation[own][rows]) ** 2)
        weighed = np.linalg.solve(noise, design[rows])
        information = np.eye(design.shape[1]) + design[rows].T @ weighed
        coefficients = np.linalg.solve(information, weighed.T @ (lines.value.real[own] - force[own])[rows])
        offset[own] = design[:, 1:] @ coefficients[1:]
        gain.append(levels.gain * coefficients[0])
        variance[own] = np.einsum("ri,ij,rj->r", design, np.linalg.inv(information), design)
    return CellResponse(offset, np.array(gain), variance)
