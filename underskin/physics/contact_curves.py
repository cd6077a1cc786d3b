"""Contacts of spheres with an elastic layer, many at once and with derivatives, as the mechanisms use them.

All is dimensionless. With E' = E/(1 − ν²), α = a/h and the work of adhesion w (JKR), the solution is the sum of a
sphere without adhesion and a flat punch whose φ at the edge is that of adhesion:

    P = F R/(E' h³),   Δ = δ R/h²,   U = √(w/(E' h³)) R
    P = (4/3) α³ A(α) − U √(8π α³) G(α),   Δ = α² B(α) − U √(2πα) V(α),   dF/dδ = 2 E' a S(α)  (edge held)

A, B, G, V, S are 1 at α = 0 and depend only on α, the Poisson ratio and the glue line: they are solved once for each
layer at Chebyshev points in α (`contact_integral_equation`), which takes about a millisecond.

The stress follows in the same way: at the same points in α, the transforms of both pressures at given wave numbers are
contracted with the layer's transmission. This leaves a few numbers for each position of the sensor, smooth in α, and a
row costs one product of `basis` with them. Both transforms are 1 at k = 0: that of a contact is
[Ps p̂_sphere + (P − Ps) p̂_punch]/P.
"""

from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
from numpy.polynomial import chebyshev

from underskin.autodiff import Differentiated
from underskin.physics.contact_integral_equation import ContactEquation, mode_transforms
from underskin.physics.elastic_layer import Layer
from underskin.units import Floats

LARGEST_A_OVER_H = 4.0  # largest a/h
_NODES = 28
_TABLE: Floats = LARGEST_A_OVER_H / 128 * np.arange(1.0, 129.0)  # of a/h, for first guesses
_SMALLEST = 1e-12
_TOLERANCE = 1e-7  # of the last step; the remaining error is about its square

# Sums of terms: factor, exponent of α, the curve among A, G, B, V, S, and whether it is multiplied by U.
_Law = tuple[tuple[float, float, int, bool], ...]
_SPHERE_LOAD: _Law = ((4 / 3, 3.0, 0, False),)
_LOAD: _Law = (*_SPHERE_LOAD, (-np.sqrt(8 * np.pi), 1.5, 1, True))
_DEPTH: _Law = ((1.0, 2.0, 2, False), (-np.sqrt(2 * np.pi), 0.5, 3, True))
_STIFFNESS: _Law = ((1.0, 0.0, 4, False),)


@dataclass(frozen=True)
class ContactRows:
    """Contacts (rows,) with derivatives by P, U, ν and the slip of the glue line.

    NaN where there is none: below pull-off, or beyond a/h = LARGEST_A_OVER_H.

    Attributes
    ----------
    alpha : Differentiated
        a/h.
    load, depth : Differentiated
        P and Δ.
    sphere_load : Differentiated
        Ps, the share of the sphere in P; that of the punch is P − Ps ≤ 0.
    stiffness : Differentiated
        S = (dF/dδ at a fixed edge)/(2 E' a); without adhesion this is the total dF/dδ.
    """

    alpha: Differentiated
    load: Differentiated
    depth: Differentiated
    sphere_load: Differentiated
    stiffness: Differentiated


class ChebyshevInterval:
    """Interpolation of smooth functions on [0, end] at Chebyshev points; the error falls geometrically with them.

    Source: Trefethen, Approximation Theory and Approximation Practice (2013), ch. 3.

    Parameters
    ----------
    end : float
        Upper end of the interval.
    count : int
        Number of points.

    Attributes
    ----------
    nodes : ndarray, (count,)
        The interpolation points, all inside (0, end).
    """

    def __init__(self, end: float, count: int) -> None:
        self.end = end
        self.nodes = end / 2 * (1 - np.cos(np.pi * (np.arange(count) + 0.5) / count))
        transform = self.basis(self.nodes).T * (2 / count)
        transform[0] /= 2
        self._transform = transform
        self._derivative = chebyshev.chebder(np.eye(count)) * (2 / end)

    def basis(self, x: Floats) -> Floats:
        """Chebyshev polynomials at x (rows,): (rows, count). A function is `basis(x) @ coefficients`."""
        return np.asarray(chebyshev.chebvander(2 / self.end * x - 1, len(self.nodes) - 1), dtype=float)

    def coefficients(self, values: Floats) -> Floats:
        """Coefficients (count, ...) of the interpolant from values at the nodes (count, ...)."""
        return np.tensordot(self._transform, values, 1)

    def derivative(self, coefficients: Floats) -> Floats:
        """Coefficients (count, ...) of the derivative of the interpolant; the last is 0."""
        shorter = np.tensordot(self._derivative, coefficients, 1)
        return np.concatenate([shorter, np.zeros_like(coefficients[:1])])


