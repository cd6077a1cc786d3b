"""Compiled functions for σ of contacts at an offset from the sensors' centres, with derivatives.

Contacts follow Hertz' law for spheres without adhesion on an incompressible layer: a³ = 9 F R/(16 E), L = F/(R² E).
A tensor product s(a, x, ρ, e) = Σ c_ijkl A_i(a) X_j(x) P_k(ln ρ) E_l(e) of cubic splines (coefficients of
`sigma_curves`) has four non-zero functions along each axis at a point. Arrays are (points, rows), where either may
be 1 and is then broadcast; derivatives have the variables along their first axis.
"""

import numpy as np
from numpy.typing import NDArray

from underskin.compiled import compiled
from underskin.units import Floats

_COLUMNS = "float64[:, ::1]"
_SLOPES = "float64[:, :, ::1]"
_VARIABLE = f"{_COLUMNS}, {_SLOPES}"


@compiled(f"void(float64[::1], float64[::1], {', '.join([_VARIABLE] * 4)})")
def spheres(
    force: Floats,
    radius: Floats,
    modulus: Floats,
    modulus_slopes: Floats,
    thickness: Floats,
    thickness_slopes: Floats,
    a: Floats,
    a_slopes: Floats,
    x: Floats,
    x_slopes: Floats,
) -> None:
    """a/h and L^(1/3) of contacts, with their derivatives.

    Parameters
    ----------
    force, radius
        Of each contact (contacts,) [N, m].
    modulus, thickness
        [Pa, m], with the derivatives of each.
    a, x
        (points, contacts), and their derivatives (variables, points, contacts), to be filled.
    """
    points, contacts = a.shape
    for point in range(points):
        of_h = min(point, len(thickness) - 1)
        h, of_modulus = thickness[of_h, 0], min(point, len(modulus) - 1)
        for contact in range(contacts):
            column = min(contact, modulus.shape[1] - 1)
            e = modulus[of_modulus, column]
            ratio = np.cbrt(0.5625 * force[contact] * radius[contact] / e) / h
            load = np.cbrt(force[contact] / radius[contact] ** 2 / e)
            a[point, contact], x[point, contact] = ratio, load
            for number in range(len(a_slopes)):
                third = modulus_slopes[number, of_modulus, column] / (3 * e)
                a_slopes[number, point, contact] = -ratio * (third + thickness_slopes[number, of_h, 0] / h)
                x_slopes[number, point, contact] = -load * third


_SMALL = 0.05  # of x, below which Hertz' transform is its series


@compiled()
def four_functions(at: float, low: float, high: float, knots: Floats, cubics: Floats, functions: Floats) -> int:
    """Index of the cell that holds `at`; values and slopes of its four functions are written to `functions` (8,).

    Beyond the nodes, from `low` to `high`, every function is continued along its tangent.
    """
    inside = min(max(at, low), high)
    first, last = 0, len(knots) - 2
    while first < last:
        middle = (first + last) // 2
        if inside >= knots[middle + 1]:
            first = middle + 1
        else:
            last = middle
    u = inside - knots[first]
    for number in range(4):
        c0, c1, c2, c3 = (
            cubics[first, 0, number],
            cubics[first, 1, number],
            cubics[first, 2, number],
            cubics[first, 3, number],
        )
        slope = c1 + u * (2 * c2 + u * 3 * c3)
        functions[number] = c0 + u * (c1 + u * (c2 + u * c3)) + slope * (at - inside)
        functions[4 + number] = slope
    return first


_AXIS = "float64[::1], float64[:, :, ::1]"


