"""Numbers that carry their derivatives with respect to a model's parameters (forward mode).

Only what physics and mechanisms need: arithmetic, a few functions, selecting rows, and `chain` for everything else.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from underskin.units import Array, Indices, Mask


class Differentiated:
    """An array with its derivatives: `value`, (…, rows), and `slopes`, with the parameters along its first axis.

    A single row is broadcast to all rows. Axes before the rows are those of several points at which a model is
    evaluated at once. In a mechanism the derivatives are those with respect to the fit coordinates of the model's
    parameters; a function of `underskin.physics` states its own variables.
    """

    __slots__ = ("slopes", "value")
    __array_ufunc__ = None  # so that array * Differentiated comes here

    def __init__(self, value: Array, slopes: Array) -> None:
        self.value = value
        self.slopes = slopes

    def __add__(self, other: Differentiated | Array | complex) -> Differentiated:
        if isinstance(other, Differentiated):
            return Differentiated(self.value + other.value, self.slopes + other.slopes)
        value = self.value + other
        if self.slopes.shape[1:] == value.shape:
            return Differentiated(value, self.slopes)
        return Differentiated(value, np.broadcast_to(self.slopes, (len(self.slopes), *value.shape)))

    __radd__ = __add__

    def __neg__(self) -> Differentiated:
        return Differentiated(-self.value, -self.slopes)

    def __sub__(self, other: Differentiated | Array | complex) -> Differentiated:
        return self + (-other)

    def __rsub__(self, other: Array | complex) -> Differentiated:
        return (-self) + other

    def __mul__(self, other: Differentiated | Array | complex) -> Differentiated:
        if isinstance(other, Differentiated):
            return Differentiated(self.value * other.value, self.slopes * other.value + self.value * other.slopes)
        return Differentiated(self.value * other, self.slopes * other)

    __rmul__ = __mul__

    def __truediv__(self, other: Differentiated | Array | complex) -> Differentiated:
        if isinstance(other, Differentiated):
            quotient = self.value / other.value
            return Differentiated(quotient, (self.slopes - quotient * other.slopes) / other.value)
        return self * (1 / other)

    def __rtruediv__(self, other: Array | complex) -> Differentiated:
        inverse = 1 / self.value
        return Differentiated(other * inverse, -other * inverse**2 * self.slopes)

    def __pow__(self, exponent: float) -> Differentiated:
        power = self.value ** (exponent - 1)
        return Differentiated(power * self.value, exponent * power * self.slopes)

    def __getitem__(self, rows: Any) -> Differentiated:
        """The rows that an index array or slice selects; a single row stays one."""
        if self.value.shape[-1] == 1:
            return self
        return Differentiated(self.value[..., rows], self.slopes[..., rows])

    def spread(self, rows: int) -> Differentiated:
        """The same with this number of rows, where a single row is broadcast."""
        if self.value.shape[-1] == self.slopes.shape[-1] == rows:
            return self
        return Differentiated(
            np.broadcast_to(self.value, (*self.value.shape[:-1], rows)),
            np.broadcast_to(self.slopes, (*self.slopes.shape[:-1], rows)),
        )

    def at_points(self, subset: Indices | None) -> Differentiated:
        """At some of several points (points, rows), at all for None."""
        if subset is None or len(self.value) == 1:
            return self
        return Differentiated(self.value[subset], self.slopes[:, subset])

    def times(self, factor: Differentiated | None, subset: Indices | None, points: int) -> Differentiated:
        """Multiplied by a factor at some of the points; None stands for 1, and for all points."""
        if factor is None:
            return self
        return self * factor if subset is None else self._with(subset, self.at_points(subset) * factor, points)

    def plus(self, term: Differentiated, subset: Indices | None, points: int) -> Differentiated:
        """With a term added at some of the points; None stands for all."""
        return self + term if subset is None else self._with(subset, self.at_points(subset) + term, points)

    def _with(self, subset: Indices, changed: Differentiated, points: int) -> Differentiated:
        shape = points, max(self.value.shape[-1], changed.value.shape[-1])
        dtype = np.result_type(self.value, changed.value)
        value = np.broadcast_to(self.value, shape).astype(dtype)
        slopes = np.broadcast_to(self.slopes, (len(self.slopes), *shape)).astype(dtype)
        value[subset], slopes[:, subset] = changed.value, changed.slopes
        return Differentiated(value, slopes)


def exp(x: Differentiated) -> Differentiated:
    """e^x, with the derivative e^x x′."""
    value = np.exp(x.value)
    return Differentiated(value, value * x.slopes)


def log(x: Differentiated) -> Differentiated:
    """The natural logarithm of a positive x, with the derivative x′/x."""
    return Differentiated(np.log(x.value), x.slopes / x.value)


def cbrt(x: Differentiated) -> Differentiated:
    """The real cube root y of a positive x, with the derivative y x′/(3x)."""
    value = np.cbrt(x.value)
    return Differentiated(value, x.slopes * (value / (3 * x.value)))


def chain(value: Array, *terms: tuple[Array, Differentiated]) -> Differentiated:
    """A function f of several variables by the chain rule, f′ = Σ ∂f/∂x · x′.

    Parameters
    ----------
    value
        f at the variables' values, shape (rows,).
    *terms
        For each variable, the partial derivative ∂f/∂x, shape (rows,), and the variable x.

    Returns
    -------
    Differentiated
        f with its derivatives, in the unit of `value`.
    """
    slopes = sum(partial * x.slopes for partial, x in terms)
    return Differentiated(value, np.asarray(slopes))


def where(condition: Mask, yes: Differentiated, no: Differentiated | float) -> Differentiated:
    """`yes` in the rows where `condition` (rows,) holds, `no` in the others."""
    if not isinstance(no, Differentiated):
        return Differentiated(np.where(condition, yes.value, no), np.where(condition, yes.slopes, 0.0))
    return Differentiated(np.where(condition, yes.value, no.value), np.where(condition, yes.slopes, no.slopes))


def constant(value: Array | float, parameters: int, points: tuple[int, ...] = ()) -> Differentiated:
    """A number whose derivatives by all parameters are 0, at all points."""
    rows = np.atleast_1d(np.asarray(value))
    ones = (1,) * len(points)
    return Differentiated(rows.reshape(*ones, -1), np.zeros((parameters, *ones, 1)))


def stacked(parts: Sequence[Differentiated], points: Sequence[int]) -> Differentiated:
    """Several with (points, rows), concatenated along the points; `points` is the number of each."""
    if len(parts) == 1:
        return parts[0]
    rows = max(part.value.shape[-1] for part in parts)
    shapes = [(count, rows) for count in points]
    value = [np.broadcast_to(part.value, shape) for part, shape in zip(parts, shapes, strict=True)]
    slopes = [
        np.broadcast_to(part.slopes, (len(part.slopes), *shape)) for part, shape in zip(parts, shapes, strict=True)
    ]
    return Differentiated(np.concatenate(value), np.concatenate(slopes, axis=1))


def as_columns(x: Differentiated) -> tuple[Array, Array]:
    """Value (points, rows) and derivatives (variables, points, rows) as contiguous arrays, for compiled functions."""
    value, slopes = x.value, x.slopes
    if slopes.shape[1:] != value.shape:
        slopes = np.broadcast_to(slopes, (len(slopes), *value.shape))
    if value.ndim != 2:
        rows = value.shape[-1]
        points = value.size // rows
        value, slopes = value.reshape(points, rows), slopes.reshape(len(slopes), points, rows)
    return contiguous(value), contiguous(slopes)


def contiguous(x: Array) -> Array:
    """The array as compiled functions take it: itself, or a copy where it is a view or read-only."""
    return x if x.flags.c_contiguous and x.flags.writeable else x.copy()


def unfilled(parameters: int, shape: tuple[int, ...]) -> Differentiated:
    """An uninitialised result for a compiled function."""
    return Differentiated(np.empty(shape), np.empty((parameters, *shape)))


def sum_rows(x: Differentiated, owner: Indices, rows: int) -> Differentiated:
    """Sums over groups of rows.

    Parameters
    ----------
    x
        The terms, shape (…, terms), or a single row that stands for all of them.
    owner
        Which row of the result each term belongs to, shape (terms,).
    rows
        How many rows the result has.

    Returns
    -------
    Differentiated
        Shape (…, rows); 0 in a row that no term belongs to.
    """
    x = x.spread(len(owner))
    return Differentiated(_summed(x.value, owner, rows), _summed(x.slopes, owner, rows))


def _summed(terms: Array, owner: Indices, rows: int) -> Array:
    sets = int(np.prod(terms.shape[:-1]))
    target = (rows * np.arange(sets)[:, None] + owner).ravel()
    return np.bincount(target, terms.ravel(), sets * rows).reshape(*terms.shape[:-1], rows)
