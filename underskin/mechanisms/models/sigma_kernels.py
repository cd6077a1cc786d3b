"""Compiled functions for the stress of the linear layer under contacts at an offset from the sensors' centres.

Arrays are (points, rows), where either may be 1 and is then broadcast; derivatives have the variables along their first
axis.
"""

import numpy as np

from underskin.compiled import compiled
from underskin.surrogate.spline_kernel import AXES, Axes, Integers, cell_at, functions_at
from underskin.units import Floats

_COLUMNS = "float64[:, ::1]"
_SLOPES = "float64[:, :, ::1]"
_SMALL = 0.05  # of x, below which Hertz' transform is its series


@compiled()
def _product(a: Floats, b: Floats) -> float:
    """Σ a · b in four sums, which a processor computes in parallel; the number of terms is a multiple of four."""
    s0 = s1 = s2 = s3 = 0.0
    for k in range(0, len(a), 4):
        s0 += a[k] * b[k]
        s1 += a[k + 1] * b[k + 1]
        s2 += a[k + 2] * b[k + 2]
        s3 += a[k + 3] * b[k + 3]
    return (s0 + s1) + (s2 + s3)


@compiled(f"void({_COLUMNS}, float64, {AXES}, int64[::1], float64[:, :, :, ::1], {_COLUMNS}, {_SLOPES})")
def linear_sigma(
    bessel: Floats,
    end: float,
    axis: Axes,
    contact: Integers,
    transforms: Floats,
    e: Floats,
    result: Floats,
) -> None:
    """Hankel integrals of transforms at offsets, and the first one's derivative by the offset.

    Parameters
    ----------
    bessel
        (functions of e, k) J0(k e) with the weights of the integral.
    end
        Of e, beyond which the integrals are 0.
    axis
        Of e.
    contact
        (rows,) the contact of each row.
    transforms
        (quantities, points, contacts, k).
    e
        (points, rows).
    result
        (quantities + 1, points, rows), to be filled.
    """
    starts, lower, first, cubics, limits, buckets, begin = axis
    kernel, slope = np.empty(bessel.shape[1]), np.empty(bessel.shape[1])
    _, points, rows = result.shape
    count, of_points, of_contacts, _ = transforms.shape
    for point in range(points):
        transform_point, of_e = min(point, of_points - 1), min(point, e.shape[0] - 1)
        for row in range(rows):
            at = e[of_e, min(row, e.shape[1] - 1)]
            if at > end:
                result[:, point, row] = 0.0
                continue
            cell = cell_at(starts, limits, buckets, begin, 0, at)
            (v0, v1, v2, v3), (d0, d1, d2, d3) = functions_at(cubics[cell], at - lower[cell], 0.0)
            lowest = first[cell]
            for k in range(bessel.shape[1]):
                b0, b1, b2, b3 = bessel[lowest, k], bessel[lowest + 1, k], bessel[lowest + 2, k], bessel[lowest + 3, k]
                kernel[k] = b0 * v0 + b1 * v1 + b2 * v2 + b3 * v3
                slope[k] = b0 * d0 + b1 * d1 + b2 * d2 + b3 * d3
            transform_contact = min(contact[row], of_contacts - 1)
            for quantity in range(count):
                result[quantity, point, row] = _product(
                    transforms[quantity, transform_point, transform_contact], kernel
                )
            result[count, point, row] = _product(transforms[0, transform_point, transform_contact], slope)


@compiled("void(float64[::1], int64, float64[:, ::1], float64[:, :, ::1])")
def sphere_and_punch(k: Floats, panel: int, alpha: Floats, shapes: Floats) -> None:
    """Transforms of Hertz' and of a flat punch's pressure and their derivatives by a/h, at k (wave numbers).

    With x = k a/h: p̂_sphere = 3 (sin x − x cos x)/x³ and p̂_punch = sin x/x. The wave numbers are in panels of `panel`
    nodes; those at the same position of successive panels are equally spaced, so sines follow from panel to panel by a
    rotation.

    Parameters
    ----------
    alpha
        a/h (points, contacts).
    shapes
        (4, points · contacts, k): both transforms, then both derivatives; to be filled.
    """
    stride = k[panel] - k[0] if len(k) > panel else 0.0
    contacts = alpha.shape[1]
    for number in range(alpha.size):
        a = alpha[number // contacts, number % contacts]
        turn_sin, turn_cos = np.sin(stride * a), np.cos(stride * a)
        for node in range(panel):
            sine, cosine = np.sin(k[node] * a), np.cos(k[node] * a)
            for index in range(node, len(k), panel):
                x = k[index] * a
                punch = sine / x
                series = 1 - x * x / 10 + x**4 / 280
                sphere = series if x < _SMALL else 3 * (punch - cosine) / (x * x)
                shapes[0, number, index] = sphere
                shapes[1, number, index] = punch
                shapes[2, number, index] = 3 * (punch - sphere) / a
                shapes[3, number, index] = (cosine - punch) / a
                sine, cosine = sine * turn_cos + cosine * turn_sin, cosine * turn_cos - sine * turn_sin
