"""A rigid frictionless sphere on the layer: pressure in a polynomial basis, fitted to the sphere by collocation.

The pressure is given by φ on 0 ≤ t ≤ 1 (t in units of the contact radius a, φ in units of E'/2 times a length):
    p̂(k) = ∫ p J0(kr) r dr = a ∫₀¹ φ(t) cos(k a t) dt,    F = 2π a ∫₀¹ φ dt.
Its deflection inside the contact, with α = a/h and s = r/a, must be δ − a² s²/(2R):
    ∫₀^s φ(t)/√(s² − t²) dt − α ∫₀^∞ (1 − K(k)) [∫₀¹ φ(t) cos(k α t) dt] J0(k α s) dk = δ − a² s²/(2R).
Two solutions, for 1 and for s², give every sphere: without adhesion φ(1) = 0, with work of adhesion w
φ(1) = −√(2 a w E'/π) (Johnson, Kendall and Roberts 1971). Source of the basis: Sneddon 1965.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.special import j0

from rig.errors import RigError
from rig.layer import Floats, Layer

_DEGREE = 7  # of φ in t²
_POINTS = 24
_QUADRATURE = 48
WIDEST = 4.0  # a/h
_RADII = np.concatenate([[0.0], np.geomspace(0.02, WIDEST, 40)])


@lru_cache
def _nodes(count: int, end: float) -> tuple[Floats, Floats]:
    x, w = np.polynomial.legendre.leggauss(count)
    return end * (x + 1) / 2, end * w / 2


_T, _T_WEIGHT = _nodes(_QUADRATURE, 1.0)
_BASIS: Floats = np.array([np.polynomial.legendre.Legendre.basis(2 * j)(_T) for j in range(_DEGREE + 1)])  # (j, t)


@dataclass(frozen=True)
class SphereContact:
    """Contact curves over a/h for one Poisson ratio and glue line; made by `sphere_contact`.

    Lengths are in units of h, moduli of E, forces of E h², work of adhesion of E h; all arguments may be arrays over
    contacts. For right sides 1 and s², `_solutions` gives φ at the quadrature nodes, (2, nodes), and `_summary` ∫ φ dt
    and φ(1), (2, 2).
    """

    poisson_ratio: float
    _solutions: CubicSpline
    _summary: CubicSpline

    def force(
        self, a: Floats, radius: float | Floats, modulus: float | Floats, adhesion: float | Floats = 0.0
    ) -> Floats:
        """Force F of a contact.

        Parameters
        ----------
        a : ndarray
            Contact radius.
        radius : float or ndarray
            Radius of the sphere.
        modulus : float or ndarray
            Young's modulus.
        adhesion : float or ndarray
            Work of adhesion w.
        """
        plane = modulus / (1 - self.poisson_ratio**2)
        punch, bowl = np.moveaxis(self._summary(a)[..., 0], -1, 0)
        depth = self.depth(a, radius, modulus, adhesion)
        return np.pi * plane * a * (depth * punch - a**2 / (2 * radius) * bowl)

    def depth(
        self, a: Floats, radius: float | Floats, modulus: float | Floats, adhesion: float | Floats = 0.0
    ) -> Floats:
        """Indentation δ of a contact; parameters as in `force`."""
        plane = modulus / (1 - self.poisson_ratio**2)
        edge = self._summary(a)[..., 1]
        pull = 2 / plane * np.sqrt(2 * a * adhesion * plane / np.pi)
        return (a**2 / (2 * radius) * edge[..., 1] - pull) / edge[..., 0]

    def stiffness(self, a: Floats, modulus: float | Floats) -> Floats:
        """Contact stiffness dF/dδ with the edge held, in E h; parameters as in `force`."""
        return np.pi * modulus / (1 - self.poisson_ratio**2) * a * self._summary(a)[..., 0, 0]

    def shape(self, a: Floats, radius: Floats, modulus: Floats, adhesion: float | Floats, k: Floats) -> Floats:
        """Transform of the pressure over its force.

        Parameters
        ----------
        a, radius, modulus, adhesion
            As in `force`, (rows,).
        k : ndarray, (k,)
            Wavenumbers in units of 1/h.

        Returns
        -------
        ndarray, (rows, k)
        """
        phi = self._solutions(a)
        depth = self.depth(a, radius, modulus, adhesion)
        profile = depth[:, None] * phi[:, 0] - (a**2 / (2 * radius))[:, None] * phi[:, 1]
        weighted = profile * _T_WEIGHT
        waves = np.cos(a[:, None, None] * k[:, None] * _T)
        return np.einsum("rt,rkt->rk", weighted, waves) / weighted.sum(axis=1, keepdims=True)

    def radius_of(self, force: Floats, radius: Floats, modulus: Floats, adhesion: float | Floats = 0.0) -> Floats:
        """Contact radius under a force, on the branch that is stable under force control; by bisection in log a.

        Parameters
        ----------
        force : ndarray
            F.
        radius, modulus, adhesion
            As in `force`.

        Returns
        -------
        ndarray
            NaN below pull-off.

        Raises
        ------
        RigError
            Where the contact is wider than `WIDEST`.
        """
        widest = np.full(np.shape(force), WIDEST)
        if np.any(self.force(widest, radius, modulus, adhesion) < force):
            raise RigError("contact radius", f"more than {WIDEST} h", "choose a lower preload, or a stiffer layer")
        low = np.log(self._least(radius, modulus, adhesion))
        high = np.full(np.shape(force), np.log(WIDEST))
        sticks = self.force(np.exp(low), radius, modulus, adhesion) <= force
        for _ in range(48):
            middle = (low + high) / 2
            under = self.force(np.exp(middle), radius, modulus, adhesion) < force
            low, high = np.where(under, middle, low), np.where(under, high, middle)
        return np.where(sticks, np.exp((low + high) / 2), np.nan)

    def _least(self, radius: Floats, modulus: Floats, adhesion: float | Floats) -> Floats:
        """The radius at pull-off under force control, where F is least: the rising branch begins there."""
        rows = np.broadcast_arrays(radius, modulus, adhesion)
        if not np.any(adhesion):
            return np.full(rows[0].shape, 1e-6)
        grid = np.geomspace(1e-4, WIDEST, 400)
        force = self.force(grid, *(row[..., None] for row in rows))
        return np.asarray(grid[np.argmin(force, axis=-1)])


@lru_cache(maxsize=64)
def sphere_contact(layer: Layer) -> SphereContact:
    """Contact curves of a layer, from collocation at contact radii up to `WIDEST`."""
    k, weight = _nodes(160, 40.0)
    missing = weight * (1 - layer.compliance(k))
    solutions = np.array([_solution(alpha, k, missing) for alpha in _RADII])
    summary = np.stack([solutions[..., :-1] @ _T_WEIGHT, solutions[..., -1]], axis=-1)
    return SphereContact(layer.poisson_ratio, CubicSpline(_RADII, solutions[..., :-1]), CubicSpline(_RADII, summary))


def _solution(alpha: float, k: Floats, missing: Floats) -> NDArray[np.float64]:
    """φ at the quadrature nodes and at 1, for right sides 1 and s²: (2, nodes + 1)."""
    s = np.sin(np.pi * (np.arange(_POINTS) + 0.5) / (2 * _POINTS))
    angle, angle_weight = _nodes(_QUADRATURE, np.pi / 2)
    inside = np.multiply.outer(s, np.sin(angle))
    legendre = [np.polynomial.legendre.Legendre.basis(2 * j) for j in range(_DEGREE + 1)]
    half_space = np.array([basis(inside) @ angle_weight for basis in legendre])
    transforms = (_BASIS * _T_WEIGHT) @ np.cos(alpha * np.multiply.outer(_T, k))  # (j, k)
    layered = alpha * (transforms * missing) @ j0(alpha * np.multiply.outer(k, s))
    right = np.column_stack([np.ones_like(s), s**2])
    coefficients = np.linalg.lstsq((half_space - layered).T, right, rcond=None)[0]  # (j, 2)
    at_edge = np.ones(_DEGREE + 1)  # every Legendre polynomial is 1 at 1
    return np.column_stack([coefficients.T @ _BASIS, coefficients.T @ at_edge])
