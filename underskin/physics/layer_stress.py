"""The normal stress σ_zz inside a bonded layer under the Hertz pressure, exact for small strain.

Lengths are in units of the thickness h, d is the depth below the surface, 0 to 1, and stresses are those of
`hankel_transform`: σ_zz = −(3/2π)(F/h²) s. The half space has a closed form (Huber 1904; Johnson, Contact Mechanics
(1985), section 3.4): with u the positive root of u² − (r² + d² − a²) u − a² d² = 0,

    s = (d/√u)³ u/(u² + a² d²),     at the surface √(1 − r²/a²)/a²

The base adds (1/3) ∫₀^∞ p̂(ka) [M(k, d) − (1 + kd) e^(−kd)] J0(kr) k dk, whose integrand falls like e^(−k) at every
depth. M is the normal stress at the depth d over that at the surface. Airy's function of a layer whose base is held is
A (cosh ζ − qζ sinh ζ) + B (qζ cosh ζ + p sinh ζ) with ζ = k (1 − d), p as in `elastic_layer`, and q = 1 − p; without
shear at the surface it gives, with C = cosh k and H = sinh k,

    D M = (C + qkH)(cosh ζ − qζ sinh ζ) + (qkC − pH)(qζ cosh ζ + p sinh ζ),     D = C² + q²k² − p²H²
"""

import numpy as np
from scipy.special import j0

from underskin.physics.hankel_transform import hertz_transform, wave_numbers
from underskin.units import Floats


def layer_stress(poisson_ratio: float, a: Floats, r: Floats, depth: Floats) -> Floats:
    """Normal stress s inside a layer that is bonded to a rigid base, under a sphere's Hertz pressure.

    Parameters
    ----------
    poisson_ratio : float
        ν, 0 to 0.5, 0.5 included [-].
    a : ndarray, (contacts,)
        Contact radius a/h, above 0 [-].
    r : ndarray, (radii,)
        Distance from the contact's axis over thickness [-].
    depth : ndarray, (depths,)
        Depth d below the surface over thickness, 0 (surface) to 1 (base) [-].

    Returns
    -------
    ndarray, (contacts, depths, radii)
        In units of 3F/(2πh²), compression positive [-].
    """
    k, weight = wave_numbers(float(a.max() + r.max()))
    free = (1 + np.outer(depth, k)) * np.exp(-np.outer(depth, k))
    added = np.where(depth[:, None] > 0, depth_transmission(poisson_ratio, k, depth) - free, 0.0)
    reflected = added * (weight * k / 3)
    pressed = hertz_transform(np.outer(a, k))[:, None, :] * reflected
    return half_space_stress(a, r, depth) + pressed @ j0(np.outer(k, r))


def half_space_stress(a: Floats, r: Floats, depth: Floats) -> Floats:
    """The normal stress in the half space; parameters and result as in `layer_stress`, for any depth."""
    a, d = a[:, None, None], depth[:, None]
    excess, product = r**2 + d**2 - a**2, a**2 * d**2
    root = np.hypot(excess, 2 * a * d)
    other = np.where(root > excess, root - excess, 1.0)  # avoids u as a small difference inside the contact
    u = np.where(excess > 0, (excess + root) / 2, 2 * product / other)
    surface = np.sqrt(np.clip(1 - r**2 / a**2, 0, None)) / a**2
    safe = np.where(d > 0, u, 1.0)
    return np.where(d > 0, d**3 / np.sqrt(safe) / (safe**2 + product), surface)


def depth_transmission(poisson_ratio: float, k: Floats, depth: Floats) -> Floats:
    """Normal stress at a depth over that at the surface, M(k, d): 1 at k = 0.

    Parameters
    ----------
    poisson_ratio : float
        ν, 0 to 0.5 [-].
    k : ndarray, (k,)
        Wave number in units of 1/h.
    depth : ndarray, (depths,)
        d, 0 to 1 [-].

    Returns
    -------
    ndarray, (depths, k)
        [-].
    """
    p = (1 - 2 * poisson_ratio) / (2 - 2 * poisson_ratio)
    q = 1 - p
    zeta = np.outer(1 - depth, k)
    cosh_k, sinh_k = _scaled(k)
    cosh, sinh = _scaled(zeta)
    by_cosh = (cosh_k + q * k * sinh_k) * (cosh - q * zeta * sinh)
    by_sinh = (q * k * cosh_k - p * sinh_k) * (q * zeta * cosh + p * sinh)
    denominator = cosh_k**2 + (q * k * np.exp(-k)) ** 2 - (p * sinh_k) ** 2
    return (by_cosh + by_sinh) / denominator * np.exp(-np.outer(depth, k))


def _scaled(x: Floats) -> tuple[Floats, Floats]:
    """e^(−x) cosh x and e^(−x) sinh x."""
    return (1 + np.exp(-2 * x)) / 2, -np.expm1(-2 * x) / 2
