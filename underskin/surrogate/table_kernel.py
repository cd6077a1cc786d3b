"""Compiled: σ of the table and the bound on its error at many rows."""

import numpy as np

from underskin.compiled import compiled
from underskin.units import Floats

_AXIS = "float64[::1], float64[::1], float64[:, :, ::1]"


@compiled()
def _cell(nodes: Floats, value: float) -> int:
    """Between which two nodes a value inside them lies: at a node above it, at the last one below it."""
    low, count = 0, len(nodes) - 1
    while count > 1:
        half = count // 2
        low = low + half if value >= nodes[low + half] else low
        count -= half
    return low


@compiled()
def _of_spline(cell: int, cells: int) -> int:
    """The spline's cell of a table's: next to the ends one spans two of them (not-a-knot)."""
    return min(max(cell - 1, 0), cells - 1)


@compiled()
def _basis(cubics: Floats, u: float, values: Floats) -> None:
    """The four functions of a cell (4, powers), highest power first, at u above its lower knot."""
    for number in range(4):
        values[number] = ((cubics[number, 0] * u + cubics[number, 1]) * u + cubics[number, 2]) * u + cubics[number, 3]


@compiled(
    f"void(float64[:, :, ::1], float64[:, :, ::1], {_AXIS}, {_AXIS}, {_AXIS}, float64[::1], float64[::1], "
    "float64[::1], float64[::1], float64[::1])"
)
def sigma_rows(
    coefficients: Floats,
    cell_error: Floats,
    nodes_a: Floats,
    knots_a: Floats,
    cubics_a: Floats,
    nodes_rho: Floats,
    knots_rho: Floats,
    cubics_rho: Floats,
    nodes_x: Floats,
    knots_x: Floats,
    cubics_x: Floats,
    a: Floats,
    rho: Floats,
    x: Floats,
    sigma: Floats,
    rel_error: Floats,
) -> None:
    """Fill σ and the bound on its relative error (rows,), NaN outside the nodes.

    `nodes` are the table's, `knots` those of the spline's cells, `cubics` (cells, functions, powers) their functions.
    """
    in_a, in_rho, in_x = np.empty(4), np.empty(4), np.empty(4)
    for row in range(len(sigma)):
        inside = (
            nodes_a[0] <= a[row] <= nodes_a[-1]
            and nodes_rho[0] <= rho[row] <= nodes_rho[-1]
            and nodes_x[0] <= x[row] <= nodes_x[-1]
        )
        if not inside:
            sigma[row] = rel_error[row] = np.nan
            continue
        of_a, of_rho, of_x = _cell(nodes_a, a[row]), _cell(nodes_rho, rho[row]), _cell(nodes_x, x[row])
        i, j, k = _of_spline(of_a, len(cubics_a)), _of_spline(of_rho, len(cubics_rho)), _of_spline(of_x, len(cubics_x))
        _basis(cubics_a[i], a[row] - knots_a[i], in_a)
        _basis(cubics_rho[j], rho[row] - knots_rho[j], in_rho)
        _basis(cubics_x[k], x[row] - knots_x[k], in_x)
        total = 0.0
        for along_a in range(4):
            part = 0.0
            for along_rho in range(4):
                c = coefficients[i + along_a, j + along_rho, k : k + 4]
                part += in_rho[along_rho] * (c[0] * in_x[0] + c[1] * in_x[1] + c[2] * in_x[2] + c[3] * in_x[3])
            total += in_a[along_a] * part
        sigma[row] = total
        rel_error[row] = cell_error[of_a, of_rho, of_x]
