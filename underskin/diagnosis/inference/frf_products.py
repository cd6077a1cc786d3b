"""The inner products over the lines of FRFs: see `products`."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Self

import numpy as np
from scipy.sparse import csr_array

from underskin.autodiff import Differentiated
from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.inference.pickup_rows import PickupRows
from underskin.diagnosis.inference.sums import SlopeSums, Sums
from underskin.diagnosis.noise.noise_levels import SeveralLevels
from underskin.mechanisms.models.frf_design import FrfDesign
from underskin.mechanisms.models.response import Response
from underskin.units import Array, Floats, Indices


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
        self.yy = np.abs(np.add.reduceat(weight * lines.value, lines.first)) ** 2 / self.uu


@lru_cache(maxsize=4)  # by identity: a diagnosis weighs dozens of models of one design
def frf_lines(lines: Lines, design: FrfDesign) -> FrfLines:
    """The matrices of these lines for models of this design."""
    return FrfLines(lines, design)


@dataclass(frozen=True)
class FrfProducts:
    """Of FRFs; `turning` is None where u is 1, or where no derivatives were asked for."""

    yy: Floats  # (recordings,)
    uu: Floats  # (points, recordings)
    uy: Floats
    level: Floats
    level_slopes: Floats | None  # (points, recordings, parameters)
    place_slopes: Floats | None  # (2, points, recordings)
    turning: SlopeSums | None
    pickup: "PickupProducts | None" = None

    @classmethod
    def of(cls, lines: FrfLines, pickup: PickupRows | None, response: Response) -> Self:
        """Of a model's response at several points, and the rows that its pick-up reaches."""
        level, factor = response.level, response.lines
        slopes = np.moveaxis(level.slopes, 0, -1) if len(level.slopes) else None
        uu, uy = np.broadcast_to(lines.uu, level.value.shape), np.broadcast_to(lines.uy, level.value.shape)
        turning = None
        if factor is not None:
            u = factor.value
            uu = _over_rows(lines.weight, u.real**2 + u.imag**2)
            uy = _over_rows(lines.real, u.real) + _over_rows(lines.imag, u.imag)
            turning = None if slopes is None else _turning(lines, u, np.moveaxis(factor.slopes, 0, 1))
        of_pickup = None if pickup is None else PickupProducts.of(pickup, len(level.value), factor)
        return cls(lines.yy, uu, uy, level.value, slopes, response.place_slopes, turning, of_pickup)

    def __len__(self) -> int:
        return len(self.level)

    def __getitem__(self, points: Array | slice) -> Self:
        """At some of the points."""
        place, slopes = self.place_slopes, self.level_slopes
        return replace(
            self,
            uu=self.uu[points],
            uy=self.uy[points],
            level=self.level[points],
            level_slopes=None if slopes is None else slopes[points],
            place_slopes=None if place is None else place[:, points],
            turning=None if self.turning is None else self.turning[points],
            pickup=None if self.pickup is None else self.pickup[points],
        )

    @property
    def values(self) -> Self:
        """Without derivatives by the parameters."""
        pickup = None if self.pickup is None else replace(self.pickup, v=None)
        return replace(self, level_slopes=None, turning=None, pickup=pickup)

    @classmethod
    def joined(cls, parts: Sequence["FrfProducts"], parameters: int) -> Self:
        """At the points of several, one after another, with so many parameters in all."""
        filled = [part.filled(parameters, turning=any(one.turning for one in parts)) for part in parts]

        def of(name: str, axis: int = 0) -> Any:
            values = [getattr(part, name) for part in filled]
            return None if values[0] is None else np.concatenate(values, axis=axis)

        level = of("level"), of("level_slopes"), of("place_slopes", axis=1)
        turning = [part.turning for part in filled if part.turning is not None]
        pickup = [part.pickup for part in filled if part.pickup is not None]
        return cls(
            parts[0].yy,
            of("uu"),
            of("uy"),
            *level,
            SlopeSums.joined(turning) if turning else None,
            PickupProducts.joined(pickup) if pickup else None,
        )

    def filled(self, parameters: int, *, turning: bool) -> Self:
        """With derivatives that are 0 by further parameters, so many in all, also those of u where it has none."""
        slopes = self.level_slopes
        if slopes is None:
            return self
        further = parameters - slopes.shape[-1]
        slopes = np.pad(slopes, ((0, 0), (0, 0), (0, further))) if further else slopes
        own = self.turning
        if own is None:
            none = np.zeros_like(slopes)
            own = (
                SlopeSums(none, none, np.broadcast_to(none[..., None], (*none.shape, parameters))) if turning else None
            )
        elif further:
            uv, vy = (np.pad(values, ((0, 0), (0, 0), (0, further))) for values in (own.uv, own.vy))
            own = SlopeSums(uv, vy, np.pad(own.vv, ((0, 0), (0, 0), (0, further), (0, further))))
        pickup = None if self.pickup is None else self.pickup.filled(parameters)
        return replace(self, level_slopes=slopes, turning=own, pickup=pickup)

    def scaled(self, factor: Floats) -> Self:
        """Of levels so many times as large (points,)."""
        by = factor[:, None]
        slopes = None if self.level_slopes is None else self.level_slopes * by[..., None]
        place = None if self.place_slopes is None else self.place_slopes * by
        return replace(self, level=self.level * by, level_slopes=slopes, place_slopes=place)

    def summed(self, levels: SeveralLevels) -> Sums:
        """The sums at noise levels (points, sets, 1), as (points, sets, recordings)."""
        sums = Sums(self.uu[:, None], self.uy[:, None], self.yy, 0.0)
        return sums if self.pickup is None else self.pickup.less(sums, levels)

    def slope_sums(self, levels: SeveralLevels) -> SlopeSums | None:
        """The sums with derivatives, at the first of the sets of noise levels; None where u is 1."""
        if self.pickup is None or self.turning is None:
            return self.turning
        return self.pickup.slopes_less(self.turning, levels)


