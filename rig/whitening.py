"""Whitens values whose covariance is diagonal plus a few directions in each row."""

import numpy as np

from rig.layer import Floats


class Whitener:
    """(D + U Uᵀ)^(−1/2) of each row: D from its deviations (rows, samples), U its directions (k, rows, samples)."""

    def __init__(self, deviation: Floats, along: Floats) -> None:
        self._deviation = deviation
        self._along = along / deviation
        square, self._turn = np.linalg.eigh(np.einsum("arl,brl->rab", self._along, self._along))
        root = np.sqrt(1 + np.maximum(square, 0))
        self._share = -1 / (root * (1 + root))

    def __call__(self, values: Floats) -> Floats:
        """Of the shape of the values (rows, samples)."""
        plain = values / self._deviation
        onto = np.einsum("rab,arl,rl->rb", self._turn, self._along, plain)
        return plain + np.einsum("rb,rab,arl->rl", onto * self._share, self._turn, self._along)
