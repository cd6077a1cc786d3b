"""Compiled sums over rows: the likelihood of the roughness of lines, products of dynamic factors with their
derivatives, and corrections of sums for mains pick-up.

A row of variance κ² d² has κ² d² + q² with pick-up: its weight 1/d² in the sums (over κ²) becomes
1/d² · 1/(1 + x), x = (q/κ)²/d², and log|C| grows by 2 log(1 + x).
"""

import numpy as np
from numpy.typing import NDArray

from underskin.compiled import compiled
from underskin.units import Array, Complexes, Floats

_VARIANCES_TOGETHER = 4  # factors, of 1e-70 to 1e70 each, that share one logarithm


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
        The rows j that are compared with their neighbours, λ, and half the square of their deviations.
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
        if number % _VARIANCES_TOGETHER == 0:
            total += np.log(of_v) + power * np.log(of_u)
            of_v, of_u = 1.0, 1.0
        slope = (1 - power * x / (1 + x)) / v
        by_variance[j] += slope
        by_variance[j - 1] += before * slope
        by_variance[j + 1] += after * slope
    return total + np.log(of_v) + power * np.log(of_u)


_THREE = "float64[:, :, ::1]"


@compiled(f"void(complex128[:, :, ::1], {_THREE}, {_THREE}, {_THREE})")
def line_products(values: Array, products: Floats, real: Floats, imag: Floats) -> None:
    """Re x*y of all pairs of functions on the lines.

    Parameters
    ----------
    values
        The functions (points, functions, lines).
    products
        (points, pairs, lines) the pairs in the order of the upper triangle, to be filled.
    real, imag
        (points, functions, lines) the functions' parts, to be filled.
    """
    points, functions, lines = values.shape
    for point in range(points):
        for first in range(functions):
            for line in range(lines):
                real[point, first, line] = values[point, first, line].real
                imag[point, first, line] = values[point, first, line].imag
        pair = 0
        for first in range(functions):
            re, im = real[point, first], imag[point, first]
            for second in range(first, functions):
                product, re_other, im_other = products[point, pair], real[point, second], imag[point, second]
                for line in range(lines):
                    product[line] = re[line] * re_other[line] + im[line] * im_other[line]
                pair += 1


_ROWS_TOGETHER = 8  # factors of the determinant that share one logarithm: below 1e38 each, they do not overflow
_NONE = 1e-17  # of x: smaller losses are below the sum's rounding
_ROWS = "int64[::1], float64[::1], int64[::1], complex128[::1], int64[::1]"


@compiled()
def _subtract_losses(losses: Floats, uu: Floats, uy: Floats, yy: Floats, point: int, recording: int) -> None:
    """Subtract the losses (3, sets) of a recording's rows from its sums, and reset them."""
    for number in range(losses.shape[1]):
        uu[point, number, recording] -= losses[0, number]
        uy[point, number, recording] -= losses[1, number]
        yy[point, number, recording] -= losses[2, number]
    losses[:] = 0.0


@compiled(f"void({_THREE}, {_ROWS}, complex128[:, ::1], {_THREE}, {_THREE}, {_THREE}, float64[:, ::1])")
def subtract_pickup(
    pickup: Floats,
    alike: NDArray[np.int64],
    precision: Floats,
    recording: NDArray[np.int64],
    y: Complexes,
    line: NDArray[np.int64],
    u: Array,
    uu: Floats,
    uy: Floats,
    yy: Floats,
    log_determinant: Floats,
) -> None:
    """Subtract each row's loss x/(1 + x)/d² from `uu`, `uy` and `yy` (points, sets, recordings), and add 2 log(1 + x)
    to `log_determinant` (points, sets).

    Parameters
    ----------
    pickup
        (q/κ)² (points, distinct, sets).
    alike, precision, recording, y, line
        Of each row: the index of its distinct q, 1/d², the recording, the measured value and the line.
    u
        The direction (points, lines).
    """
    points, distinct, sets = pickup.shape
    factors, total, losses, largest = np.empty(sets), np.empty(sets), np.zeros((3, sets)), np.empty(distinct)
    for point in range(points):
        factors[:], total[:] = 1.0, 0.0
        count, current_recording = 0, 0
        for number in range(distinct):
            largest[number] = pickup[point, number].max()
        for row in range(len(y)):
            deviation_index, weight = alike[row], precision[row]
            if largest[deviation_index] * weight <= _NONE:
                continue
            if recording[row] != current_recording:
                _subtract_losses(losses, uu, uy, yy, point, current_recording)
                current_recording = recording[row]
            direction, measured = u[point, line[row]], y[row]
            uu_row = direction.real * direction.real + direction.imag * direction.imag
            uy_row = direction.real * measured.real + direction.imag * measured.imag
            yy_row = measured.real * measured.real + measured.imag * measured.imag
            for number in range(sets):
                x = pickup[point, deviation_index, number] * weight
                loss = x / (1 + x) * weight
                losses[0, number] += loss * uu_row
                losses[1, number] += loss * uy_row
                losses[2, number] += loss * yy_row
                factors[number] *= 1 + x
            count += 1
            if count == _ROWS_TOGETHER:
                for number in range(sets):
                    total[number] += np.log(factors[number])
                    factors[number] = 1.0
                count = 0
        _subtract_losses(losses, uu, uy, yy, point, current_recording)
        for number in range(sets):
            log_determinant[point, number] += 2 * (total[number] + np.log(factors[number]))
