"""Compiled: tensor products of cubic splines with their slopes.

A spline of four axes, s(p, q, r, t) = Σ c_ijkl P_i(p) Q_j(q) R_k(r) T_l(t), has four functions that differ from 0 along
each axis at a point. Seven arrays (`sigma_table.joined`) describe its axes, in which the cells of an axis come after
those of the axis before:

- `starts` (cells,) the lower end of each cell between nodes, and infinity behind the last one of an axis;
- `lower` (cells,) the lower end of the spline's cell that holds it: next to the ends that one spans two (not-a-knot);
- `first` (cells,) the index of the first of its four functions;
- `cubics` (cells, powers, functions) these in the distance from `lower`, lowest power first;
- `limits` (axes, 3) the lowest and the highest node, and the number of equal parts of the axis in a unit;
- `buckets` for each part the last cell that starts in an earlier part, or the first; at most one cell starts in a part;
- `begin` (axes, 2) where the cells and the buckets of each axis begin.
"""

import numpy as np
from numpy.typing import NDArray

from underskin.compiled import compiled
from underskin.units import Floats

Integers = NDArray[np.int64]
Four = tuple[float, float, float, float]
Axes = tuple[Floats, Floats, Integers, Floats, Floats, Integers, Integers]

AXES = "Tuple((float64[::1], float64[::1], int64[::1], float64[:, :, ::1], float64[:, ::1], int64[::1], int64[:, ::1]))"
_SPLINE = f"float64[:, :, :, ::1], {AXES}"
_VARIABLE = "float64[:, ::1], float64[:, :, ::1]"
_ROWS = "float64[::1]"


@compiled()
def cell_at(starts: Floats, limits: Floats, buckets: Integers, begin: Integers, axis: int, at: float) -> int:
    """The cell of a value between the nodes: at a node the one above it, at the last node the last."""
    part = (at - limits[axis, 0]) * limits[axis, 2]
    cell = buckets[begin[axis, 1] + (int(part) if part > 0 else 0)]
    return cell + (1 if at >= starts[cell + 1] else 0)


@compiled()
def values_at(cubics: Floats, u: float) -> Four:
    """The values of a cell's functions (powers, functions) at the distance u from its lower end."""
    return (
        cubics[0, 0] + u * (cubics[1, 0] + u * (cubics[2, 0] + u * cubics[3, 0])),
        cubics[0, 1] + u * (cubics[1, 1] + u * (cubics[2, 1] + u * cubics[3, 1])),
        cubics[0, 2] + u * (cubics[1, 2] + u * (cubics[2, 2] + u * cubics[3, 2])),
        cubics[0, 3] + u * (cubics[1, 3] + u * (cubics[2, 3] + u * cubics[3, 3])),
    )


@compiled()
def functions_at(cubics: Floats, u: float, beyond: float) -> tuple[Four, Four]:
    """Values and slopes of a cell's functions; `beyond` the nodes they are continued along their tangents."""
    v0, v1, v2, v3 = values_at(cubics, u)
    d0 = cubics[1, 0] + u * (2 * cubics[2, 0] + u * 3 * cubics[3, 0])
    d1 = cubics[1, 1] + u * (2 * cubics[2, 1] + u * 3 * cubics[3, 1])
    d2 = cubics[1, 2] + u * (2 * cubics[2, 2] + u * 3 * cubics[3, 2])
    d3 = cubics[1, 3] + u * (2 * cubics[2, 3] + u * 3 * cubics[3, 3])
    return (v0 + d0 * beyond, v1 + d1 * beyond, v2 + d2 * beyond, v3 + d3 * beyond), (d0, d1, d2, d3)


