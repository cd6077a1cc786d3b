"""Compiled: σ of the table and the bound on its error at many rows."""

import numpy as np
from numpy.typing import NDArray

from underskin.compiled import compiled
from underskin.units import Floats

_Four = tuple[float, float, float, float]
_AXIS = "float64[::1], int64[::1], float64[::1]"


@compiled()
def _cell(starts: Floats, buckets: NDArray[np.int64], scale: float, value: float) -> int:
    """The cell of a value inside the nodes: at a node the one above it, at the last node the last.

    `starts`: the lower nodes of the cells, then infinity. `buckets`: for each of equal parts of the axis the last cell
    that starts in an earlier part, or 0; at most one cell starts in a part. The part of a value is `scale` times its
    distance from the first node.
    """
    cell = buckets[int((value - starts[0]) * scale)]
    return cell + (1 if value >= starts[cell + 1] else 0)


@compiled()
def _of_spline(cell: int, cells: int) -> int:
    """The spline's cell of a table's: next to the ends one spans two of them (not-a-knot)."""
    return min(max(cell - 1, 0), cells - 1)


@compiled()
def _basis(c: Floats, u: float) -> _Four:
    """The four functions of a cell (powers, functions), highest power first, at u above its lower knot."""
    return (
        ((c[0, 0] * u + c[1, 0]) * u + c[2, 0]) * u + c[3, 0],
        ((c[0, 1] * u + c[1, 1]) * u + c[2, 1]) * u + c[3, 1],
        ((c[0, 2] * u + c[1, 2]) * u + c[2, 2]) * u + c[3, 2],
        ((c[0, 3] * u + c[1, 3]) * u + c[2, 3]) * u + c[3, 3],
    )


@compiled()
def _sum(weights: _Four, p: Floats | _Four, q: Floats | _Four, r: Floats | _Four, s: Floats | _Four) -> _Four:
    """The weighted sum of four cubics, power by power."""
    a, b, c, d = weights
    return (
        a * p[0] + b * q[0] + c * r[0] + d * s[0],
        a * p[1] + b * q[1] + c * r[1] + d * s[1],
        a * p[2] + b * q[2] + c * r[2] + d * s[2],
        a * p[3] + b * q[3] + c * r[3] + d * s[3],
    )


@compiled()
def _along_rho(weights: _Four, cubics: Floats, j: int) -> _Four:
    """The weighted sum of the cubics (functions of rho, powers) that begin at the function j."""
    return _sum(weights, cubics[j], cubics[j + 1], cubics[j + 2], cubics[j + 3])


@compiled(
    f"void(float64[:, :, :, ::1], float64[:, :, ::1], float64[:, ::1], {_AXIS}, float64[:, :, ::1], "
    f"{_AXIS}, float64[:, :, ::1], {_AXIS}, float64[::1], float64[::1], float64[::1], float64[::1], float64[::1])"
)
def sigma_rows(
    cubics: Floats,
    cell_error: Floats,
    ends: Floats,
    starts_a: Floats,
    buckets_a: NDArray[np.int64],
    knots_a: Floats,
    basis_a: Floats,
    starts_rho: Floats,
    buckets_rho: NDArray[np.int64],
    knots_rho: Floats,
    basis_rho: Floats,
    starts_x: Floats,
    buckets_x: NDArray[np.int64],
    knots_x: Floats,
    a: Floats,
    rho: Floats,
    x: Floats,
    sigma: Floats,
    rel_error: Floats,
) -> None:
    """Fill σ and the bound on its relative error (rows,), NaN outside the nodes; an input of one row holds for all.

    `cubics` (functions of a, cells of x, functions of rho, powers) are the spline's in x; `ends` (axes, 3) the first
    and the last node and the scale of the buckets. For each axis `starts` and `buckets` are as in `_cell`, `knots` the
    lower knots of the spline's cells, and `basis` (cells, powers, functions) their functions.
    """
    step_a, step_rho, step_x = min(len(a) - 1, 1), min(len(rho) - 1, 1), min(len(x) - 1, 1)
    for row in range(len(sigma)):
        at_a, at_rho, at_x = a[row * step_a], rho[row * step_rho], x[row * step_x]
        inside = (
            ends[0, 0] <= at_a <= ends[0, 1] and ends[1, 0] <= at_rho <= ends[1, 1] and ends[2, 0] <= at_x <= ends[2, 1]
        )
        if not inside:
            sigma[row] = rel_error[row] = np.nan
            continue
        of_a = _cell(starts_a, buckets_a, ends[0, 2], at_a)
        of_rho = _cell(starts_rho, buckets_rho, ends[1, 2], at_rho)
        of_x = _cell(starts_x, buckets_x, ends[2, 2], at_x)
        rel_error[row] = cell_error[of_a, of_rho, of_x]
        i, j, k = _of_spline(of_a, len(basis_a)), _of_spline(of_rho, len(basis_rho)), _of_spline(of_x, cubics.shape[1])
        in_a, in_rho = _basis(basis_a[i], at_a - knots_a[i]), _basis(basis_rho[j], at_rho - knots_rho[j])
        c3, c2, c1, c0 = _sum(
            in_a,
            _along_rho(in_rho, cubics[i, k], j),
            _along_rho(in_rho, cubics[i + 1, k], j),
            _along_rho(in_rho, cubics[i + 2, k], j),
            _along_rho(in_rho, cubics[i + 3, k], j),
        )
        u = at_x - knots_x[k]
        sigma[row] = ((c3 * u + c2) * u + c1) * u + c0
