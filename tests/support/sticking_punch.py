"""An independent linear solution: punch and sphere that stick to an incompressible layer, G = h = 1, on a rigid base.

Under a flat punch u_z = 1 (down) and u_r = 0. Its pressure and outward shear have the Hankel transforms p̂ = ∫₀^a φ(t)
cos kt dt and t̂ = ∫₀^a ψ(t) sin kt dt. Abel's inversion of u_z = ∫ (A p̂ + B t̂) J0 k dk and u_r = ∫ (C p̂ + D t̂) J1 k dk
gives

    ∫₀^∞ k (A p̂ + B t̂) cos kx dk = 1,   ∫₀^∞ k (C p̂ + D t̂) sin kx dk = 0,   x < a,

Fredholm equations of the second kind, as kA and kD tend to 1/2, kB and kC to 0 (Sneddon, Mixed Boundary Value Problems,
1966, chapter 4). A sphere that sticks as it is pressed is a sum of such punches (Mossakovskii, J. Appl. Math. Mech. 27
(1963) 418): ∫₀^a δ'(a') [1 − w(a; a')] da' = a²/(2R), w the depth of the surface beside a punch.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import j0

from underskin.physics.hankel_transform import disc_average
from underskin.units import Floats

_X, _W = np.polynomial.legendre.leggauss(600)
_K, _K_WEIGHT = 15.0 * (1 + _X), 15.0 * _W  # the layer's part of k A … D falls like e^(−2k), the base's like e^(−k)
_TERMS, _ANGLES = 8, 12


@dataclass(frozen=True)
class StickingPunch:
    """Stiffness F/δ over G h, and σ on the discs."""

    a: float
    stiffness: float
    sigma: Floats
    _points: Floats
    _density: Floats
    _transform: Floats  # of the layer's part of the depth

    def depth_beside(self, r: float) -> float:
        """The depth of the surface at r > a, that of the punch 1."""
        from_half_space = float(np.sum(self._density / np.sqrt(r**2 - self._points**2))) / 2
        return from_half_space + float(self._transform @ j0(_K * r))


def sticking_punch(a: float, rho: Floats) -> StickingPunch:
    """The punch of radius a, and discs of radii rho > 0."""
    kernel, borne = _layer()
    x, weight = np.polynomial.legendre.leggauss(60)
    angle = np.pi / 4 * (1 + x)
    x, weight = a * np.sin(angle), a * np.pi / 4 * weight * np.cos(angle)  # dense at a, where the depth beside needs it
    waves = np.array([np.cos(np.outer(x, _K)), np.sin(np.outer(x, _K))])
    coupled = np.einsum("ixk,ijk,jyk->ixjy", waves, kernel * _K_WEIGHT, waves, optimize=True) * weight
    equations = np.pi / 4 * np.eye(2 * x.size) + coupled.reshape(2 * x.size, -1)
    densities = np.linalg.solve(equations, np.repeat([1.0, 0.0], x.size)).reshape(2, -1) * weight
    transforms = np.einsum("ixk,ix->ik", waves, densities)
    force = 2 * np.pi * float(densities[0].sum())
    stress = (borne * transforms).sum(axis=0) * _K * _K_WEIGHT @ disc_average(np.multiply.outer(_K, rho))
    depth = (kernel[0] * transforms).sum(axis=0) * _K_WEIGHT
    return StickingPunch(a, force, stress * 2 * np.pi / (3 * force), x, densities[0], depth)


@dataclass(frozen=True)
class StickingSphere:
    """Spheres with contacts of the radii a: F R over G h³, δ R over h², and σ on the discs (a, rho)."""

    a: Floats
    load: Floats
    depth: Floats
    sigma: Floats


def sticking_spheres(largest: float, rho: Floats, count: int = 24) -> StickingSphere:
    """Contacts up to a radius; δ' = a times a polynomial in a."""
    edges = largest * (np.arange(_TERMS) + 1) / _TERMS
    x, w = np.polynomial.legendre.leggauss(_ANGLES)
    angle, weight = np.pi / 4 * (1 + x), np.pi / 4 * w

    def powers(a: Floats | float) -> Floats:
        return np.asarray(a)[..., None] ** (1 + np.arange(_TERMS)) / largest ** np.arange(_TERMS)

    rows = []
    for edge in edges:
        inner = edge * np.cos(angle)
        lag = np.array([1 - sticking_punch(a, rho).depth_beside(edge) for a in inner])
        rows.append((lag * weight * edge * np.sin(angle)) @ powers(inner))
    coefficients = np.linalg.solve(np.array(rows), edges**2 / 2)
    nodes = largest * (1 + np.polynomial.legendre.leggauss(count)[0]) / 2
    punches = [sticking_punch(a, rho) for a in nodes]
    gained = np.array([punch.stiffness for punch in punches]) * (powers(nodes) @ coefficients)
    borne = gained[:, None] * np.array([punch.sigma for punch in punches])
    fit = np.polynomial.Polynomial.fit
    load = fit(nodes, gained, count // 2).integ(lbnd=0.0)(nodes)
    borne = np.stack([fit(nodes, values, count // 2).integ(lbnd=0.0)(nodes) for values in borne.T], axis=1)
    depth = powers(nodes) * nodes[:, None] / (2 + np.arange(_TERMS)) @ coefficients
    return StickingSphere(nodes, load, depth, borne / load[:, None])


def _layer() -> tuple[Floats, Floats]:
    """k (A, B; C, D) less 1/2 on the diagonal, and the compression of the base by pressure and shear.

    u_z = W J0 (up), u_r = U J1, W = α (z cosh kz − sinh(kz)/k) + β z sinh kz, U = −W'/k; the mean pressure is
    W'''/k² − W'. All of the surface is over e^k.
    """
    k, decay = _K, np.exp(-_K)
    cosh, sinh = (1 + decay**2) / 2, (1 - decay**2) / 2
    w = np.array([cosh - sinh / k, sinh])
    first = np.array([k * sinh, sinh + k * cosh])
    second = np.array([k * sinh + k**2 * cosh, 2 * k * cosh + k**2 * sinh])
    third = np.array([2 * k**2 * cosh + k**3 * sinh, 3 * k**2 * sinh + k**3 * cosh])
    tractions = np.array([third / k**2 - 3 * first, -second / k - k * w])  # p̂ = −σ_zz, t̂ = σ_rz of α and β
    displacements = np.array([-w, -first / k])
    of_loads = np.linalg.inv(np.moveaxis(tractions, 2, 0))
    compliance = np.moveaxis(np.moveaxis(displacements, 2, 0) @ of_loads, 0, 2)
    return k * compliance - np.eye(2)[..., None] / 2, 2 * decay * of_loads[:, 0].T
