"""Sums over the rows of each recording, of which the likelihood of a prediction is made: see `products`."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from underskin.units import Array, Floats


@dataclass(frozen=True)
class Sums:
    """Re u*u, Re u*y and |y|² of each recording, and what the noise levels add to the log of the determinant.

    Of FRFs |y|² is that of each recording's mean: the rest is the same in all models (`Lines.about_means`).
    """

    uu: Floats
    uy: Floats
    yy: Floats
    log_determinant: Floats | float


@dataclass(frozen=True)
class SlopeSums:
    """Re u*v and Re v*y (points, recordings, parameters), and Re v*v (points, recordings, parameters, parameters)."""

    uv: Floats
    vy: Floats
    vv: Floats

    def __getitem__(self, points: Array | slice) -> "SlopeSums":
        """At some of the points."""
        return SlopeSums(self.uv[points], self.vy[points], self.vv[points])

    @classmethod
    def joined(cls, parts: Sequence["SlopeSums"]) -> Self:
        """At the points of several, one after another."""
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("uv", "vy", "vv")))
