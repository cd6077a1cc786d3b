"""The exact linear solution: an incompressible layer of unit thickness, bonded to a rigid base, laterally unbounded.

`underskin.physics.elastic_layer` holds the layer of any Poisson ratio; this is its limit in closed form, from which the
tables are made. Source: Sneddon, Fourier Transforms (1951), ch. 10: Love's function with a Hankel transform.
"""

import numpy as np
from numpy.typing import ArrayLike

from underskin.physics.hankel_transform import hertz_transform, normal_stress
from underskin.units import Floats


def transmission(k: Floats) -> Floats:
    """Normal transmission M(k) = 2 (cosh k + k sinh k)/(1 + 2k² + cosh 2k), in a form that does not overflow."""
    decay = np.exp(-k)
    cosh = (1 + decay**2) / 2
    sinh = (1 - decay**2) / 2
    return 2 * decay * (cosh + k * sinh) / (decay**2 * (1 + 2 * k**2) + (1 + decay**4) / 2)


def sigma(a: ArrayLike, rho: ArrayLike, offset: ArrayLike = 0.0) -> Floats:
    """Transmission factor σ(a/h, ρ) under the Hertz pressure.

    Parameters
    ----------
    a : array_like
        Contact radius a/h [-].
    rho : array_like
        ρ = rT/h [-]; 0 is a point sensor.
    offset : array_like
        Distance r̂/h of the load from the centre of the sensor [-].

    Returns
    -------
    ndarray
        [-], of the broadcast shape.
    """
    return normal_stress(transmission, hertz_transform, a, rho, offset)


def gamma_n(offset: ArrayLike, rho: ArrayLike) -> Floats:
    """Stress factor γ_n(r̂/h, ρ) of a normal point force; parameters and result as in `sigma`."""
    return normal_stress(transmission, np.ones_like, 0.0, rho, offset)
