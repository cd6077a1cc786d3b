"""The σ table: its axes, the sweep over contact radii, the measured errors, and the file.

For every contact radius the layer is solved twice, with elements of order 5 and of order 4 on the same mesh; the table
holds the former, and their difference is its discretisation error (order 5 is in fact closer than that). The
interpolation error is measured by leaving out every other node of all axes and comparing the spline through the rest
with the values left out. The table's own spline, with half the spacing, is better than that by about 2⁴; the bound
claims half of that factor.
"""

import shutil
import sys
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import maximum_filter

from tablegen import base_stress, discretisation, faces, linear_layer, mesh, neo_hookean, newton
from tablegen import sigma as sigma_solve
from tablegen.base_stress import PROFILE_END
from tablegen.mesh import RIM, layer_mesh
from tablegen.sigma import Column, Nodes, solve_column
from tablegen.sweep import Arrays, run_pieces, sources_hash
from underskin.physics import hankel_transform, hertz
from underskin.surrogate.hdf5_format import SIGMA_SCHEMA, Dataset, data_hash, write_table
from underskin.surrogate.sigma_table import TensorSpline
from underskin.units import Floats

ORDER = 5
SOURCES = (
    mesh,
    neo_hookean,
    discretisation,
    newton,
    faces,
    base_stress,
    sigma_solve,
    hankel_transform,
    hertz,
    linear_layer,
    sys.modules[__name__],
)
_SPLINE_GAIN = 8.0

DEFAULT_NODES = Nodes(
    a=3.0 * np.linspace(0, 1, 65) ** 1.25,
    rho=3.0 * np.linspace(0, 1, 65) ** 1.25,
    cbrt_load=np.cbrt(0.1) * np.linspace(0, 1, 13),
    r=np.concatenate([np.linspace(0, 4, 65), np.linspace(4, PROFILE_END, 33)[1:]]),
)


def make_sigma_table(path: Path, nodes: Nodes = DEFAULT_NODES, scheduler: str | None = None) -> str:
    """Solve, measure and write the table at `path`; returns its hash.

    Resumes from what an interrupted run left in `path`.parts. Raises SolverError that names the point when a solve
    fails; the table is then not written.
    """
    sources = sources_hash(SOURCES)
    parts = path.with_name(path.name + ".parts")
    pieces = {
        f"order{order}-{number:03d}": partial(solve_piece, float(a), nodes, order)
        for order in (ORDER, ORDER - 1)
        for number, a in enumerate(nodes.a)
        if a > 0
    }
    done = run_pieces(pieces, parts / f"{sources[:16]}-{nodes_hash(nodes)[:8]}", scheduler, "tablegen sigma")
    columns = {
        order: [_column(done, order, number, nodes) for number in range(nodes.a.size)] for order in (ORDER, ORDER - 1)
    }
    digest = _write(path, nodes, columns[ORDER], columns[ORDER - 1], sources)
    shutil.rmtree(parts)
    return digest


def solve_piece(a: float, nodes: Nodes, order: int) -> Arrays:
    """`solve_column` as a dictionary of arrays, which can be sent to workers and stored."""
    column = solve_column(a, nodes, order)
    return {name: np.asarray(getattr(column, name)) for name in Column.__dataclass_fields__}


def nodes_hash(nodes: Nodes) -> str:
    """Names the axes, so that pieces of other axes are not taken for ours."""
    return data_hash({"a": nodes.a, "rho": nodes.rho, "x": nodes.cbrt_load, "r": nodes.r})


def _column(done: dict[str, Arrays], order: int, number: int, nodes: Nodes) -> Column:
    """A finished column; at a = 0, at fixed L, the force F = L R² E vanishes with R: the linear limit, exactly."""
    if nodes.a[number] == 0:
        zero = np.zeros((nodes.rho.size, nodes.cbrt_load.size))
        return Column(zero, np.zeros((nodes.r.size, nodes.cbrt_load.size)), np.zeros(nodes.rho.size), 0.0)
    piece = done[f"order{order}-{number:03d}"]
    return Column(piece["sigma_change"], piece["profile_change"], piece["linear_error"], float(piece["force_error"]))


def _write(path: Path, nodes: Nodes, fine: list[Column], coarse: list[Column], sources: str) -> str:
    linear = linear_layer.sigma(nodes.a[:, None], nodes.rho)
    sigma = linear[..., None] + np.stack([column.sigma_change for column in fine])
    sigma_coarse = linear[..., None] + np.stack([column.sigma_change for column in coarse])
    profile_linear = linear_layer.sigma(nodes.a[:, None], 0.0, nodes.r)
    profile = profile_linear[..., None] + np.stack([column.profile_change for column in fine])
    axes = ("a_over_h", "rt_over_h", "cbrt_load_parameter")
    grid = (nodes.a, nodes.rho, nodes.cbrt_load)
    shared = {
        "a_over_h": Dataset(nodes.a, "contact radius over thickness, a/h"),
        "cbrt_load_parameter": Dataset(nodes.cbrt_load, "cube root of L = F/(R^2 E)"),
    }
    groups = {
        "sigma": {
            **shared,
            "rt_over_h": Dataset(nodes.rho, "sensor radius over thickness, rT/h"),
            "sigma": Dataset(sigma, "transmission factor sigma: charge = d33 (3/2) (rT/h)^2 sigma F", axes),
            "discretisation_error": Dataset(
                np.abs(sigma_coarse / sigma - 1), "relative difference of element orders 5 and 4", axes
            ),
            "interpolation_error": Dataset(interpolation_error(grid, sigma), "relative, of the cubic spline", axes),
            "fem_linear_error": Dataset(
                np.stack([column.linear_error for column in fine]) / linear,
                "relative error of the finite-element sigma at L = 0 against the exact linear layer",
                axes[:2],
            ),
        },
        "profile": {
            **shared,
            "r_over_h": Dataset(nodes.r, "distance from the contact's axis over thickness, r/h"),
            "profile": Dataset(
                profile,
                "stress on the base in sigma's scale: -T3 2 pi h^2/(3 F)",
                (axes[0], "r_over_h", axes[2]),
            ),
        },
    }
    return write_table(
        path, SIGMA_SCHEMA, groups, {"sigma": "sigma", "profile": "profile"}, _about(nodes, fine, sources)
    )


def interpolation_error(axes: tuple[Floats, ...], values: Floats) -> Floats:
    """The relative error of the cubic spline through `values`, from the spline through every other node."""
    coarse = tuple(axis[::2] for axis in axes)
    points = np.meshgrid(*axes, indexing="ij", sparse=True)
    left_out = np.abs(TensorSpline.through(coarse, values[::2, ::2, ::2]).values(*points) / values - 1)
    return np.asarray(maximum_filter(left_out, size=3) / _SPLINE_GAIN)


def _about(nodes: Nodes, columns: list[Column], sources: str) -> dict[str, Any]:
    elements = [layer_mesh(float(a)).nelements for a in nodes.a if a > 0]
    return {
        "quantity": "sigma",
        "poisson_ratio": 0.5,
        "material": "incompressible neo-Hookean layer bonded to a rigid base; Hertz pressure as a dead load",
        "mesh": f"Q{ORDER}/P{ORDER - 1}, {min(elements)} to {max(elements)} quadrilaterals, rim at a + {RIM:g} h",
        "solver": "Newton, augmented Lagrangian, pressures eliminated per element, SuperLU",
        "force_balance_error": max(column.force_error for column in columns),
        "tablegen_sources_sha256": sources,
        **{f"version_{name}": version(name) for name in ("underskin", "scikit-fem", "numpy", "scipy", "h5py")},
    }
