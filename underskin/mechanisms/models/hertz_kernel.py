"""Compiled: what the σ table is entered with under spheres without adhesion on an incompressible layer.

Contacts by Hertz' law: a³ = 9 F R/(16 E), L = F/(R² E). Arrays are (points, rows), where either may be 1 and
then stands for all; derivatives have the variables along their first axis.
"""

import numpy as np

from underskin.compiled import compiled
from underskin.units import Floats

_COLUMNS = "float64[:, ::1]"
_SLOPES = "float64[:, :, ::1]"
_VARIABLE = f"{_COLUMNS}, {_SLOPES}"


@compiled(f"void(float64[::1], float64[::1], {', '.join([_VARIABLE] * 4)})")
def spheres(
    force: Floats,
    radius: Floats,
    modulus: Floats,
    modulus_slopes: Floats,
    thickness: Floats,
    thickness_slopes: Floats,
    a: Floats,
    a_slopes: Floats,
    x: Floats,
    x_slopes: Floats,
) -> None:
    """a/h and L^(1/3) of contacts, with their derivatives.

    Parameters
    ----------
    force, radius
        Of each contact (contacts,) [N, m].
    modulus, thickness
        [Pa, m], with the derivatives of each.
    a, x
        (points, contacts), and their derivatives (variables, points, contacts), to be filled.
    """
    points, contacts = a.shape
    for point in range(points):
        of_h = min(point, len(thickness) - 1)
        h, of_modulus = thickness[of_h, 0], min(point, len(modulus) - 1)
        for contact in range(contacts):
            column = min(contact, modulus.shape[1] - 1)
            e = modulus[of_modulus, column]
            ratio = np.cbrt(0.5625 * force[contact] * radius[contact] / e) / h
            load = np.cbrt(force[contact] / radius[contact] ** 2 / e)
            a[point, contact], x[point, contact] = ratio, load
            for number in range(len(a_slopes)):
                third = modulus_slopes[number, of_modulus, column] / (3 * e)
                a_slopes[number, point, contact] = -ratio * (third + thickness_slopes[number, of_h, 0] / h)
                x_slopes[number, point, contact] = -load * third