@dataclass(frozen=True)
class PickupProducts:
    """On the distinct lines of the rows that pick-up reaches u (points, lines) and v (points, parameters, lines), None
    where it is 0; `line` says which of them each row is on."""

    rows: PickupRows
    line: Indices
    u: Array
    v: Array | None

    @classmethod
    def of(cls, rows: PickupRows, points: int, factor: Differentiated | None) -> Self:
        """Of the dynamics' factor on a model's distinct lines."""
        if factor is None:
            return cls(rows, rows.line, np.ones((points, len(rows.lines)), dtype=complex), None)
        slopes = np.moveaxis(factor.slopes, 0, 1)[..., rows.lines] if len(factor.slopes) else None
        return cls(rows, rows.line, factor.value[:, rows.lines], slopes)

    def __getitem__(self, points: Array | slice) -> Self:
        """At some of the points."""
        return replace(self, u=self.u[points], v=None if self.v is None else self.v[points])

    @classmethod
    def joined(cls, parts: Sequence["PickupProducts"]) -> Self:
        """At the points of several, one after another; on the rows themselves where models' distinct lines differ."""
        first = parts[0]
        if any(part.line is not first.line for part in parts):
            parts = [part._on_rows() for part in parts]
        slopes = [part.v for part in parts if part.v is not None]
        return cls(
            first.rows,
            parts[0].line,
            np.concatenate([part.u for part in parts]),
            np.concatenate(slopes) if slopes else None,
        )

    def _on_rows(self) -> Self:
        return replace(
            self,
            line=self.rows.every,
            u=self.u[:, self.line],
            v=None if self.v is None else self.v[..., self.line],
        )

    def filled(self, parameters: int) -> Self:
        """With derivatives that are 0 by further parameters, so many in all."""
        v = np.zeros((*self.u.shape[:1], 0, self.u.shape[1]), dtype=complex) if self.v is None else self.v
        return replace(self, v=np.pad(v, ((0, 0), (0, parameters - v.shape[1]), (0, 0))))

    def less(self, sums: Sums, levels: SeveralLevels) -> Sums:
        """The sums less what rows lose to pick-up."""
        assert levels.pickup is not None
        return self.rows.less(sums, self.line, self.u, levels.pickup, levels.level)

    def slopes_less(self, sums: SlopeSums, levels: SeveralLevels) -> SlopeSums:
        """The sums with derivatives less what rows lose, at the first of the sets of noise levels."""
        assert levels.pickup is not None
        if self.v is None:
            return sums
        return self.rows.slopes_less(sums, self.line, self.u, self.v, levels.pickup[:, 0], levels.level[:, 0, 0])


def _over_rows(matrix: csr_array, values: Floats) -> Floats:
    """Sums over the rows of each recording of values on distinct lines: (…, lines) to (…, recordings)."""
    flat = matrix @ values.reshape(-1, values.shape[-1]).T
    return np.asarray(flat.T.reshape(*values.shape[:-1], -1))


def _turning(lines: FrfLines, u: Array, slopes: Array) -> SlopeSums:
    """The sums with the derivatives v of u (points, parameters, lines)."""
    moving = np.flatnonzero(slopes.any(axis=(0, 2)))
    v, count = slopes[:, moving], slopes.shape[1]
    uv = np.moveaxis(_over_rows(lines.weight, (u.conj()[:, None] * v).real), 1, -1)
    vy = np.moveaxis(_over_rows(lines.real, v.real) + _over_rows(lines.imag, v.imag), 1, -1)
    one, other = np.triu_indices(len(moving))
    vv = _over_rows(lines.weight, (v[:, one].conj() * v[:, other]).real)
    whole = SlopeSums(*(np.zeros((*uv.shape[:2], *further)) for further in ((count,), (count,), (count, count))))
    whole.uv[..., moving], whole.vy[..., moving] = uv, vy
    for number, (a, b) in enumerate(zip(moving[one], moving[other], strict=True)):
        whole.vv[..., a, b] = whole.vv[..., b, a] = vv[:, number]
    return whole
