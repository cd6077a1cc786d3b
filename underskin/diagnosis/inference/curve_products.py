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
        self.columns = self.whitening.columns

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
        taken = _Taken(self.lines, levels)
        force, measured = self.force[:, None], np.broadcast_to(self.lines.measured, (1, 1, self.force.shape[-1]))
        by_force, by_measured = taken.along(force), taken.along(measured)
        uu = taken.products(force, force, by_force, by_force)
        uy = taken.products(force, measured, by_force, by_measured)
        yy = taken.products(measured, measured, by_measured, by_measured)
        return Sums(uu, uy, yy, taken.log_determinant)

    def slope_sums(self, levels: SeveralLevels) -> SlopeSums:
        """The sums with derivatives, at the first of the sets of noise levels."""
        slopes = self.force_slopes
        assert slopes is not None
        taken = _Taken(self.lines, levels.at_first)
        force, measured = self.force[:, None], np.broadcast_to(self.lines.measured, (1, 1, self.force.shape[-1]))
        by_slopes = taken.along(slopes)  # (points, parameters, recordings, columns)
        uv = taken.products(slopes, force, by_slopes, taken.along(force))
        vy = taken.products(slopes, measured, by_slopes, taken.along(measured))
        return SlopeSums(np.moveaxis(uv, 1, -1), np.moveaxis(vy, 1, -1), taken.squares(slopes, by_slopes))

    def of_rows(self, rows: Floats, levels: SeveralLevels) -> tuple[Floats, Floats]:
        """Re u*J (recordings, P) and Re JᵀJ (P, P) of changes of the force J (P, samples), at the first point and set
        of noise levels."""
        taken = _Taken(self.lines, levels.at_first)
        turned, force = self.lines.whitening.turned(rows)[None], self.force[:1, None]
        by_rows = taken.along(turned)
        along = taken.products(turned, force, by_rows, taken.along(force))
        return along[0].T, taken.squares(turned, by_rows)[0].sum(axis=0)


class _Taken:
    """Products under the covariance κ² D + η² B + P Pᵀ, by Woodbury's identity; what P takes out of them."""

    def __init__(self, lines: CurveLines, levels: SeveralLevels) -> None:
        """At noise levels (points, sets, 1)."""
        ratio = levels.smooth / levels.level
        self._lines = lines
        self.weight = lines.whitening.weight(ratio)  # (points, sets, rows)
        count = len(lines.columns)
        one, other = np.triu_indices(count)
        square = lines.sums(self.weight[..., None, :] * (lines.columns[one] * lines.columns[other]))
        matrix = np.empty((*square.shape[:-2], square.shape[-1], count, count))
        matrix[..., one, other] = matrix[..., other, one] = np.moveaxis(square, -2, -1)
        level = levels.level[..., None, None] ** 2
        whole = matrix + level * np.eye(count)
        self.inverse = np.linalg.inv(whole)  # (points, sets, recordings, columns, columns)
        _, log = np.linalg.slogdet(whole / level)
        self.log_determinant = lines.whitening.log_determinant(ratio) + log.sum(axis=-1, keepdims=True)

    def along(self, rows: Floats) -> Floats:
        """Pᵀ times turned rows (points, sets, rows): (points, sets, recordings, columns)."""
        weighed = (self.weight * rows)[..., None, :] * self._lines.columns
        return np.moveaxis(self._lines.sums(weighed), -2, -1)

    def squares(self, rows: Floats, by_rows: Floats) -> Floats:
        """Of turned rows (points, P, samples) with each other (points, recordings, P, P), at the first set."""
        edges = [*self._lines.first, rows.shape[-1]]
        weighed = self.weight * rows
        whole = [weighed[..., low:high] @ rows[..., low:high].transpose(0, 2, 1) for low, high in pairwise(edges)]
        columns = np.moveaxis(by_rows, 1, 2)  # (points, recordings, P, columns)
        return np.asarray(np.stack(whole, axis=1) - columns @ self.inverse[:, 0] @ columns.swapaxes(-1, -2))

    def products(self, rows: Floats, others: Floats, by_rows: Floats, by_others: Floats) -> Floats:
        """Of turned rows (points, sets, rows) of each recording."""
        whole = self._lines.sums(self.weight * rows * others)
        less = ((by_rows[..., None, :] @ self.inverse)[..., 0, :] * by_others).sum(axis=-1)
        return np.asarray(whole - less)
