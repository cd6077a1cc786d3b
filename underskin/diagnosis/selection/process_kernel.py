"""Compiled: what a Gaussian process of several amplitudes gains, from its features' moments."""

import numpy as np

from underskin.compiled import compiled
from underskin.units import Floats


@compiled("void(float64[:, :, ::1], float64[:, ::1], float64[::1], float64[:, ::1])")
def gained(grams: Floats, moments: Floats, amplitudes: Floats, gains: Floats) -> None:
    """ln p(y) with a process less that without, ½ (a² mᵀ (I + a² G)⁻¹ m − ln |I + a² G|), by Cholesky's factors.

    Parameters
    ----------
    grams
        G (sets, features, features), AᵀC⁻¹A of the features A.
    moments
        m (sets, features), AᵀC⁻¹r of the residual r.
    amplitudes
        a.
    gains
        (sets, amplitudes), to be filled.
    """
    size = moments.shape[1]
    lower, solved = np.empty((size, size)), np.empty(size)
    for number in range(len(moments)):
        for which in range(len(amplitudes)):
            a2 = amplitudes[which] ** 2
            determinant = square = 0.0
            for i in range(size):
                for j in range(i):
                    total = a2 * grams[number, i, j]
                    for k in range(j):
                        total -= lower[i, k] * lower[j, k]
                    lower[i, j] = total / lower[j, j]
                total, right = 1 + a2 * grams[number, i, i], moments[number, i]
                for k in range(i):
                    total -= lower[i, k] ** 2
                    right -= lower[i, k] * solved[k]
                lower[i, i] = np.sqrt(total)
                solved[i] = right / lower[i, i]
                determinant += np.log(total)
                square += solved[i] ** 2
            gains[number, which] = 0.5 * (a2 * square - determinant)
