"""The exact linear skin: an incompressible layer of unit thickness bonded to a rigid base, laterally unbounded.

Source: Love's function with a Hankel transform (PHYSICS, section 3). In this limit σ depends on a/h and ρ alone.
"""

import numpy as np
from numpy.typing import ArrayLike

from underskin.physics.hankel_transform import hertz_transform, normal_stress
from underskin.units import Floats


def transmission(k: Floats) -> Floats:
    """M(k) = 2 (cosh k + k sinh k) / (1 + 2k² + cosh 2k), written so that nothing overflows."""
    decay = np.exp(-k)
    cosh = (1 + decay**2) / 2
    sinh = (1 - decay**2) / 2
    return 2 * decay * (cosh + k * sinh) / (decay**2 * (1 + 2 * k**2) + (1 + decay**4) / 2)


def sigma(a: ArrayLike, rho: ArrayLike, offset: ArrayLike = 0.0) -> Floats:
    """σ(a/h, ρ) under the Hertz pressure, `offset` r̂/h beside the sensor; ρ = 0 is the point sensor."""
    return normal_stress(transmission, hertz_transform, a, rho, offset)


def gamma_n(offset: ArrayLike, rho: ArrayLike) -> Floats:
    """γ_n(r̂/h, ρ): the same for a normal point force."""
    return normal_stress(transmission, np.ones_like, 0.0, rho, offset)