@compiled(
    f"void(float64[:, :, :, ::1], float64[:, ::1], {_AXIS}, {_AXIS}, {_AXIS}, {_AXIS}, int64[::1], "
    f"{_VARIABLE}, {_VARIABLE}, {_VARIABLE}, {_VARIABLE}, {_VARIABLE})"
)
def table_sigma(
    coefficients: Floats,
    ends: Floats,
    knots_a: Floats,
    cubics_a: Floats,
    knots_x: Floats,
    cubics_x: Floats,
    knots_rho: Floats,
    cubics_rho: Floats,
    knots_e: Floats,
    cubics_e: Floats,
    contact: NDArray[np.int64],
    a: Floats,
    a_slopes: Floats,
    x: Floats,
    x_slopes: Floats,
    rho: Floats,
    rho_slopes: Floats,
    e: Floats,
    e_slopes: Floats,
    value: Floats,
    slopes: Floats,
) -> None:
    """σ of the table and its derivatives.

    Parameters
    ----------
    coefficients
        (a, x, ln ρ, e).
    ends
        (4, 2) lowest and highest node of each axis; beyond the end of e, σ is 0.
    knots_a, cubics_a, …
        Of each axis, see `CubicBasis`.
    contact
        (rows,) the contact of each row.
    a, x, rho
        a/h, L^(1/3) of the contacts (points, contacts), and ρ (points, 1).
    e
        e/h of the rows.
    value, slopes
        (points, rows) and (variables, points, rows), to be filled.
    """
    in_a, in_x, in_rho, in_e = np.empty(8), np.empty(8), np.empty(8), np.empty(8)
    points, rows = value.shape
    for point in range(points):
        of_a, of_x = min(point, a.shape[0] - 1), min(point, x.shape[0] - 1)
        of_rho, of_e = min(point, rho.shape[0] - 1), min(point, e.shape[0] - 1)
        inverse = 1 / rho[of_rho, 0]
        third = four_functions(np.log(rho[of_rho, 0]), ends[2, 0], ends[2, 1], knots_rho, cubics_rho, in_rho)
        for row in range(rows):
            column_a, column_x = min(contact[row], a.shape[1] - 1), min(contact[row], x.shape[1] - 1)
            column_e = min(row, e.shape[1] - 1)
            if e[of_e, column_e] > ends[3, 1]:
                value[point, row] = 0.0
                slopes[:, point, row] = 0.0
                continue
            first = four_functions(a[of_a, column_a], ends[0, 0], ends[0, 1], knots_a, cubics_a, in_a)
            second = four_functions(x[of_x, column_x], ends[1, 0], ends[1, 1], knots_x, cubics_x, in_x)
            fourth = four_functions(e[of_e, column_e], ends[3, 0], ends[3, 1], knots_e, cubics_e, in_e)
            s = by_a = by_x = by_rho = by_e = 0.0
            for i in range(4):
                s_x = slope_x = rho_x = e_x = 0.0
                for j in range(4):
                    s_rho = slope_rho = e_rho = 0.0
                    for k in range(4):
                        c = coefficients[first + i, second + j, third + k, fourth : fourth + 4]
                        along = c[0] * in_e[0] + c[1] * in_e[1] + c[2] * in_e[2] + c[3] * in_e[3]
                        slope = c[0] * in_e[4] + c[1] * in_e[5] + c[2] * in_e[6] + c[3] * in_e[7]
                        s_rho += in_rho[k] * along
                        slope_rho += in_rho[4 + k] * along
                        e_rho += in_rho[k] * slope
                    s_x += in_x[j] * s_rho
                    slope_x += in_x[4 + j] * s_rho
                    rho_x += in_x[j] * slope_rho
                    e_x += in_x[j] * e_rho
                s += in_a[i] * s_x
                by_a += in_a[4 + i] * s_x
                by_x += in_a[i] * slope_x
                by_rho += in_a[i] * rho_x
                by_e += in_a[i] * e_x
            by_rho *= inverse
            value[point, row] = s
            for number in range(slopes.shape[0]):
                slopes[number, point, row] = (
                    by_a * a_slopes[number, of_a, column_a]
                    + by_x * x_slopes[number, of_x, column_x]
                    + by_rho * rho_slopes[number, of_rho, 0]
                    + by_e * e_slopes[number, of_e, column_e]
                )


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


@compiled(f"void({_COLUMNS}, float64[::1], {_AXIS}, int64[::1], float64[:, :, :, ::1], {_COLUMNS}, {_SLOPES})")
def linear_sigma(
    bessel: Floats,
    ends: Floats,
    knots: Floats,
    cubics: Floats,
    contact: NDArray[np.int64],
    transforms: Floats,
    e: Floats,
    result: Floats,
) -> None:
    """Hankel integrals of transforms at offsets, and the first one's derivative by the offset.

    Parameters
    ----------
    bessel
        (functions of e, k) J0(k e) with the weights of the integral.
    ends, knots, cubics
        Of the axis e; beyond its end the integrals are 0.
    contact
        (rows,) the contact of each row.
    transforms
        (quantities, points, contacts, k).
    e
        (points, rows).
    whole
        (quantities + 1, points, rows), to be filled.
    """
    functions, kernel, slope = np.empty(8), np.empty(bessel.shape[1]), np.empty(bessel.shape[1])
    _, points, rows = result.shape
    count, of_points, of_contacts, _ = transforms.shape
    for point in range(points):
        transform_point, of_e = min(point, of_points - 1), min(point, e.shape[0] - 1)
        for row in range(rows):
            at = e[of_e, min(row, e.shape[1] - 1)]
            if at > ends[1]:
                result[:, point, row] = 0.0
                continue
            first = four_functions(at, ends[0], ends[1], knots, cubics, functions)
            for k in range(bessel.shape[1]):
                b0, b1, b2, b3 = bessel[first, k], bessel[first + 1, k], bessel[first + 2, k], bessel[first + 3, k]
                kernel[k] = b0 * functions[0] + b1 * functions[1] + b2 * functions[2] + b3 * functions[3]
                slope[k] = b0 * functions[4] + b1 * functions[5] + b2 * functions[6] + b3 * functions[7]
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


@compiled(f"void(float64[::1], float64[::1], float64[::1], float64[::1], float64, {_AXIS}, {_COLUMNS})")
def disc_averages(
    offsets: Floats,
    radius: Floats,
    weight: Floats,
    cosine: Floats,
    end: float,
    knots: Floats,
    cubics: Floats,
    total: Floats,
) -> None:
    """Averages of a radial profile's basis functions over offset discs, ∫ f(√(e² + s² + 2 e s cos φ)) dA/A.

    Parameters
    ----------
    offsets
        e of each disc.
    radius, weight, cosine
        s of the rings of a disc with the weight of each of their points, and cos φ of these.
    end, knots, cubics
        Of the profile; beyond its end it is 0.
    total
        (discs, functions), to which the averages are added.
    """
    functions = np.empty(8)
    for disc in range(len(offsets)):
        e = offsets[disc]
        for ring in range(len(radius)):
            s = radius[ring]
            for turn in range(len(cosine)):
                distance = np.sqrt(e * e + s * s + 2 * e * s * cosine[turn])
                if distance <= end:
                    first = four_functions(distance, 0.0, end, knots, cubics, functions)
                    for number in range(4):
                        total[disc, first + number] += weight[ring] * functions[number]
