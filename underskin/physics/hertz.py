"""Hertz: a rigid sphere on an elastic half space (Seminara 2018, equations 7–10 and 16).

All functions take SI scalars or arrays and broadcast.
"""

import numpy as np
from numpy.typing import ArrayLike

from underskin.units import Floats


def contact_radius(
    preload: ArrayLike, indenter_radius: ArrayLike, youngs_modulus: ArrayLike, poisson_ratio: ArrayLike = 0.5
) -> Floats:
    """a [m], from a³ = 3 F R (1 − ν²) / (4 E)."""
    force, radius = np.asarray(preload, dtype=float), np.asarray(indenter_radius, dtype=float)
    compliance = (1 - np.square(poisson_ratio)) / np.asarray(youngs_modulus, dtype=float)
    return np.cbrt(0.75 * force * radius * compliance)


def peak_pressure(preload: ArrayLike, contact_radius: ArrayLike) -> Floats:
    """q0 = 3 F / (2 π a²) [Pa], the pressure at the centre."""
    return 1.5 * np.asarray(preload, dtype=float) / (np.pi * np.square(contact_radius))


def pressure(r: ArrayLike, preload: ArrayLike, contact_radius: ArrayLike) -> Floats:
    """q(r) = q0 √(1 − r²/a²) [Pa] inside the contact, 0 outside."""
    inside = np.clip(1 - np.square(np.asarray(r, dtype=float) / contact_radius), 0, None)
    return peak_pressure(preload, contact_radius) * np.sqrt(inside)


def load_parameter(preload: ArrayLike, indenter_radius: ArrayLike, youngs_modulus: ArrayLike) -> Floats:
    """L = F / (R² E) [-], equation 16."""
    return np.asarray(preload, dtype=float) / (np.square(indenter_radius) * np.asarray(youngs_modulus, dtype=float))


def contact_radius_over_indenter_radius(load_parameter: ArrayLike, poisson_ratio: ArrayLike = 0.5) -> Floats:
    """a/R, from (a/R)³ = (3/4)(1 − ν²) L."""
    return np.cbrt(0.75 * (1 - np.square(poisson_ratio)) * np.asarray(load_parameter, dtype=float))


def peak_pressure_over_modulus(load_parameter: ArrayLike, poisson_ratio: ArrayLike = 0.5) -> Floats:
    """q0/E = (3/2π) [(3/4)(1 − ν²)]^(−2/3) L^(1/3): the strain that L stands for."""
    shape = np.cbrt(0.75 * (1 - np.square(poisson_ratio))) ** -2
    return 1.5 / np.pi * shape * np.cbrt(np.asarray(load_parameter, dtype=float))
