"""The inner products over the lines of FRFs: see `products`."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
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
from underskin.weak_cache import cached_while_alive

_LARGE, _FULL = 2000, 0.7  # rows for each contact, and their share of a block, from which on a block is dense


class FrfLines:
    """The measured lines of FRFs as sums of what a model's distinct lines have over the rows of each recording.

    `weight` are those with 1/d², `real` and `imag` with the parts of y/d²; `uu`, `uy` and `yy` are sums for u = 1.
    """

    def __init__(self, lines: Lines, design: FrfDesign) -> None:
        """Place the weights; the design says which distinct line each row is."""
        weight = lines.deviation**-2.0
        rows = weight, weight * lines.value.real, weight * lines.value.imag
        self.weight, self.real, self.imag = (RowSums(values, lines, design) for values in rows)
        self.uu, self.uy = (np.add.reduceat(values, lines.first) for values in rows[:2])
        self.yy = np.abs(np.add.reduceat(weight * lines.value, lines.first)) ** 2 / self.uu


class RowSums:
    """Sums over the rows of each recording, each row with a weight: of values on distinct lines (…, lines), (…,
    recordings).

    A contact's distinct lines stand together, so its recordings are a block of one matrix. Where blocks are large and
    full they are dense.
    """

    def __init__(self, weight: Floats, lines: Lines, design: FrfDesign) -> None:
        """`weight` (rows,)."""
        shape = lines.recordings, len(design.line_frequency)
        by_recording = np.append(lines.first, len(weight))
        sparse = csr_array((weight, design.line, by_recording), shape=shape)
        self._sparse: csr_array | None = None
        self._recordings = lines.recordings
        self._blocks: list[tuple[Indices, slice, Floats]] = []
        contact = design.line_contact[design.line[lines.first]]
        own = [np.flatnonzero(contact == number) for number in np.unique(contact)]
        edges = np.searchsorted(design.line_contact, [*np.unique(contact), contact.max() + 1])
        spans = [slice(low, high) for low, high in pairwise(edges.tolist())]
        numbers = sum(len(some) * (span.stop - span.start) for some, span in zip(own, spans, strict=True))
        if len(weight) > max(_LARGE * len(own), _FULL * numbers):
            self._blocks = [(some, span, _block(sparse, some, span)) for some, span in zip(own, spans, strict=True)]
        else:
            self._sparse = sparse

    def __call__(self, values: Floats) -> Floats:
        """Of values on distinct lines."""
        flat = values.reshape(-1, values.shape[-1])
        if self._sparse is not None:
            return np.asarray((self._sparse @ flat.T).T.reshape(*values.shape[:-1], -1))
        total = np.empty((len(flat), self._recordings))
        for recordings, span, block in self._blocks:
            total[:, recordings] = flat[:, span] @ block.T
        return total.reshape(*values.shape[:-1], -1)


def _block(sparse: csr_array, recordings: Indices, span: slice) -> Floats:
    """(recordings, lines) of one contact."""
    return np.ascontiguousarray(sparse[recordings][:, span].toarray())


@cached_while_alive  # a diagnosis weighs dozens of models of one design
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
        slopes = level.slopes.transpose(1, 2, 0) if len(level.slopes) else None
        uu, uy = np.broadcast_to(lines.uu, level.value.shape), np.broadcast_to(lines.uy, level.value.shape)
        turning = None
        if factor is not None:
            uu, uy, turning = _turned(lines, factor.value, factor.slopes.transpose(1, 0, 2))
            turning = None if slopes is None else turning
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
        slopes = factor.slopes.transpose(1, 0, 2)[..., rows.lines] if len(factor.slopes) else None
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


def _turned(lines: FrfLines, u: Array, slopes: Array) -> tuple[Floats, Floats, SlopeSums]:
    """Re u*u, Re u*y and the sums with the derivatives v of u (points, parameters, lines)."""
    from underskin.diagnosis.inference.line_kernel import line_products, spread_sums

    moving, count = np.flatnonzero(slopes.any(axis=(0, 2))), slopes.shape[1]
    points, several = len(u), 1 + len(moving)
    each = np.empty((points, several, u.shape[1]), dtype=complex)
    each[:, 0], each[:, 1:] = u, slopes[:, moving]
    products = np.empty((points, several * (several + 1) // 2, u.shape[1]))
    real, imag = np.empty(each.shape), np.empty(each.shape)
    line_products(each, products, real, imag)
    both = np.ascontiguousarray(lines.weight(products))
    with_y = np.ascontiguousarray(lines.real(real) + lines.imag(imag))
    recordings = both.shape[-1]
    uv, vy = (np.zeros((points, recordings, count)) for _ in range(2))
    vv = np.zeros((points, recordings, count, count))
    spread_sums(both, with_y, moving, uv, vy, vv)
    return both[:, 0], with_y[:, 0], SlopeSums(uv, vy, vv)
