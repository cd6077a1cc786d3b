"""Inner products over rows for the likelihood of predictions, at several points of the fit coordinates.

A prediction is m = L u in each recording: of FRFs L is the level, which is real, and u the factor of the dynamics on
each line, 1 without dynamics; of curves L = 1 and u is the force, transformed so that samples are independent. With
1/d² as the weight of rows (of curves the weight of the whitening), the sums of each recording are Re u*u, Re u*y and
|y|², and with the derivatives v of u, Re u*v, Re v*y and Re v*v. Arrays are (points, recordings, …). Rows with mains
pick-up weigh less, and the sums are corrected for it.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Any, ClassVar, Self

import numpy as np
from scipy.sparse import csr_array

from underskin.autodiff import Differentiated, contiguous
from underskin.diagnosis.data.dataset import Lines
from underskin.diagnosis.noise import SeveralLevels
from underskin.mechanisms.models.contact_state import FrfDesign, Pickup, Response
from underskin.units import Array, Floats, Indices
from underskin.weak_cache import cached_while_alive

_TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Sums:
    """Re u*u, Re u*y and |y|² of each recording, and the noise levels' contribution to log|C|.

    Of FRFs |y|² is that of each recording's mean: the rest is the same in all models (`Lines.about_means`). `departure`
    is the square of y's part across u, where it was computed as that: the difference |y|² − (Re u*y)²/u*u of curves,
    whose noise may be 1e-5 of y, has errors of rounding as large as the noise.
    """

    uu: Floats
    uy: Floats
    yy: Floats
    log_determinant: Floats | float
    departure: Floats | None = None

    @property
    def across(self) -> Floats:
        """The square of y's part across u."""
        if self.departure is not None:
            return self.departure
        return np.asarray(self.yy - self.uy**2 / np.maximum(self.uu, _TINY))


@dataclass(frozen=True)
class AtPoints:
    """Arrays over points (points, …), or further such classes; None where something is not there."""

    shared: ClassVar[Collection[str]] = ()  # the fields that are the same at all points

    def _by_points(self) -> dict[str, Any]:
        values = {field.name: getattr(self, field.name) for field in fields(self) if field.name not in self.shared}
        return {name: value for name, value in values.items() if value is not None}

    def __getitem__(self, points: Array | slice) -> Self:
        """At some of the points."""
        return replace(self, **{name: value[points] for name, value in self._by_points().items()})

    def replaced(self, points: Indices, other: Self) -> Self:
        """With `other` at some of the points, in rising order."""
        values = self._by_points()
        if not len(points):
            return self
        if len(points) == len(next(iter(values.values()))):
            return other
        for name, value in values.items():
            new = getattr(other, name)
            if isinstance(value, AtPoints):
                values[name] = value.replaced(points, new)
            else:
                values[name] = value.copy()
                values[name][points] = new
        return replace(self, **values)

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """At the points of several, one after another."""
        if len(parts) == 1:
            return parts[0]
        joined = {}
        for name, value in parts[0]._by_points().items():
            values = [getattr(part, name) for part in parts]
            joined[name] = value.joined(values) if isinstance(value, AtPoints) else np.concatenate(values)
        return replace(parts[0], **joined)


@dataclass(frozen=True)
class SlopeSums(AtPoints):
    """Re u*v and Re v*y (points, parameters, recordings), and Re v*v (points, parameters, parameters, recordings)."""

    uv: Floats
    vy: Floats
    vv: Floats

    @classmethod
    def of_moving(cls, moving: Indices, parameters: int, uv: Floats, vy: Floats, vv: Floats) -> Self:
        """Of so many parameters, from the sums with derivatives by those that are `moving`."""
        points, _, recordings = uv.shape
        sums = cls(*(np.zeros((points, *[parameters] * axes, recordings)) for axes in (1, 1, 2)))
        sums.uv[:, moving], sums.vy[:, moving], sums.vv[:, moving[:, None], moving] = uv, vy, vv
        return sums


def _squares(pairs: Floats, functions: int) -> Floats:
    """Pairs of functions in the order of the upper triangle (points, pairs, …) as (points, functions, functions, …)."""
    index = np.empty((functions, functions), dtype=np.intp)
    first, second = np.triu_indices(functions)
    index[first, second] = index[second, first] = np.arange(len(first))
    return pairs[:, index]


