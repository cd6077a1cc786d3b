"""Compiled: what sums over rows lose to mains pick-up, at many sets of noise levels.

A row of variance κ² d² has κ² d² + q² with pick-up, so that its weight 1/d² in the sums (over κ²) becomes
1/d² · 1/(1 + x), x = (q/κ)²/d², and log|C| grows by 2 log(1 + x).
"""

import numpy as np
from numpy.typing import NDArray

from underskin.compiled import compiled
from underskin.units import Array, Complexes, Floats

_TOGETHER = 8  # factors of the determinant whose logarithm is taken together: below 1e38 each, they do not overflow
_NONE = 1e-17  # of x, below which a row loses nothing that its sum could tell
_SUMS = "float64[:, :, ::1]"
_ROWS = "int64[::1], float64[::1], int64[::1], complex128[::1], int64[::1]"


@compiled()
def _take(taken: Floats, uu: Floats, uy: Floats, yy: Floats, point: int, recording: int) -> None:
    """Take what a recording's rows lose (3, sets) from its sums, and begin anew."""
    for number in range(taken.shape[1]):
        uu[point, number, recording] -= taken[0, number]
        uy[point, number, recording] -= taken[1, number]
        yy[point, number, recording] -= taken[2, number]
    taken[:] = 0.0


@compiled(f"void(float64[:, :, ::1], {_ROWS}, complex128[:, ::1], {_SUMS}, {_SUMS}, {_SUMS}, float64[:, ::1])")
def lost(
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
    """Take from `uu`, `uy` and `yy` (points, sets, recordings) what rows lose, x/(1 + x)/d² of each, and add 2 log(1 +
    x) to `log_determinant` (points, sets).

    Parameters
    ----------
    pickup
        (q/κ)² (points, distinct, sets).
    alike, precision, recording, y, line
        Of each row: which of the distinct q it has, 1/d², the recording, the measured value and the line.
    u
        The direction (points, lines).
    """
    points, distinct, sets = pickup.shape
    factors, total, taken, largest = np.empty(sets), np.empty(sets), np.zeros((3, sets)), np.empty(distinct)
    for point in range(points):
        factors[:], total[:] = 1.0, 0.0
        count, of = 0, 0
        for number in range(distinct):
            largest[number] = pickup[point, number].max()
        for row in range(len(y)):
            kind, weight = alike[row], precision[row]
            if largest[kind] * weight <= _NONE:
                continue
            if recording[row] != of:
                _take(taken, uu, uy, yy, point, of)
                of = recording[row]
            at, measured = u[point, line[row]], y[row]
            uu_row = at.real * at.real + at.imag * at.imag
            uy_row = at.real * measured.real + at.imag * measured.imag
            yy_row = measured.real * measured.real + measured.imag * measured.imag
            for number in range(sets):
                x = pickup[point, kind, number] * weight
                less = x / (1 + x) * weight
                taken[0, number] += less * uu_row
                taken[1, number] += less * uy_row
                taken[2, number] += less * yy_row
                factors[number] *= 1 + x
            count += 1
            if count == _TOGETHER:
                for number in range(sets):
                    total[number] += np.log(factors[number])
                    factors[number] = 1.0
                count = 0
        _take(taken, uu, uy, yy, point, of)
        for number in range(sets):
            log_determinant[point, number] += 2 * (total[number] + np.log(factors[number]))


@compiled(
    f"void(float64[:, ::1], {_ROWS}, complex128[:, ::1], complex128[:, :, ::1], {_SUMS}, {_SUMS}, "
    "float64[:, :, :, ::1])"
)
def slopes_lost(
    pickup: Floats,
    alike: NDArray[np.int64],
    precision: Floats,
    recording: NDArray[np.int64],
    y: Complexes,
    line: NDArray[np.int64],
    u: Array,
    v: Array,
    uv: Floats,
    vy: Floats,
    vv: Floats,
) -> None:
    """Take from `uv`, `vy` (points, recordings, P) and `vv` (points, recordings, P, P) what rows lose.

    Parameters
    ----------
    pickup
        (q/κ)² (points, distinct).
    alike, precision, recording, y, line
        See `lost`.
    u, v
        The direction (points, lines), and its derivatives (points, P, lines).
    """
    points, count, lines = v.shape
    moving = np.empty(count, dtype=np.int64)
    for point in range(points):
        moves = 0
        for p in range(count):
            for at in range(lines):
                if v[point, p, at] != 0:
                    moving[moves] = p
                    moves += 1
                    break
        for row in range(len(y)):
            x = pickup[point, alike[row]] * precision[row]
            if x > _NONE and moves:
                less, of, at = x / (1 + x) * precision[row], recording[row], line[row]
                direction, measured = u[point, at], y[row]
                for one in range(moves):
                    p = moving[one]
                    of_p = v[point, p, at]
                    uv[point, of, p] -= less * (direction.real * of_p.real + direction.imag * of_p.imag)
                    vy[point, of, p] -= less * (measured.real * of_p.real + measured.imag * of_p.imag)
                    for other in range(moves):
                        q = moving[other]
                        of_q = v[point, q, at]
                        vv[point, of, p, q] -= less * (of_p.real * of_q.real + of_p.imag * of_q.imag)
