"""The inner products over the samples of curves: see `products`."""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Self

import numpy as np

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.sums import SlopeSums, Sums
from underskin.diagnosis.noise.noise_levels import SeveralLevels
from underskin.units import Array, Floats


class CurveLines:
    """The measured samples of curves, turned to where their covariance is diagonal."""

    def __init__(self, lines: Lines) -> None:
        """Turn them; needs the lines' smooth error."""
        assert lines.whitening is not None
        self.whitening = lines.whitening
        self.first = lines.first
        self.measured = self.whitening.turned(lines.value.real)

    def sums(self, products: Floats) -> Floats:
        """Over the samples of each recording (…, samples) to (…, recordings)."""
        return np.add.reduceat(products, self.first, axis=-1)


@dataclass(frozen=True)
class CurveProducts:
    """Of curves: forces (points, samples) and derivatives (points, parameters, samples) on turned samples."""

    lines: CurveLines
    force: Floats
    force_slopes: Floats | None
    level_slopes = None
    place_slopes = None

    @classmethod
    def of(cls, lines: CurveLines, force: Floats, slopes: Floats | None) -> Self:
        """Of a model's predictions (points, samples), and of their derivatives."""
        turned = lines.whitening.turned
        return cls(lines, turned(force), None if slopes is None else turned(slopes))

    def __len__(self) -> int:
        return len(self.force)

    def __getitem__(self, points: Array | slice) -> Self:
        """At some of the points."""
        slopes = None if self.force_slopes is None else self.force_slopes[points]
        return replace(self, force=self.force[points], force_slopes=slopes)

    @property
    def values(self) -> Self:
        """Without derivatives by the parameters."""
        return replace(self, force_slopes=None)

    @property
    def level(self) -> Floats:
        """1: the force is the direction."""
        return np.ones((len(self.force), len(self.lines.first)))

    def summed(self, levels: SeveralLevels) -> Sums:
        """The sums at noise levels (points, sets, 1), as (points, sets, recordings)."""
        ratio = levels.smooth / levels.level
        weight = self.lines.whitening.weight(ratio)
        force, measured = self.force[:, None], self.lines.measured
        uu, uy, yy = (self.lines.sums(weight * product) for product in (force**2, force * measured, measured**2))
        return Sums(uu, uy, yy, self.lines.whitening.log_determinant(ratio))

    def slope_sums(self, levels: SeveralLevels) -> SlopeSums:
        """The sums with derivatives, at the first of the sets of noise levels."""
        slopes, sums = self.force_slopes, self.lines.sums
        assert slopes is not None
        weighed = self.lines.whitening.weight((levels.smooth / levels.level)[:, :1]) * slopes
        uv, vy = sums(weighed * self.force[:, None]), sums(weighed * self.lines.measured)
        edges = [*self.lines.first, self.force.shape[-1]]
        vv = [weighed[..., low:high] @ slopes[..., low:high].transpose(0, 2, 1) for low, high in pairwise(edges)]
        return SlopeSums(np.moveaxis(uv, 1, -1), np.moveaxis(vy, 1, -1), np.stack(vv, axis=1))
