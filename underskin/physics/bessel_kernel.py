"""Compiled: spherical Bessel functions of all even orders at once, by their recurrence."""

import numpy as np

from underskin.compiled import compiled
from underskin.units import Floats

_BEYOND = 30  # orders above the last at which the downward recurrence starts, so that its start has decayed
_BEGINNING = 1e-200
_TERMS = 9  # of the series below s = 1: the next is below 1e-19 of the first


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
