"""Exact linear mechanics of a sphere pressed on a bonded incompressible layer.

Lengths are in units of the layer thickness h unless a name says otherwise.

Stress transmission (Hankel transform of Love's solution, bonded to a rigid base)::

    sigma(a, rho, e) = (1/3) int_0^inf p(ka) M(k) [2 J1(k rho)/(k rho)] J0(k e) k dk
    p(s) = 3 (sin s - s cos s)/s^3                        (Hertz pressure, unit force)
    M(k) = 2 (cosh k + k sinh k)/(1 + 2 k^2 + cosh 2k)    (Poisson ratio 0.5, bonded)

Hertz (1882), Poisson ratio 0.5: a^3 = 9 F R/(16 E).  Charge per force (Seminara 2018, eq. 15):
FRF = d33 (3/2) (rT/h)^2 sigma.  Static stress on the film: T0 = 3 F sigma/(2 pi h^2).

Contact stiffness of the layer: the integral equation of a flat punch on an elastic layer,
(2/E') [(pi/2) phi(x) - int_0^a phi(t) N(x, t) dt] = 1, N(x, t) = [n(x - t) + n(x + t)]/2,
n(z) = int_0^inf (1 - K(s)) cos(s z) ds, K(s) = (sinh 2s - 2s)/(1 + 2 s^2 + cosh 2s), k = 2 pi int phi dt.

Large strain is left out: `finite_strain_shift` says by how much (see `design.py` for the limit that is kept).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline
from scipy.special import j0, j1

Array = npt.NDArray[np.float64]

_X, _W = np.polynomial.legendre.leggauss(200)
_K: Array = np.asarray(16.0 * (_X + 1.0))
_WEIGHT: Array = np.asarray(16.0 * _W)
_TRANSFER: Array = np.asarray(2.0 * (np.cosh(_K) + _K * np.sinh(_K)) / (1.0 + 2.0 * _K**2 + np.cosh(2.0 * _K)))
SMALLEST_SIGMA = 1e-4
"""Below this the sign of sigma may change; logarithms are taken of the larger of the two."""


def transfer() -> tuple[Array, Array]:
    """Wavenumbers (unit 1/h) and M there."""
    return _K, _TRANSFER


def hertz_radius(force_n: Array, radius_mm: Array, modulus_mpa: Array | float) -> Array:
    """Contact radius in mm; N, mm and MPa (= N/mm^2) are consistent units."""
    return np.asarray(np.cbrt(9.0 * force_n * radius_mm / (16.0 * np.asarray(modulus_mpa))))


def hertz_pressure(r: Array, a: float, force: float) -> Array:
    """q(r) = q0 sqrt(1 - r^2/a^2), q0 = 3 F/(2 pi a^2)."""
    return np.asarray(1.5 * force / (np.pi * a * a) * np.sqrt(np.clip(1.0 - (r / a) ** 2, 0.0, None)))


def hertz_transform(s: Array) -> Array:
    """p(s) = 3 (sin s - s cos s)/s^3, with its series near zero."""
    small = s < 0.05
    safe = np.where(small, 1.0, s)
    return np.asarray(
        np.where(small, 1.0 - s**2 / 10.0 + s**4 / 280.0, 3.0 * (np.sin(safe) - safe * np.cos(safe)) / safe**3)
    )


def punch_transform(s: Array) -> Array:
    """p(s) = sin s/s of a flat punch, q(r) = 1/(2 pi a^2 sqrt(1 - r^2/a^2))."""
    return np.asarray(np.sinc(s / np.pi))


def base_stress(pressure: Array, rho: Array | float, e: Array | float, m: Array | None = None) -> Array:
    """sigma of any axisymmetric pressure on any layer.

    Parameters: pressure, its transform p at the wavenumbers of `transfer`, (..., 200); rho and e as in `sigma`; m, the
    layer's M at the same wavenumbers, by default that of the bonded, incompressible one.
    """
    rho_, e_ = (np.asarray(v, dtype=np.float64)[..., None] for v in (rho, e))
    s = _K * rho_
    disc = _WEIGHT * (_TRANSFER if m is None else m) * _K * 2.0 * j1(s) / s
    return np.asarray((pressure * (disc * j0(_K * e_))).sum(axis=-1) / 3.0)


def sigma(a: Array, rho: Array | float, e: Array | float) -> Array:
    """Normal stress at the base, averaged over the sensor's disc, in units of 3F/(2 pi h^2).

    Parameters: a, contact radius; rho, sensor radius; e, distance of the contact from the sensor's centre; each in h.
    The quadrature (200 Gauss points up to k h = 32) was checked for a <= 3 and rho >= 0.1, and e <= 12.
    """
    return base_stress(hertz_transform(_K * np.asarray(a, dtype=np.float64)[..., None]), rho, e)


def log_transmission(a_mm: Array, h_mm: Array | float, sensor_radius_mm: float, offset_mm: Array | float) -> Array:
    """ln[(3/2) (rT/h)^2 sigma(a/h, rT/h, e/h)]: the logarithm of FRF/d33."""
    h = np.asarray(h_mm, dtype=np.float64)
    rho = np.asarray(sensor_radius_mm / h)
    value = np.maximum(sigma(a_mm / h, rho, np.asarray(offset_mm) / h), SMALLEST_SIGMA)
    return np.asarray(np.log(1.5 * rho**2 * value))


@lru_cache(maxsize=1)
def _deficit() -> tuple[Array, Array]:
    s = np.asarray(15.0 * (_X + 1.0))
    return s, np.asarray(15.0 * _W * (1.0 - (np.sinh(2 * s) - 2 * s) / (1.0 + 2.0 * s**2 + np.cosh(2 * s))))


def contact_equation(a: float) -> tuple[Array, Array, Array, Array]:
    """Nodes t (24,) and weights on [0, a], the matrix of the integral equation there, and 2 N(a, t) with the weights.

    matrix @ phi is the right side at the nodes, in units of E'; pi phi(a) is the right side at a plus the last item
    times phi.
    """
    s, deficit = _deficit()
    nodes, node_weight = np.polynomial.legendre.leggauss(24)
    t, w = np.asarray(0.5 * a * (nodes + 1.0)), np.asarray(0.5 * a * node_weight)
    kernel = (np.cos(np.outer(t, s)) * deficit) @ np.cos(np.outer(s, t))
    edge = 2.0 * ((np.cos(a * s) * deficit) @ np.cos(np.outer(s, t))) * w
    return t, w, np.asarray(np.pi * np.eye(t.size) - 2.0 * kernel * w), np.asarray(edge)


@lru_cache(maxsize=1)
def _stiffness_table() -> CubicSpline:
    radii = np.linspace(0.02, 3.0, 61)
    ratio = []
    for a in radii:
        t, w, matrix, _ = contact_equation(float(a))
        ratio.append(np.pi * float(w @ np.linalg.solve(matrix, np.ones(t.size))) / a)
    return CubicSpline(np.concatenate([[0.0], radii]), np.concatenate([[1.0], ratio]))


def stiffness_ratio(a: Array) -> Array:
    """Tangent stiffness over that of the half space, 2 E' a; a in h."""
    return np.asarray(_stiffness_table()(np.clip(a, 0.0, 3.0)))


def finite_strain_shift(force_n: Array, radius_mm: Array, modulus_mpa: float) -> Array:
    """Estimate of what linear theory leaves out, ln[sigma(L)/sigma(0)], L = F/(R^2 E).

    Values of an incompressible neo-Hookean layer at a/h 0.3, rT/h 0.6, smooth in L^(1/3).
    """
    load = np.cbrt(force_n / (radius_mm**2 * modulus_mpa))
    at = np.cbrt([0.0, 1e-3, 1e-2, 3e-2, 1e-1])
    return np.asarray(np.interp(load, at, np.log([1.0, 1.01293, 1.02966, 1.04522, 1.07489])))