class PickupRows:
    """The rows that mains pick-up reaches, in order of recordings.

    Attributes: `lines`, which of a model's distinct lines they are on; `line`, the index of each row's line among
    these.
    """

    def __init__(self, lines: Lines, pickup: Pickup, design: FrfDesign) -> None:
        """`design` gives the distinct line of each row."""
        rows = pickup.rows
        self.recordings = lines.recordings
        alike = np.arange(len(rows)) if pickup.alike is None else pickup.alike
        self.lines, line = np.unique(design.line[rows], return_inverse=True)
        self.line: Indices = line.reshape(-1)
        weight, value = lines.deviation[rows] ** -2.0, contiguous(lines.value[rows])
        self.columns = alike, weight, lines.recording[rows], value, self.line  # as compiled functions take them


@cached_while_alive  # a diagnosis evaluates dozens of models of one design
def pickup_rows(lines: Lines, pickup: Pickup, design: FrfDesign) -> PickupRows:
    """The rows of these lines that a pick-up reaches, for models of this design."""
    return PickupRows(lines, pickup, design)


class CurveLines:
    """The measured samples of curves, transformed so that their covariance is diagonal."""

    def __init__(self, lines: Lines) -> None:
        """Transform them; the lines must have a smooth error."""
        assert lines.whitening is not None
        self.whitening = lines.whitening
        self.first = lines.first
        self.measured = self.whitening.turned(lines.value.real)
        self.columns = self.whitening.columns
        self.edges = np.append(lines.first, len(self.measured))


@dataclass(frozen=True)
class CurveProducts(AtPoints):
    """Of curves: forces (points, samples) and derivatives (points, parameters, samples) on transformed samples."""

    lines: CurveLines
    force: Floats
    force_slopes: Floats | None
    shared = ("lines",)
    level_slopes = None
    squared_slopes = None

    @classmethod
    def of(cls, lines: CurveLines, force: Floats, slopes: Floats | None) -> Self:
        """Of a model's predictions (points, samples), and of their derivatives."""
        turned = lines.whitening.turned
        return cls(lines, turned(force), None if slopes is None else turned(slopes))

    def __len__(self) -> int:
        return len(self.force)

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
        from underskin.diagnosis.kernels import curve_sums

        lines, force = self.lines, contiguous(self.force)
        ratio, level = (levels.smooth / levels.level)[..., 0], levels.level[..., 0]
        shape = np.broadcast_shapes((len(force), 1), ratio.shape)
        sums, log_determinant = np.empty((4, *shape, len(lines.first))), np.empty(shape)
        wide = (contiguous(np.broadcast_to(values, shape)) for values in (ratio, level))
        curve_sums(
            force, lines.measured, lines.columns, lines.whitening.size, lines.edges, *wide, sums, log_determinant
        )
        return Sums(sums[0], sums[1], sums[2], log_determinant[..., None], sums[3])

    def slope_sums(self, levels: SeveralLevels) -> SlopeSums:
        """The sums with derivatives, at the first of the sets of noise levels."""
        assert self.force_slopes is not None
        measured = np.broadcast_to(self.lines.measured, self.force.shape)
        rows = np.concatenate([self.force_slopes, self.force[:, None], measured[:, None]], axis=1)
        grams = np.stack([*self._grams(rows, levels)], axis=-1)
        return SlopeSums(grams[:, :-2, -2], grams[:, :-2, -1], grams[:, :-2, :-2])

    def with_force_changes(self, rows: Floats, levels: SeveralLevels) -> tuple[Floats, Floats]:
        """Re u*J (P, recordings) and Re JᵀJ (P, P) of changes of the force J (P, samples), at the first point and set
        of noise levels."""
        changes = np.concatenate([self.lines.whitening.turned(rows), self.force[:1]])[None]
        along, square = [], np.zeros((len(rows), len(rows)))
        for (gram,) in self._grams(changes, levels):
            along.append(gram[-1, :-1])
            square += gram[:-1, :-1]
        return np.stack(along, axis=1), square

    def _grams(self, rows: Floats, levels: SeveralLevels) -> Iterator[Floats]:
        """Of each recording the products κ² X C⁻¹ Xᵀ (points, P, P) of transformed rows X (points, P, samples), with
        C = κ² D + η² B + P Pᵀ by Woodbury's identity, at the first of the sets of noise levels."""
        lines, level = self.lines, levels.level[:, :1]
        weight = lines.whitening.weight(levels.smooth[:, :1] / level)
        for low, high in pairwise(lines.edges):
            weighed, columns = weight[..., low:high] * rows[..., low:high], lines.columns[:, low:high]
            by_columns = weighed @ columns.T
            inverse = np.linalg.inv(weight[..., low:high] * columns @ columns.T + level**2 * np.eye(len(columns)))
            yield weighed @ rows[..., low:high].swapaxes(1, 2) - by_columns @ inverse @ by_columns.swapaxes(1, 2)