@compiled(f"void({_SPLINE}, float64, int64[::1], {', '.join([_VARIABLE] * 5)})")
def spline_rows(
    coefficients: Floats,
    axes: Axes,
    end: float,
    chosen: Integers,
    p: Floats,
    p_slopes: Floats,
    q: Floats,
    q_slopes: Floats,
    r: Floats,
    r_slopes: Floats,
    t: Floats,
    t_slopes: Floats,
    value: Floats,
    slopes: Floats,
) -> None:
    """A spline at many points, and its derivatives by what its variables depend on.

    Parameters
    ----------
    coefficients
        (functions of each axis); the first axis may have a single function, which is a constant.
    end
        Of the last variable, beyond which the spline is 0. Beyond the other nodes it is continued along its tangent.
    chosen
        (rows,) the entry of p and q of each row.
    p, q, r, t
        The variables, (points, rows), with their derivatives (parameters, points, rows); either of points and rows may
        be 1 and is then broadcast.
    value, slopes
        To be filled, of the same kind.
    """
    starts, lower, first, cubics, limits, buckets, begin = axes
    functions = min(4, len(coefficients))
    points, rows = value.shape
    for point in range(points):
        of_p, of_q = min(point, p.shape[0] - 1), min(point, q.shape[0] - 1)
        of_r, of_t = min(point, r.shape[0] - 1), min(point, t.shape[0] - 1)
        for row in range(rows):
            row_p, row_q = min(chosen[row], p.shape[1] - 1), min(chosen[row], q.shape[1] - 1)
            row_r, row_t = min(row, r.shape[1] - 1), min(row, t.shape[1] - 1)
            at_p, at_q, at_r, at_t = p[of_p, row_p], q[of_q, row_q], r[of_r, row_r], t[of_t, row_t]
            if at_t > end:
                value[point, row] = 0.0
                slopes[:, point, row] = 0.0
                continue
            inside_p = min(max(at_p, limits[0, 0]), limits[0, 1])
            inside_q = min(max(at_q, limits[1, 0]), limits[1, 1])
            inside_r = min(max(at_r, limits[2, 0]), limits[2, 1])
            inside_t = min(max(at_t, limits[3, 0]), limits[3, 1])
            cell_p = cell_at(starts, limits, buckets, begin, 0, inside_p)
            cell_q = cell_at(starts, limits, buckets, begin, 1, inside_q)
            cell_r = cell_at(starts, limits, buckets, begin, 2, inside_r)
            cell_t = cell_at(starts, limits, buckets, begin, 3, inside_t)
            p_value, p_slope = functions_at(cubics[cell_p], inside_p - lower[cell_p], at_p - inside_p)
            q_value, q_slope = functions_at(cubics[cell_q], inside_q - lower[cell_q], at_q - inside_q)
            r_value, r_slope = functions_at(cubics[cell_r], inside_r - lower[cell_r], at_r - inside_r)
            t_value, t_slope = functions_at(cubics[cell_t], inside_t - lower[cell_t], at_t - inside_t)
            first_p, first_q, first_r, first_t = first[cell_p], first[cell_q], first[cell_r], first[cell_t]
            total = by_p = by_q = by_r = by_t = 0.0
            for i in range(functions):
                s_q = slope_q = r_q = t_q = 0.0
                for j in range(4):
                    s_r = slope_r = t_r = 0.0
                    for k in range(4):
                        c = coefficients[first_p + i, first_q + j, first_r + k, first_t : first_t + 4]
                        along = c[0] * t_value[0] + c[1] * t_value[1] + c[2] * t_value[2] + c[3] * t_value[3]
                        slope = c[0] * t_slope[0] + c[1] * t_slope[1] + c[2] * t_slope[2] + c[3] * t_slope[3]
                        s_r += r_value[k] * along
                        slope_r += r_slope[k] * along
                        t_r += r_value[k] * slope
                    s_q += q_value[j] * s_r
                    slope_q += q_slope[j] * s_r
                    r_q += q_value[j] * slope_r
                    t_q += q_value[j] * t_r
                total += p_value[i] * s_q
                by_p += p_slope[i] * s_q
                by_q += p_value[i] * slope_q
                by_r += p_value[i] * r_q
                by_t += p_value[i] * t_q
            value[point, row] = total
            for number in range(len(slopes)):
                slopes[number, point, row] = (
                    by_p * p_slopes[number, of_p, row_p]
                    + by_q * q_slopes[number, of_q, row_q]
                    + by_r * r_slopes[number, of_r, row_r]
                    + by_t * t_slopes[number, of_t, row_t]
                )


