"""All inner products over rows that the likelihood of predictions needs, at several points of the fit coordinates.

A prediction is m = L u in each recording: of FRFs L is the level, which is real, and u the dynamics' factor line by
line, 1 where there are none; of curves L = 1 and u is the force, turned such that samples are independent. With 1/d² as
the weight of rows (of curves what whitening makes of it), the sums of each recording are Re u*u, Re u*y and |y|², and
with the derivatives v of u, Re u*v, Re v*y and Re v*v. Arrays are (points, recordings, …).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Self

import numpy as np
from scipy.sparse import csr_array

from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.pickup_rows import PickupRows
from underskin.diagnosis.noise.noise_levels import SeveralLevels
from underskin.mechanisms.models.frf import Response
from underskin.mechanisms.models.frf_design import FrfDesign
from underskin.units import Array, Floats


@dataclass(frozen=True)
class Sums:
    """Re u*u, Re u*y and |y|² of each recording, and what the noise levels add to the log of the determinant."""

    uu: Floats
    uy: Floats
    yy: Floats
    log_determinant: Floats | float


@dataclass(frozen=True)
class SlopeSums:
    """Re u*v and Re v*y (points, recordings, parameters); None where v is 0. `gram` gives Σ s Re v*v (points,
    parameters, parameters) for factors s (points, recordings)."""

    uv: Floats | None
    vy: Floats | None
    gram: Callable[[Floats], Floats | float]


class FrfLines:
    """The measured lines of FRFs as matrices that sum a model's distinct lines over the rows of each recording."""

    def __init__(self, lines: Lines, design: FrfDesign) -> None:
        """Place the weights; the design says which distinct line each row is."""
        weight = lines.deviation**-2.0
        by_recording = np.append(lines.first, len(lines.value))
        shape = (lines.recordings, len(design.line_frequency))

        def matrix(values: Floats) -> csr_array:
            return csr_array((values, design.line, by_recording), shape=shape)

        self.weight, self.real, self.imag = (
            matrix(weight * values) for values in (np.ones(len(weight)), lines.value.real, lines.value.imag)
        )
        self.uu, self.uy = (
            np.add.reduceat(weight * values, lines.first) for values in (np.ones(len(weight)), lines.value.real)
        )
        self.yy = np.add.reduceat(weight * np.abs(lines.value) ** 2, lines.first)


@lru_cache(maxsize=4)  # by identity: a diagnosis weighs dozens of models of one design
def frf_lines(lines: Lines, design: FrfDesign) -> FrfLines:
    """The matrices of these lines for models of this design."""
    return FrfLines(lines, design)


