"""Compiled: contact radii of spheres on a layer under given loads, from the layer's Chebyshev series."""

import numpy as np

from underskin.compiled import compiled
from underskin.units import Floats

_ITERATIONS = 60


@compiled()
def _series(coefficients: Floats, x: float) -> float:
    """Σ cₙ Tₙ(x), by Clenshaw's recurrence."""
    above, here = 0.0, 0.0
    for order in range(len(coefficients) - 1, 0, -1):
        above, here = here, coefficients[order] + 2 * x * here - above
    return coefficients[0] + x * here - above


@compiled("void(float64[:, ::1], float64, float64[::1], float64[::1], float64, float64, float64[::1])")
def radii_under_load(
    curves: Floats, end: float, load: Floats, root_adhesion: Floats, smallest: float, tolerance: float, alpha: Floats
) -> None:
    """α of P = (4/3) α³ A(α) − U √(8π α³) G(α) on the branch that is stable under force control, by Newton's steps.

    The law is convex: from the stable side the steps end at its root, or cross its minimum, where there is none.

    Parameters
    ----------
    curves
        Chebyshev coefficients over (0, `end`) of A, G, A′ and G′ (4, count).
    load, root_adhesion
        P and U (rows,).
    smallest, tolerance
        Least α, and the relative size of the last step.
    alpha
        First guesses (rows,); the solutions, NaN where there is none.
    """
    punch = np.sqrt(8 * np.pi)
    for row in range(len(alpha)):
        a = min(max(alpha[row], smallest), end)
        for _ in range(_ITERATIONS):
            x, root = 2 * a / end - 1, np.sqrt(a)
            sphere, edge = _series(curves[0], x), _series(curves[1], x)
            adhesion = root_adhesion[row] * punch * root
            value = 4 / 3 * a**3 * sphere - adhesion * a * edge
            slope = 4 * a * a * sphere + 4 / 3 * a**3 * _series(curves[2], x)
            slope -= adhesion * (1.5 * edge + a * _series(curves[3], x))
            if slope <= 0 or (a == end and value < load[row]):
                a = np.nan
                break
            step = (value - load[row]) / slope
            a = min(max(a - step, a / 4), end)
            if abs(step) <= tolerance * a:
                break
        alpha[row] = a if a > 2 * smallest else np.nan
