"""Hertz: a rigid sphere on an elastic half space (Seminara 2018, equations 7–10 and 16).

All functions take SI scalars or arrays and broadcast. The forward model has the same radius with derivatives by its
parameters: `Contacts.hertz_radius` in `underskin/mechanisms/models/contact_state.py`.
"""

import numpy as np
from numpy.typing import ArrayLike

from underskin.units import Floats


def contact_radius(
    preload: ArrayLike, indenter_radius: ArrayLike, youngs_modulus: ArrayLike, poisson_ratio: ArrayLike = 0.5
) -> Floats:
    """Contact radius a, from a³ = 3 F R (1 − ν²)/(4 E) (equation 7).

    Parameters
    ----------
    preload : array_like
        F [N].
    indenter_radius : array_like
        R [m].
    youngs_modulus : array_like
        E [Pa].
    poisson_ratio : array_like
        ν [-].

    Returns
    -------
    ndarray
        a [m], of the broadcast shape.
    """
    force, radius = np.asarray(preload, dtype=float), np.asarray(indenter_radius, dtype=float)
    compliance = (1 - np.square(poisson_ratio)) / np.asarray(youngs_modulus, dtype=float)
    return np.cbrt(0.75 * force * radius * compliance)


def peak_pressure(preload: ArrayLike, contact_radius: ArrayLike) -> Floats:
    """Pressure at the centre of the contact, q0 = 3 F/(2 π a²).

    Parameters
    ----------
    preload : array_like
        F [N].
    contact_radius : array_like
        a [m].

    Returns
    -------
    ndarray
        q0 [Pa], of the broadcast shape.
    """
    return 1.5 * np.asarray(preload, dtype=float) / (np.pi * np.square(contact_radius))


def pressure(r: ArrayLike, preload: ArrayLike, contact_radius: ArrayLike) -> Floats:
    """Hertz pressure q(r) = q0 √(1 − r²/a²), 0 outside the contact.

    Parameters
    ----------
    r : array_like
        Distance from the axis [m].
    preload, contact_radius : array_like
        F [N] and a [m].

    Returns
    -------
    ndarray
        q [Pa], of the broadcast shape.
    """
    inside = np.clip(1 - np.square(np.asarray(r, dtype=float) / contact_radius), 0, None)
    return peak_pressure(preload, contact_radius) * np.sqrt(inside)


def load_parameter(preload: ArrayLike, indenter_radius: ArrayLike, youngs_modulus: ArrayLike) -> Floats:
    """Load parameter L = F/(R² E) (equation 16).

    Parameters
    ----------
    preload : array_like
        F [N].
    indenter_radius : array_like
        R [m].
    youngs_modulus : array_like
        E [Pa].

    Returns
    -------
    ndarray
        L [-], of the broadcast shape.
    """
    return np.asarray(preload, dtype=float) / (np.square(indenter_radius) * np.asarray(youngs_modulus, dtype=float))


def contact_radius_over_indenter_radius(load_parameter: ArrayLike, poisson_ratio: ArrayLike = 0.5) -> Floats:
    """Contact radius over indenter radius, (a/R)³ = (3/4)(1 − ν²) L.

    Parameters
    ----------
    load_parameter : array_like
        L [-].
    poisson_ratio : array_like
        ν [-].

    Returns
    -------
    ndarray
        a/R [-], of the broadcast shape.
    """
    return np.cbrt(0.75 * (1 - np.square(poisson_ratio)) * np.asarray(load_parameter, dtype=float))


def peak_pressure_over_modulus(load_parameter: ArrayLike, poisson_ratio: ArrayLike = 0.5) -> Floats:
    """Peak pressure over modulus, q0/E = (3/2π) [(3/4)(1 − ν²)]^(−2/3) L^(1/3): the strain measured by L.

    Parameters and result as in `contact_radius_over_indenter_radius`.
    """
    shape = np.cbrt(0.75 * (1 - np.square(poisson_ratio))) ** -2
    return 1.5 / np.pi * shape * np.cbrt(np.asarray(load_parameter, dtype=float))
