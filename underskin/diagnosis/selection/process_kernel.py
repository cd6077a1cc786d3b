"""Compiled: what Gaussian processes of several amplitudes gain, from their features' moments."""

import numpy as np

from underskin.compiled import compiled
from underskin.units import Floats, Indices

_TOGETHER = 8  # factors of a determinant whose logarithm is taken together: below 1e38 each, they do not overflow
_LOWEST, _HIGHEST = -1.0, 5.0  # of log κ
_TOLERANCE = 1e-3
_SECTION = 0.6180339887498949  # golden


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


@compiled("void(float64[:, ::1], int64[::1], int64[::1], float64[:, ::1], float64[:, :, :, ::1])")
def less_shared(weights: Floats, rows: Indices, first: Indices, columns: Floats, grams: Floats) -> None:
    """Take Σ sₙ sₙᵀ off products of columns, sₙ = Σ w x over the n-th sensor's recordings.

    Parameters
    ----------
    weights
        w at each scatter (scatters, pairs), the pairs of a sensor one after another.
    rows, first
        The row of `columns` of each pair, and where the pairs of each sensor begin (sensors + 1,).
    columns
        x (rows, sets · features).
    grams
        (sets, scatters, features, features), to be changed.
    """
    count, size = grams.shape[0], grams.shape[2]
    width = count * size
    sums = np.empty(width)
    for scatter in range(len(weights)):
        for sensor in range(len(first) - 1):
            sums[:] = 0.0
            for pair in range(first[sensor], first[sensor + 1]):
                weight, row = weights[scatter, pair], rows[pair]
                for column in range(width):
                    sums[column] += weight * columns[row, column]
            for number in range(count):
                for i in range(size):
                    for j in range(size):
                        grams[number, scatter, i, j] -= sums[number * size + i] * sums[number * size + j]


@compiled()
def _log_density(
    log_level: float, chi2: float, freedom: float, prior: Floats, eigenvalues: Floats, squares: Floats, a2: float
) -> float:
    """See `at_best_level`."""
    inverse = np.exp(-2 * log_level)
    below = max((prior[0] - log_level) / prior[2], 0.0)
    above = max((log_level - prior[1]) / prior[3], 0.0)
    total = -0.5 * (below + above) ** 2 - prior[4] - 0.5 * chi2 * inverse - freedom * log_level
    determinant = 1.0
    for number in range(len(eigenvalues)):
        inner = 1 + a2 * eigenvalues[number] * inverse
        total += 0.5 * a2 * squares[number] / inner * inverse * inverse
        determinant *= inner
        if number % _TOGETHER == 0:
            total -= np.log(determinant)
            determinant = 1.0
    return total - np.log(determinant)


@compiled("void(float64, float64, float64[::1], float64[::1], float64[::1], float64[::1], float64[::1])")
def at_best_level(
    chi2: float,
    freedom: float,
    prior: Floats,
    eigenvalues: Floats,
    squares: Floats,
    amplitudes: Floats,
    log_densities: Floats,
) -> None:
    """ln p(r, κ) of complex lines with a process, at the level κ of their noise that is most probable.

    −½ (χ²/κ² − Σ a² sₙ/(κ⁴ (1 + a² λₙ/κ²))) − ν ln κ − Σ ln(1 + a² λₙ/κ²) + ln p(κ), by golden sections.

    Parameters
    ----------
    chi2, freedom
        χ² of the lines at κ = 1 without a process, and ν.
    prior
        Of ln κ, see `Plateau.row`.
    eigenvalues, squares
        λₙ of the features' products AᵀWA, and sₙ = |vₙᵀAᵀW r|² along its eigenvectors vₙ.
    amplitudes, log_densities
        a, and the result for each, to be filled.
    """
    for which in range(len(amplitudes)):
        a2 = amplitudes[which] ** 2
        low, high = _LOWEST, _HIGHEST
        left, right = high - _SECTION * (high - low), low + _SECTION * (high - low)
        at_left = _log_density(left, chi2, freedom, prior, eigenvalues, squares, a2)
        at_right = _log_density(right, chi2, freedom, prior, eigenvalues, squares, a2)
        while high - low > _TOLERANCE:
            if at_left > at_right:
                high, right, at_right = right, left, at_left
                left = high - _SECTION * (high - low)
                at_left = _log_density(left, chi2, freedom, prior, eigenvalues, squares, a2)
            else:
                low, left, at_left = left, right, at_right
                right = low + _SECTION * (high - low)
                at_right = _log_density(right, chi2, freedom, prior, eigenvalues, squares, a2)
        log_densities[which] = max(at_left, at_right)
