"""An independent linear solution: a flat punch that sticks to an incompressible layer, G = h = 1, on a rigid base.

Under it u_z = 1 (down) and u_r = 0. Its pressure and outward shear have the Hankel transforms p̂ = ∫₀^a φ(t) cos kt dt
and t̂ = ∫₀^a ψ(t) sin kt dt. Abel's inversion of u_z = ∫ (A p̂ + B t̂) J0 k dk and u_r = ∫ (C p̂ + D t̂) J1 k dk gives

    ∫₀^∞ k (A p̂ + B t̂) cos kx dk = 1,   ∫₀^∞ k (C p̂ + D t̂) sin kx dk = 0,   x < a,

Fredholm equations of the second kind, as kA and kD tend to 1/2, kB and kC to 0 (Sneddon, Mixed Boundary Value Problems,
1966, chapter 4).
"""

import numpy as np

from underskin.physics.hankel_transform import disc_average
from underskin.units import Floats

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(600)
K, K_WEIGHT = (
    15.0 * (1 + _NODES),
    15.0 * _WEIGHTS,
)  # the layer's part of k A … D falls like e^(−2k), the base's like e^(−k)


def sticking_punch(a: float, rho: Floats) -> tuple[float, Floats]:
    """Stiffness F/δ over G h, and σ on discs of these radii, which are > 0."""
    kernel, borne = _layer()
    x, weight = np.polynomial.legendre.leggauss(60)
    x, weight = a / 2 * (1 + x), a / 2 * weight
    waves = np.array([np.cos(np.outer(x, K)), np.sin(np.outer(x, K))])
    coupled = np.einsum("ixk,ijk,jyk->ixjy", waves, kernel * K_WEIGHT, waves) * weight
    size = x.size
    equations = np.pi / 4 * np.eye(2 * size) + coupled.reshape(2 * size, 2 * size)
    densities = np.linalg.solve(equations, np.repeat([1.0, 0.0], size)).reshape(2, size)
    transforms = np.einsum("ixk,ix->ik", waves, densities * weight)
    force = 2 * np.pi * float(densities[0] @ weight)
    stress = (borne * transforms).sum(axis=0) * K * K_WEIGHT @ disc_average(np.multiply.outer(K, rho))
    return force, stress * 2 * np.pi / (3 * force)


def _layer() -> tuple[Floats, Floats]:
    """k (A, B; C, D) less 1/2 on the diagonal, and the compression of the base by pressure and shear.

    u_z = W J0 (up), u_r = U J1, W = α (z cosh kz − sinh(kz)/k) + β z sinh kz, U = −W'/k; the mean pressure is
    W'''/k² − W'. All of the surface is over e^k.
    """
    k, decay = K, np.exp(-K)
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