@dataclass(frozen=True)
class FrfProducts:
    """Of FRFs. `factor` (points, lines) and `factor_slopes` (points, parameters, lines) are u and v, None where u is 1 or
    no longer asked for."""

    lines: FrfLines
    pickup: PickupRows | None
    level: Floats  # (points, recordings)
    level_slopes: Floats | None  # (points, recordings, parameters)
    place_slopes: Floats | None  # (2, points, recordings)
    factor: Array | None
    factor_slopes: Array | None
    uu: Floats
    uy: Floats

    @classmethod
    def of(cls, lines: FrfLines, pickup: PickupRows | None, response: Response) -> Self:
        """Of a model's response at several points, and the rows that its pick-up reaches."""
        level, factor = response.level, response.lines
        slopes = np.moveaxis(level.slopes, 0, -1) if len(level.slopes) else None
        if factor is None:
            uu, uy = np.broadcast_to(lines.uu, level.value.shape), np.broadcast_to(lines.uy, level.value.shape)
            return cls(lines, pickup, level.value, slopes, response.place_slopes, None, None, uu, uy)
        u = factor.value
        uu = (lines.weight @ (u.real**2 + u.imag**2).T).T
        uy = (lines.real @ u.real.T + lines.imag @ u.imag.T).T
        of_factor = None if slopes is None else np.moveaxis(factor.slopes, 0, 1)
        kept = None if slopes is None and pickup is None else u
        return cls(lines, pickup, level.value, slopes, response.place_slopes, kept, of_factor, uu, uy)

    def __len__(self) -> int:
        return len(self.level)

    def __getitem__(self, points: Array | slice) -> Self:
        """At some of the points."""

        def of(values: Any) -> Any:
            return None if values is None else values[points]

        return replace(
            self,
            level=self.level[points],
            level_slopes=of(self.level_slopes),
            place_slopes=None if self.place_slopes is None else self.place_slopes[:, points],
            factor=of(self.factor),
            factor_slopes=of(self.factor_slopes),
            uu=self.uu[points],
            uy=self.uy[points],
        )

    @classmethod
    def joined(cls, parts: Sequence["FrfProducts"]) -> Self:
        """At the points of several, one after another."""

        def of(name: str, axis: int = 0) -> Any:
            values = [getattr(part, name) for part in parts]
            return None if values[0] is None else np.concatenate(values, axis=axis)

        first = parts[0]
        slopes, place = of("level_slopes"), of("place_slopes", axis=1)
        sums = of("uu"), of("uy")
        return cls(first.lines, first.pickup, of("level"), slopes, place, of("factor"), of("factor_slopes"), *sums)

    def filled(self, parameters: int) -> Self:
        """With derivatives that are 0 by further parameters, so many in all."""
        slopes = self.level_slopes
        if slopes is None or slopes.shape[-1] == parameters:
            return self
        further = np.zeros((*slopes.shape[:-1], parameters - slopes.shape[-1]))
        return replace(self, level_slopes=np.concatenate([slopes, further], axis=-1))

    def scaled(self, factor: Floats) -> Self:
        """Of levels so many times as large (points,)."""
        by = factor[:, None]
        slopes = None if self.level_slopes is None else self.level_slopes * by[..., None]
        place = None if self.place_slopes is None else self.place_slopes * by
        return replace(self, level=self.level * by, level_slopes=slopes, place_slopes=place)

    def summed(self, levels: SeveralLevels) -> Sums:
        """The sums at noise levels (points, sets, 1), as (points, sets, recordings)."""
        uu, uy, yy = self.uu[:, None], self.uy[:, None], self.lines.yy
        rows = self.pickup
        if rows is None or levels.pickup is None:
            return Sums(uu, uy, yy, 0.0)
        lost, log_determinant = rows.lost(levels.pickup, levels.level)
        u = self._on_pickup(rows)[:, None]
        return Sums(
            uu - rows.summed(lost, u, u), uy - rows.summed(lost, u), yy - rows.summed(lost, rows.value), log_determinant
        )

    def slope_sums(self, levels: SeveralLevels) -> SlopeSums:
        """The sums with derivatives, at the first of the sets of noise levels."""
        factor, slopes = self.factor, self.factor_slopes
        if factor is None or slopes is None:
            return SlopeSums(None, None, lambda _: 0.0)
        moving = np.flatnonzero(slopes.any(axis=(0, 2)))
        v, lines, rows, lost = slopes[:, moving], self.lines, self.pickup, None

        def over_rows(matrix: csr_array, values: Floats) -> Floats:
            """(points, parameters, lines) to (points, recordings, parameters)."""
            flat = matrix @ values.reshape(-1, values.shape[-1]).T
            return np.asarray(flat.reshape(-1, *values.shape[:2]).transpose(1, 0, 2))

        uv = over_rows(lines.weight, (factor.conj()[:, None] * v).real)
        vy = over_rows(lines.real, v.real) + over_rows(lines.imag, v.imag)
        if rows is not None and levels.pickup is not None:
            lost, _ = rows.lost(levels.pickup[:, 0], levels.level[:, 0])
            u, at_rows = self._on_pickup(rows)[:, None], v[..., rows.line]
            uv = uv - np.moveaxis(rows.summed(lost[:, None], u, at_rows), 1, -1)
            vy = vy - np.moveaxis(rows.summed(lost[:, None], at_rows), 1, -1)
        parameters = slopes.shape[1]

        def placed(values: Floats) -> Floats:
            whole = np.zeros((*values.shape[:-1], parameters))
            whole[..., moving] = values
            return whole

        def gram(factors: Floats) -> Floats:
            weight = (lines.weight.T @ factors.T).T
            if rows is not None and lost is not None:
                weight = weight - rows.over_lines(lost, factors, weight.shape[-1])
            both = np.concatenate([v.real, v.imag], axis=-1)
            whole = np.zeros((len(v), parameters, parameters))
            products = (both * np.tile(weight, 2)[:, None]) @ both.transpose(0, 2, 1)
            whole[np.ix_(np.arange(len(v)), moving, moving)] = products
            return whole

        return SlopeSums(placed(uv), placed(vy), gram)

    def _on_pickup(self, rows: PickupRows) -> Array:
        """u on the rows that pick-up reaches (points or 1, rows)."""
        return np.ones((1, len(rows.line))) if self.factor is None else self.factor[:, rows.line]


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
    """Of curves: forces and their derivatives on turned samples, (points, samples) and (points, parameters, samples)."""

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
        slopes = self.force_slopes
        assert slopes is not None
        weighed = self.lines.whitening.weight((levels.smooth / levels.level)[:, :1]) * slopes
        uv = self.lines.sums(weighed * self.force[:, None])
        vy = self.lines.sums(weighed * self.lines.measured)
        samples = np.diff(np.append(self.lines.first, self.force.shape[-1]))

        def gram(factors: Floats) -> Floats:
            of_samples = np.repeat(factors, samples, axis=-1)[:, None]
            return np.asarray((weighed * of_samples) @ slopes.transpose(0, 2, 1))

        return SlopeSums(np.moveaxis(uv, 1, -1), np.moveaxis(vy, 1, -1), gram)


Products = FrfProducts | CurveProducts


def joined(parts: Sequence[Products], parameters: int) -> Products:
    """Products of models of the same rows one after another, their parameters filled up to so many.

    Of several models u must be 1.
    """
    curves = [part for part in parts if isinstance(part, CurveProducts)]
    if curves:
        slopes = [part.force_slopes for part in curves if part.force_slopes is not None]
        force = np.concatenate([part.force for part in curves])
        return CurveProducts(curves[0].lines, force, np.concatenate(slopes) if slopes else None)
    filled = [part.filled(parameters) for part in parts if isinstance(part, FrfProducts)]
    return filled[0] if len(filled) == 1 else FrfProducts.joined(filled)