_LARGE, _FULL = 2000, 0.7  # rows for each contact, and their share of a block, above which blocks are dense


class FrfLines:
    """The measured lines of FRFs, as weighted sums over the rows of each recording.

    `weight` are sums with 1/d², `real` and `imag` with the parts of y/d²; `uu`, `uy` and `yy` are the sums for u = 1.
    """

    def __init__(self, lines: Lines, design: FrfDesign) -> None:
        """`design` gives the distinct line of each row."""
        weight = lines.deviation**-2.0
        rows = weight, weight * lines.value.real, weight * lines.value.imag
        self.weight, self.real, self.imag = (RowSums(values, lines, design) for values in rows)
        self.uu, self.uy = (np.add.reduceat(values, lines.first) for values in rows[:2])
        self.yy = np.abs(np.add.reduceat(weight * lines.value, lines.first)) ** 2 / self.uu


class RowSums:
    """Weighted sums over the rows of each recording: of values on distinct lines (…, lines), (…, recordings).

    A contact's distinct lines are contiguous, so its recordings are a block of one matrix. Blocks are dense where they
    are large and full, else the matrix is sparse.
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
        members = [np.flatnonzero(contact == number) for number in np.unique(contact)]
        edges = np.searchsorted(design.line_contact, [*np.unique(contact), contact.max() + 1])
        spans = [slice(low, high) for low, high in pairwise(edges.tolist())]
        numbers = sum(
            len(recordings) * (span.stop - span.start) for recordings, span in zip(members, spans, strict=True)
        )
        if len(weight) > max(_LARGE * len(members), _FULL * numbers):
            self._blocks = [
                (recordings, span, _block(sparse, recordings, span))
                for recordings, span in zip(members, spans, strict=True)
            ]
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


@cached_while_alive  # a diagnosis evaluates dozens of models of one design
def frf_lines(lines: Lines, design: FrfDesign) -> FrfLines:
    """The matrices of these lines for models of this design."""
    return FrfLines(lines, design)


@dataclass(frozen=True)
class FrfProducts(AtPoints):
    """Of FRFs; `turning`, the sums with derivatives of u, is None where u is 1 or derivatives were not requested."""

    yy: Floats  # (recordings,)
    uu: Floats  # (points, recordings)
    uy: Floats
    level: Floats
    level_slopes: Floats | None  # (points, parameters, recordings)
    squared_slopes: Floats | None  # |t|² of the slopes over the contact's place (points, recordings)
    turning: SlopeSums | None
    pickup: "PickupProducts | None" = None
    shared = ("yy",)

    @classmethod
    def of(cls, lines: FrfLines, pickup: PickupRows | None, response: Response) -> Self:
        """Of a model's response at several points, with the rows of its pick-up."""
        level, factor = response.level, response.lines
        slopes = level.slopes.transpose(1, 0, 2) if len(level.slopes) else None
        uu, uy = np.broadcast_to(lines.uu, level.value.shape), np.broadcast_to(lines.uy, level.value.shape)
        turning = None
        if factor is not None:
            uu, uy, turning = _products_of_factor(lines, factor.value, factor.slopes.transpose(1, 0, 2))
            turning = None if slopes is None else turning
        of_pickup = None if pickup is None else PickupProducts.of(pickup, len(level.value), factor)
        place = None if response.place_slopes is None else (response.place_slopes**2).sum(axis=0)
        return cls(lines.yy, uu, uy, level.value, slopes, place, turning, of_pickup)

    def __len__(self) -> int:
        return len(self.level)

    @property
    def values(self) -> Self:
        """Without derivatives by the parameters."""
        pickup = None if self.pickup is None else replace(self.pickup, v=None)
        return replace(self, level_slopes=None, turning=None, pickup=pickup)

    def scaled(self, factor: Floats) -> Self:
        """With levels multiplied by `factor` (points,)."""
        column = factor[:, None]
        level_slopes = None if self.level_slopes is None else self.level_slopes * column[..., None]
        squared = None if self.squared_slopes is None else self.squared_slopes * column**2
        return replace(self, level=self.level * column, level_slopes=level_slopes, squared_slopes=squared)

    def summed(self, levels: SeveralLevels) -> Sums:
        """The sums at noise levels (points, sets, 1), as (points, sets, recordings)."""
        sums = Sums(self.uu[:, None], self.uy[:, None], self.yy, 0.0)
        return sums if self.pickup is None else self.pickup.without_pickup(sums, levels)

    def slope_sums(self, levels: SeveralLevels) -> SlopeSums | None:
        """The sums with derivatives, at the first of the sets of noise levels; None where u is 1."""
        if self.pickup is None or self.turning is None:
            return self.turning
        return self.pickup.slopes_without_pickup(self.turning, levels)


