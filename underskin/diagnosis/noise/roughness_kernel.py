"""Compiled: how probable the roughness of lines is under their noise, and what each line's variance does to it."""

import numpy as np
from numpy.typing import NDArray

from underskin.compiled import compiled
from underskin.units import Floats

_TOGETHER = 4  # factors, of 1e-70 to 1e70 each, whose logarithm is taken of their product


@compiled("float64(float64[::1], int64[::1], float64[::1], float64[::1], float64, float64[::1])")
def roughness_cost(
    variance: Floats, middle: NDArray[np.int64], share: Floats, rough: Floats, freedom: float, by_variance: Floats
) -> float:
    """Σ ln v + (ν/2 + 1) ln(1 + 2u/ν), u = rough/v and v = d²ⱼ + λ² d²ⱼ₋₁ + (1 − λ)² d²ⱼ₊₁: Student's likelihood.

    Parameters
    ----------
    variance
        d² (rows,).
    middle, share, rough
        The rows j that are compared with their neighbours, λ, and half the square of what they are off.
    freedom
        ν.
    by_variance
        (rows,) to which the derivatives by d² are added.
    """
    power = freedom / 2 + 1
    total, of_v, of_u = 0.0, 1.0, 1.0
    for number in range(len(middle)):
        j = middle[number]
        before, after = share[number] ** 2, (1 - share[number]) ** 2
        v = variance[j] + before * variance[j - 1] + after * variance[j + 1]
        x = 2 * rough[number] / (v * freedom)
        of_v *= v
        of_u *= 1 + x
        if number % _TOGETHER == 0:
            total += np.log(of_v) + power * np.log(of_u)
            of_v, of_u = 1.0, 1.0
        slope = (1 - power * x / (1 + x)) / v
        by_variance[j] += slope
        by_variance[j - 1] += before * slope
        by_variance[j + 1] += after * slope
    return total + np.log(of_v) + power * np.log(of_u)