class CurveGrid:
    """The part common to all layers: the Chebyshev points in α and the modes' transforms at given wave numbers.

    Parameters
    ----------
    wave_numbers : ndarray, (k,)
        In units of 1/h.
    """

    def __init__(self, wave_numbers: Floats) -> None:
        self.interval, self.equation = _at_nodes()
        s = np.multiply.outer(self.interval.nodes, wave_numbers)
        self.transforms = mode_transforms(s, self.equation.modes).transpose(0, 2, 1)
        self.table_basis = self.interval.basis(_TABLE)

    def curves(self, layer: Layer) -> "ContactCurves":
        """The contact curves of one layer."""
        return ContactCurves(self, layer)


@lru_cache(maxsize=64)
def curves_of(layer: Layer) -> "ContactCurves":
    """The contact curves of one layer where no stress is needed."""
    return CurveGrid(np.zeros(0)).curves(layer)


@cache
def _at_nodes() -> tuple[ChebyshevInterval, ContactEquation]:
    """The part that is also independent of the wave numbers."""
    interval = ChebyshevInterval(LARGEST_A_OVER_H, _NODES)
    return interval, ContactEquation(interval.nodes)


class ContactCurves:
    """The functions A, B, G, V, S of one layer and the transforms of the pressures.

    Attributes
    ----------
    sphere_transform, punch_transform : Differentiated, (points, k)
        At the points `interval.nodes` in α, with derivatives by ν and by the slip.
    """

    def __init__(self, grid: CurveGrid, layer: Layer) -> None:
        self.interval = grid.interval
        solved = grid.equation.solve(layer)
        ratios = (solved.sphere_force, solved.edge_force, solved.sphere_depth, solved.edge_depth, solved.stiffness)
        at_nodes = np.stack([_stacked(ratio) for ratio in ratios], axis=-1).transpose(1, 0, 2)
        coefficients = self.interval.coefficients(at_nodes)  # (count, 3, 5)
        slopes = self.interval.derivative(coefficients[:, :1])
        self._coefficients = np.concatenate([coefficients[:, :1], slopes, coefficients[:, 1:]], axis=1)
        # A, G and their slopes for the compiled function.
        self._of_load = np.ascontiguousarray(self._coefficients[:, :2, :2].reshape(-1, 4).T)
        at = self._evaluated(grid.table_basis)
        self._start = _Start(at)
        shapes = np.concatenate([_stacked(solved.sphere_shape), _stacked(solved.punch_shape)]).transpose(1, 0, 2)
        transforms = (shapes @ grid.transforms).transpose(1, 0, 2)
        self.sphere_transform = Differentiated(transforms[0], transforms[1:3])
        self.punch_transform = Differentiated(transforms[3], transforms[4:])

    def at_load(self, load: Floats, root_adhesion: Floats) -> ContactRows:
        """Contacts under given loads, on the branch that is stable under force control.

        Parameters
        ----------
        load : ndarray, (rows,)
            P [-].
        root_adhesion : ndarray, (rows,)
            U [-].
        """
        jkr = 3 * np.pi * root_adhesion**2
        equivalent = load + jkr + np.sqrt(np.maximum(jkr * (2 * load + jkr), 0.0))
        alpha = self._newton(load, root_adhesion, self._start(np.cbrt(equivalent), root_adhesion))
        at = self._evaluated(self.interval.basis(alpha))
        _, by_alpha, *partial = _law(_LOAD, alpha, root_adhesion, at)
        slopes = np.stack([1 / by_alpha, *(-x / by_alpha for x in partial)])

        def rows(law: _Law) -> Differentiated:
            value, by_alpha, *partial = _law(law, alpha, root_adhesion, at)
            total = by_alpha * slopes
            total[1:] += partial
            return Differentiated(value, total)

        laws = (_LOAD, _DEPTH, _SPHERE_LOAD, _STIFFNESS)
        return ContactRows(Differentiated(alpha, slopes), *map(rows, laws))

    def stiffness_at(self, alpha: Floats) -> Differentiated:
        """S at a/h (rows,) from 0 to LARGEST_A_OVER_H, with derivatives by α, ν and the slip."""
        value, *slopes = self._evaluated(self.interval.basis(alpha))[:, _STIFFNESS[0][2]]
        return Differentiated(value, np.stack(slopes))

    def ratios_at(self, alpha: Floats) -> Floats:
        """A, B, S and V at a/h (rows,) from 0 to LARGEST_A_OVER_H: (rows, 4)."""
        ratios = self._evaluated(self.interval.basis(alpha))[0]
        return np.stack([ratios[0], ratios[2], ratios[4], ratios[3]], axis=-1)

    def _newton(self, load: Floats, root_adhesion: Floats, start: Floats) -> Floats:
        """α from first guesses; NaN where there is none."""
        from underskin.physics.contact_kernel import radii_under_load

        alpha, of_load = start.copy(), (np.ascontiguousarray(x) for x in (load, root_adhesion))
        radii_under_load(self._of_load, LARGEST_A_OVER_H, *of_load, _SMALLEST, _TOLERANCE, alpha)
        return alpha

    def _evaluated(self, basis: Floats) -> Floats:
        """The curves' values and derivatives with respect to α, ν and slip: (4, curves, rows)."""
        flat = self._coefficients.reshape(len(self._coefficients), -1)
        values: Floats = (basis @ flat).T.reshape(4, -1, len(basis))
        return values


