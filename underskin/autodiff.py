"""Numbers that carry their derivatives with respect to a model's parameters (forward mode).

Only what physics and mechanisms need: arithmetic, a few functions, selecting rows, and `chain` for everything else.
"""

from __future__ import annotations

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