@dataclass(frozen=True)
class PickupProducts(AtPoints):
    """u (points, lines) and v (points, parameters, lines) on the distinct lines of the rows with pick-up; v is None
    where it is 0."""

    rows: PickupRows
    u: Array
    v: Array | None
    shared = ("rows",)

    @classmethod
    def of(cls, rows: PickupRows, points: int, factor: Differentiated | None) -> Self:
        """Of the dynamics' factor on a model's distinct lines."""
        if factor is None:
            return cls(rows, np.ones((points, len(rows.lines)), dtype=complex), None)
        slopes = factor.slopes.transpose(1, 0, 2)[..., rows.lines] if len(factor.slopes) else None
        return cls(rows, factor.value[:, rows.lines], slopes)

    def without_pickup(self, sums: Sums, levels: SeveralLevels) -> Sums:
        """The sums corrected for pick-up."""
        from underskin.diagnosis.kernels import subtract_pickup

        assert levels.pickup is not None
        shape = *levels.level.shape[:2], self.rows.recordings
        uu, uy, yy = (np.broadcast_to(x, shape).copy() for x in (sums.uu, sums.uy, sums.yy))
        log_determinant = np.zeros(shape[:2])
        square = np.ascontiguousarray(np.swapaxes((levels.pickup / levels.level) ** 2, 1, 2))
        u = contiguous(self.u.astype(complex, copy=False))
        subtract_pickup(square, *self.rows.columns, u, uu, uy, yy, log_determinant)
        return Sums(uu, uy, yy, log_determinant[..., None])

    def slopes_without_pickup(self, sums: SlopeSums, levels: SeveralLevels) -> SlopeSums:
        """The sums with derivatives corrected for pick-up, at the first of the sets of noise levels."""
        assert levels.pickup is not None
        if self.v is None:
            return sums
        alike, precision, recording, y, line = self.rows.columns
        x = ((levels.pickup[:, 0] / levels.level[:, 0]) ** 2)[:, alike] * precision
        moving = np.flatnonzero(self.v.any(axis=(0, 2)))
        functions = np.concatenate([self.u[:, None], self.v[:, moving]], axis=1)[..., line]
        functions = np.concatenate([functions, np.broadcast_to(y, (len(x), 1, len(y)))], axis=1)
        first, second = np.triu_indices(functions.shape[1])
        lost = (functions[:, first].conj() * functions[:, second]).real * (x / (1 + x) * precision)[:, None]
        with_rows, starts = np.unique(recording, return_index=True)
        pairs = np.zeros((*lost.shape[:2], self.rows.recordings))
        pairs[..., with_rows] = np.add.reduceat(lost, starts, axis=-1)
        square = _squares(pairs, functions.shape[1])
        parts = square[:, 0, 1:-1], square[:, 1:-1, -1], square[:, 1:-1, 1:-1]
        less = SlopeSums.of_moving(moving, self.v.shape[1], *parts)
        return SlopeSums(sums.uv - less.uv, sums.vy - less.vy, sums.vv - less.vv)


def _products_of_factor(lines: FrfLines, u: Array, slopes: Array) -> tuple[Floats, Floats, SlopeSums]:
    """Re u*u, Re u*y and the sums with the derivatives v of u (points, parameters, lines)."""
    from underskin.diagnosis.kernels import line_products

    moving = np.flatnonzero(slopes.any(axis=(0, 2)))
    functions = contiguous(np.concatenate([u[:, None], slopes[:, moving]], axis=1, dtype=complex))
    points, several, numbers = functions.shape
    products = np.empty((points, several * (several + 1) // 2, numbers))
    real, imag = np.empty(functions.shape), np.empty(functions.shape)
    line_products(functions, products, real, imag)
    both, with_y = _squares(lines.weight(products), several), lines.real(real) + lines.imag(imag)
    sums = SlopeSums.of_moving(moving, slopes.shape[1], both[:, 0, 1:], with_y[:, 1:], both[:, 1:, 1:])
    return both[:, 0, 0], with_y[:, 0], sums


Products = FrfProducts | CurveProducts
