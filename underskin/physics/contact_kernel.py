"""Compiled: contact radii of spheres on a layer under given loads, from the layer's Chebyshev series; and spherical
Bessel functions of all even orders at once, by their recurrence."""

import numpy as np

from underskin.compiled import compiled
from underskin.units import Floats

_ITERATIONS = 60
_BEYOND = 30  # orders above the last at which the downward recurrence starts, so that its start has decayed
_BEGINNING = 1e-200
_TERMS = 9  # of the series below s = 1: the next is below 1e-19 of the first


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


@compiled()
def _by_series(s: float, values: Floats) -> None:
    """jₙ(s) = sⁿ/(2n + 1)!! Σ (−s²/2)ᵐ/(m! (2n + 3) (2n + 5) …), for s < 1."""
    leading, half = 1.0, -0.5 * s * s
    for index in range(len(values)):
        order = 2 * index
        if index:
            leading *= s * s / ((2 * order - 1) * (2 * order + 1))
        term, total = 1.0, 1.0
        for m in range(1, _TERMS):
            term *= half / (m * (2 * (order + m) + 1))
            total += term
        values[index] = leading * total


@compiled("void(float64[::1], float64[:, ::1])")
def even_orders(s: Floats, values: Floats) -> None:
    """j₀(s), j₂(s), … (rows, orders), to be filled, of s ≥ 0 (rows,).

    By jₙ₋₁ + jₙ₊₁ = (2n + 1)/s jₙ: upwards from j₀ and j₁ where s exceeds all orders, else downwards from a higher
    order, scaled to j₀ or j₁, whichever is larger.
    """
    last = 2 * (values.shape[1] - 1)
    for row in range(len(s)):
        x = s[row]
        if x < 1:
            _by_series(x, values[row])
            continue
        first = np.sin(x) / x
        second = first / x - np.cos(x) / x
        if x > last:
            low, high = first, second
            for order in range(last + 1):
                if order % 2 == 0:
                    values[row, order // 2] = low
                low, high = high, (2 * order + 3) / x * high - low
        else:
            high, here = 0.0, _BEGINNING
            for order in range(last + _BEYOND, 0, -1):
                if order <= last and order % 2 == 0:
                    values[row, order // 2] = here
                high, here = here, (2 * order + 1) / x * here - high
            values[row, 0] = here  # and `high` is that of order 1
            values[row] *= first / here if abs(first) > abs(second) else second / high
