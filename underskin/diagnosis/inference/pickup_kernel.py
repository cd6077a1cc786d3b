"""Compiled: what sums over rows lose to mains pick-up, at many sets of noise levels."""

import numpy as np
from numpy.typing import NDArray

from underskin.compiled import compiled
from underskin.units import Array, Floats

_TOGETHER = 8  # factors of the determinant whose logarithm is taken together: below 1e38 each, they do not overflow
_SUMS = "float64[:, :, ::1]"


@compiled(
    "void(float64[:, :, ::1], float64[:, ::1], float64[::1], int64[::1], float64[::1], float64[:, ::1], "
    f"float64[:, ::1], {_SUMS}, {_SUMS}, {_SUMS}, float64[:, ::1])"
)
def lost(
    pickup: Floats,
    level: Floats,
    variance: Floats,
    recording: NDArray[np.int64],
    yy_row: Floats,
    uu_row: Floats,
    uy_row: Floats,
    uu: Floats,
    uy: Floats,
    yy: Floats,
    log_determinant: Floats,
) -> None:
    """Take from `uu`, `uy` and `yy` (points, sets, recordings) what rows lose, 1/d² less 1/(d² + q²/κ²) of each, and
    add what that does to the log of the determinant (points, sets).

    Parameters
    ----------
    pickup, level
        q (points, sets, rows) and κ (points, sets).
    variance, recording, yy_row
        d², the recording and |y|² of each row.
    uu_row, uy_row
        |u|² and Re u*y of each row (points, rows).
    """
    points, sets, rows = pickup.shape
    for point in range(points):
        for number in range(sets):
            inverse = 1 / level[point, number] ** 2
            determinant, total = 1.0, 0.0
            for row in range(rows):
                ratio = pickup[point, number, row] ** 2 * inverse / variance[row]
                more = 1 + ratio
                less = ratio / (more * variance[row])
                of = recording[row]
                uu[point, number, of] -= less * uu_row[point, row]
                uy[point, number, of] -= less * uy_row[point, row]
                yy[point, number, of] -= less * yy_row[row]
                determinant *= more
                if row % _TOGETHER == 0:
                    total += np.log(determinant)
                    determinant = 1.0
            log_determinant[point, number] += 2 * (total + np.log(determinant))


@compiled(
    f"void(float64[:, ::1], float64[::1], float64[::1], int64[::1], complex128[::1], complex128[:, ::1], "
    f"complex128[:, :, ::1], {_SUMS}, {_SUMS}, float64[:, :, :, ::1])"
)
def slopes_lost(
    pickup: Floats,
    level: Floats,
    variance: Floats,
    recording: NDArray[np.int64],
    y: Array,
    u: Array,
    v: Array,
    uv: Floats,
    vy: Floats,
    vv: Floats,
) -> None:
    """Take from `uv`, `vy` (points, recordings, P) and `vv` (points, recordings, P, P) what rows lose.

    Parameters
    ----------
    pickup, level
        q (points, rows) and κ (points,).
    variance, recording, y
        d², the recording and the measured value of each row.
    u, v
        The direction (points, rows), and its derivatives (points, P, rows).
    """
    points, count, rows = v.shape
    for point in range(points):
        inverse = 1 / level[point] ** 2
        for row in range(rows):
            ratio = pickup[point, row] ** 2 * inverse / variance[row]
            less, of = ratio / ((1 + ratio) * variance[row]), recording[row]
            for p in range(count):
                of_p = v[point, p, row]
                uv[point, of, p] -= less * (u[point, row].real * of_p.real + u[point, row].imag * of_p.imag)
                vy[point, of, p] -= less * (y[row].real * of_p.real + y[row].imag * of_p.imag)
                for q in range(count):
                    of_q = v[point, q, row]
                    vv[point, of, p, q] -= less * (of_p.real * of_q.real + of_p.imag * of_q.imag)
