"""Compiled: products of what a dynamic factor is on each line with its derivatives, for the sums of `frf_products`."""

import numpy as np
from numpy.typing import NDArray

from underskin.compiled import compiled
from underskin.units import Array, Floats

_THREE, _FOUR = "float64[:, :, ::1]", "float64[:, :, :, ::1]"


@compiled(f"void(complex128[:, :, ::1], {_THREE}, {_THREE}, {_THREE})")
def line_products(each: Array, products: Floats, real: Floats, imag: Floats) -> None:
    """Re x*y of all pairs of functions on the lines.

    Parameters
    ----------
    each
        The functions (points, functions, lines).
    products
        (points, pairs, lines) the pairs in the order of the upper triangle, to be filled.
    real, imag
        (points, functions, lines) the functions' parts, to be filled.
    """
    points, functions, lines = each.shape
    for point in range(points):
        for one in range(functions):
            for line in range(lines):
                real[point, one, line] = each[point, one, line].real
                imag[point, one, line] = each[point, one, line].imag
        pair = 0
        for one in range(functions):
            re, im = real[point, one], imag[point, one]
            for other in range(one, functions):
                own, re_other, im_other = products[point, pair], real[point, other], imag[point, other]
                for line in range(lines):
                    own[line] = re[line] * re_other[line] + im[line] * im_other[line]
                pair += 1


@compiled(f"void({_THREE}, {_THREE}, int64[::1], {_THREE}, {_THREE}, {_FOUR})")
def spread_sums(both: Floats, with_y: Floats, moving: NDArray[np.int64], uv: Floats, vy: Floats, vv: Floats) -> None:
    """The sums with derivatives at the places of their parameters.

    Parameters
    ----------
    both
        (points, pairs, recordings) of u and its derivatives, the pairs in the order of the upper triangle.
    with_y
        (points, 1 + derivatives, recordings) of each with what was measured.
    moving
        (derivatives,) the parameters that they are by.
    uv, vy, vv
        (points, recordings, parameters), twice, and (points, recordings, parameters, parameters), of which what differs
        from 0 is filled.
    """
    points, _, recordings = both.shape
    count = len(moving)
    for point in range(points):
        for one in range(count):
            p = moving[one]
            for recording in range(recordings):
                uv[point, recording, p] = both[point, 1 + one, recording]
                vy[point, recording, p] = with_y[point, 1 + one, recording]
        pair = 1 + count
        for one in range(count):
            for other in range(one, count):
                p, q = moving[one], moving[other]
                for recording in range(recordings):
                    vv[point, recording, p, q] = vv[point, recording, q, p] = both[point, pair, recording]
                pair += 1