class _Start:
    """A first guess of α, on the stable side of P's minimum, where U = (sphere's slope)/(adhesion's slope)."""

    def __init__(self, at: Floats) -> None:
        value, slope, *_ = _law(_LOAD, _TABLE, np.zeros_like(_TABLE), at)
        adhesion = slope - _law(_LOAD, _TABLE, np.ones_like(_TABLE), at)[1]
        self._root = np.append(0.0, np.cbrt(value))
        self._critical = np.append(0.0, (slope / np.maximum(adhesion, _SMALLEST * slope)) ** (2 / 3))
        self._alpha = np.append(0.0, _TABLE)

    def __call__(self, root: Floats, root_adhesion: Floats) -> Floats:
        """From the cube root of the load that a sphere without adhesion would have, and U."""
        unstable = np.interp(root_adhesion ** (2 / 3), self._critical, self._alpha)
        start: Floats = np.maximum(np.interp(root, self._root, self._alpha), 1.02 * unstable)
        return start


def _stacked(x: Differentiated) -> Floats:
    """The value and its derivatives along the first axis: one product with a matrix serves all of them."""
    return np.concatenate([x.value[None], x.slopes])


def _law(law: _Law, alpha: Floats, root_adhesion: Floats, at: Floats) -> Floats:
    """Σ of factor · U^m · α^n · curve over the law's terms, with its derivatives by α, U, ν and slip: (5, rows)."""
    total = np.zeros((5, len(alpha)))
    for factor, exponent, column, adhesive in law:
        power: Floats = factor * alpha**exponent
        term = power * at[:, column]
        term[1] += exponent / alpha * term[0]
        total[[0, 1, 3, 4]] += root_adhesion * term if adhesive else term
        if adhesive:
            total[2] += term[0]
    return total
