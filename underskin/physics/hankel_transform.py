"""The stress under a surface load as an inverse Hankel transform, lengths in units of the depth h.

A normal surface load of total force F with the (normalised) transform p̂(k) puts on a plane at depth h the stress
T3 = −(3/2π)(F/h²) · s, whose average over a disc of radius ρ, its centre a distance e from the load's axis, is

    s(e, ρ) = (1/3) ∫₀^∞ p̂(k) M(k) [2 J1(kρ)/(kρ)] J0(k e) k dk

with M the transmission of the body: 1 at k = 0, falling like (1 + k) e^(−k) or 2 (1 + k) e^(−k), so that the
integral ends at k = 44 for double precision. Source: Sneddon, Fourier Transforms (1951), ch. 10.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import j0, j1

from underskin.units import Floats

Transform = Callable[[Floats], Floats]

_END = 44.0
_ROWS_AT_ONCE = 2048


def hertz_transform(s: Floats) -> Floats:
    """Transform p̂ of the Hertz pressure, 3 (sin s − s cos s)/s³, with s = k a/h; 1 at s = 0."""
    small = np.abs(s) < 0.05
    safe = np.where(small, 1.0, s)
    series = 1 - s**2 / 10 + s**4 / 280
    return np.where(small, series, 3 * (np.sin(safe) - safe * np.cos(safe)) / safe**3)


def punch_transform(s: Floats) -> Floats:
    """Transform p̂ of the pressure of a flat punch, sin s/s."""
    return np.sinc(s / np.pi)


def disc_average(s: Floats) -> Floats:
    """Transform of the average over a disc, 2 J1(s)/s with s = k ρ; 1 at s = 0."""
    small = np.abs(s) < 1e-4
    safe = np.where(small, 1.0, s)
    return np.where(small, 1 - s**2 / 8, 2 * j1(safe) / safe)


def normal_stress(
    transmission: Transform, pressure: Transform, a: ArrayLike, rho: ArrayLike, offset: ArrayLike = 0.0
) -> Floats:
    """Mean normal stress s(e, ρ) on a disc, in units of 3F/(2πh²), under a normal axisymmetric load.

    Parameters
    ----------
    transmission : callable
        M(k), (k,) to (k,).
    pressure : callable
        p̂ as a function of s = k a/h.
    a : array_like
        Radius of the load a/h [-].
    rho : array_like
        Radius of the disc ρ [-]; 0 is a point.
    offset : array_like
        Distance e of the disc's centre from the axis of the load [-].

    Returns
    -------
    ndarray
        [-], of the broadcast shape.
    """
    return _transform(transmission, pressure, j0, a, rho, offset)


def tangential_stress(transmission: Transform, rho: ArrayLike, offset: ArrayLike) -> Floats:
    """Mean normal stress on a disc under a tangential point force: (1/3) ∫ M(k) [2 J1(kρ)/(kρ)] J1(k e) k dk.

    Parameters and result as in `normal_stress`.
    """
    return _transform(transmission, np.ones_like, j1, 0.0, rho, offset)


def _transform(
    transmission: Transform, pressure: Transform, bessel: Transform, a: ArrayLike, rho: ArrayLike, offset: ArrayLike
) -> Floats:
    a_all, rho_all, offset_all = np.broadcast_arrays(*(np.asarray(x, dtype=float) for x in (a, rho, offset)))
    shape = a_all.shape
    columns = np.stack([a_all.ravel(), rho_all.ravel(), offset_all.ravel()])
    k, weight = wave_numbers(float(columns.sum(axis=0).max(initial=0.0)))
    weight = weight * transmission(k) * k / 3
    result = np.empty(columns.shape[1])
    for start in range(0, result.size, _ROWS_AT_ONCE):
        rows = slice(start, start + _ROWS_AT_ONCE)
        s_a, s_rho, s_offset = (np.multiply.outer(x[rows], k) for x in columns)
        result[rows] = (pressure(s_a) * disc_average(s_rho) * bessel(s_offset)) @ weight
    return result.reshape(shape)


def wave_numbers(distance: float) -> tuple[Floats, Floats]:
    """Gauss–Legendre nodes and weights of k on panels of [0, 44], short enough for oscillations over a distance."""
    panels = 24 + int(np.ceil(_END * distance / 12.0))
    x, w = np.polynomial.legendre.leggauss(16)
    edges = np.linspace(0.0, _END, panels + 1)
    half = np.diff(edges)[:, None] / 2
    k = edges[:-1, None] + half * (1 + x)
    return k.ravel(), (half * w).ravel()