@compiled(f"void({_SPLINE}, float64[:, :, ::1], {', '.join([_ROWS] * 5)})")
def sigma_rows(
    coefficients: Floats,
    axes: Axes,
    cell_error: Floats,
    a: Floats,
    rho: Floats,
    x: Floats,
    sigma: Floats,
    rel_error: Floats,
) -> None:
    """σ of a table by its spline, whose first axis is a constant, without slopes; NaN outside the nodes.

    Parameters
    ----------
    cell_error
        (cells of each axis) bound on the relative error.
    a, rho, x
        a/h, rT/h and L^(1/3) (rows,); an input of one row holds for all.
    sigma, rel_error
        (rows,), to be filled.
    """
    starts, lower, first, cubics, limits, buckets, begin = axes
    step_a, step_rho, step_x = min(len(a) - 1, 1), min(len(rho) - 1, 1), min(len(x) - 1, 1)
    for row in range(len(sigma)):
        at_a, at_rho, at_x = a[row * step_a], rho[row * step_rho], x[row * step_x]
        inside = limits[1, 0] <= at_a <= limits[1, 1] and limits[2, 0] <= at_rho <= limits[2, 1]
        if not (inside and limits[3, 0] <= at_x <= limits[3, 1]):
            sigma[row] = rel_error[row] = np.nan
            continue
        i = cell_at(starts, limits, buckets, begin, 1, at_a)
        j = cell_at(starts, limits, buckets, begin, 2, at_rho)
        k = cell_at(starts, limits, buckets, begin, 3, at_x)
        rel_error[row] = cell_error[i - begin[1, 0], j - begin[2, 0], k - begin[3, 0]]
        in_a, in_rho = values_at(cubics[i], at_a - lower[i]), values_at(cubics[j], at_rho - lower[j])
        in_x = values_at(cubics[k], at_x - lower[k])
        total = 0.0
        for m in range(4):
            of_rho = 0.0
            for n in range(4):
                c = coefficients[0, first[i] + m, first[j] + n, first[k] : first[k] + 4]
                of_rho += in_rho[n] * (c[0] * in_x[0] + c[1] * in_x[1] + c[2] * in_x[2] + c[3] * in_x[3])
            total += in_a[m] * of_rho
        sigma[row] = total


@compiled(f"void({AXES}, {', '.join([_ROWS] * 4)}, float64[:, ::1])")
def disc_averages(
    axes: Axes,
    offsets: Floats,
    radius: Floats,
    weight: Floats,
    cosine: Floats,
    total: Floats,
) -> None:
    """Averages of the functions of the one axis, a radius, over offset discs, ∫ f(√(e² + s² + 2 e s cos φ)) dA/A.

    Parameters
    ----------
    offsets
        e of each disc.
    radius, weight, cosine
        s of the rings of a disc with the weight of each of their points, and cos φ of these; beyond the last node the
        functions are 0.
    total
        (discs, functions), to which the averages are added.
    """
    starts, lower, first, cubics, limits, buckets, begin = axes
    for disc in range(len(offsets)):
        e = offsets[disc]
        for ring in range(len(radius)):
            s = radius[ring]
            for turn in range(len(cosine)):
                distance = np.sqrt(e * e + s * s + 2 * e * s * cosine[turn])
                if distance <= limits[0, 1]:
                    cell = cell_at(starts, limits, buckets, begin, 0, distance)
                    values = values_at(cubics[cell], distance - lower[cell])
                    for number in range(4):
                        total[disc, first[cell] + number] += weight[ring] * values[number]
