"""The skin as a half space (Boussinesq): stress at depth h under forces on the surface.

Lengths in units of the depth h. Source: Seminara 2018, equations 4–6, 12 and 14; Johnson, Contact Mechanics (1985),
sections 3.2 and 3.6.
"""

import numpy as np
from numpy.typing import ArrayLike

from underskin.physics.charge_response import Sigma
from underskin.physics.hankel_transform import hertz_transform, normal_stress, tangential_stress
from underskin.units import Floats

# The integral is evaluated for each row, at a cost that grows with a/h and rT/h.
DOMAIN_END = 10.0
# Of the quadrature against one on twice as many panels, over that domain (tests/service/routes/test_service_sigma.py).
REL_ERROR = 1e-10


def gamma_n(offset: ArrayLike, rho: ArrayLike) -> Floats:
    """Stress factor γ_n of a normal point force, T3 = −(3/2πh²) F3 γ_n, averaged over the sensor's disc (equation 6).

    Parameters and result as in `elastic_layer.gamma_n`; (1 + λ²)^(−5/2) of λ = r̂/h at ρ = 0.
    """
    return normal_stress(_normal, np.ones_like, 0.0, rho, offset)


def gamma_t(offset: ArrayLike, rho: ArrayLike) -> Floats:
    """Stress factor γ_t of a tangential force: T3 = (3/2πh²)(F1 cos β + F2 sin β) γ_t; λ (1 + λ²)^(−5/2) at ρ = 0.

    Parameters and result as in `gamma_n`.
    """
    return tangential_stress(_tangential, rho, offset)


def delta(a: ArrayLike) -> Floats:
    """Factor δ = 1/(1 + (a/h)²) of the Hertz pressure on a point sensor (equation 12 in closed form).

    Parameters
    ----------
    a : array_like
        a/h [-].
    """
    return 1 / (1 + np.square(np.asarray(a, dtype=float)))


def sigma(a: ArrayLike, rho: ArrayLike, offset: ArrayLike = 0.0) -> Floats:
    """Transmission factor σ(a/h, ρ) of the half space: Hertz pressure on an extended sensor (equation 14).

    Parameters and result as in `elastic_layer.sigma`.
    """
    return normal_stress(_normal, hertz_transform, a, rho, offset)


def sigma_in_domain(a: ArrayLike, rho: ArrayLike) -> Sigma:
    """σ with its error; NaN where a/h or ρ exceeds `DOMAIN_END`. Parameters as in `sigma`."""
    a_all, rho_all = np.broadcast_arrays(np.asarray(a, dtype=float), np.asarray(rho, dtype=float))
    inside = (a_all <= DOMAIN_END) & (rho_all <= DOMAIN_END)
    value = np.full(a_all.shape, np.nan)
    value[inside] = sigma(a_all[inside], rho_all[inside])
    return Sigma(value, np.where(inside, REL_ERROR, np.nan), inside)


def _normal(k: Floats) -> Floats:
    return (1 + k) * np.exp(-k)


def _tangential(k: Floats) -> Floats:
    return k * np.exp(-k)
