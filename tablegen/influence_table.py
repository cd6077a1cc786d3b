"""The influence table: its axes, the sweep over Poisson's ratio and glue line, the measured errors, and the file.

Every pair of Poisson's ratio and slip is solved twice, with elements of order 6 and of order 5 on the same mesh; the
table holds the former, and their difference is its discretisation error. The interpolation error is measured axis by
axis: each inner node is left out in turn, and the spline through the others is compared with the value left out. Near
a node left out the distances of the degree-5 spline are twice as long: the table's own error is a tenth of that or
less (measured against the exact layer in `tests/surrogate/test_influence.py`); a quarter is claimed.
"""

import shutil
import sys
from functools import partial
from importlib.metadata import version
from pathlib import Path

import numpy as np

from tablegen import discretisation, faces, influence, left_out_nodes, newton
from tablegen.influence import RIM, influence_mesh, solve_influence
from tablegen.left_out_nodes import left_out_errors
from tablegen.sweep import Arrays, run_pieces, sources_hash
from underskin.surrogate.hdf5_format import INFLUENCE_SCHEMA, Dataset, data_hash, write_table
from underskin.units import Floats

ORDER = 6
SOURCES = (discretisation, newton, faces, influence, left_out_nodes, sys.modules[__name__])
_AXES = ("poisson_ratio", "slip", "rt_over_h", "r_over_h")

DEFAULT_AXES = (
    np.linspace(0.3, 0.5, 7),
    (1 - np.cos(np.pi * np.linspace(0, 1, 15))) / 2,
    3.0 * np.linspace(0, 1, 33),
    12.0 * np.linspace(0, 1, 65) ** 1.5,
)


def make_influence_table(
    path: Path, axes: tuple[Floats, ...] = DEFAULT_AXES, scheduler: str | None = None, order: int = ORDER
) -> str:
    """Solve, measure and write the table at `path`; returns its hash.

    Resumes from what an interrupted run left in `path`.parts. `axes`: Poisson's ratio, slip, rT/h and r/h.
    """
    sources = sources_hash(SOURCES)
    parts = path.with_name(path.name + ".parts")
    pieces = {
        f"order{k}-{i:02d}-{j:02d}": partial(solve_piece, float(poisson_ratio), float(slip), axes[2], axes[3], k)
        for k in (order, order - 1)
        for i, poisson_ratio in enumerate(axes[0])
        for j, slip in enumerate(axes[1])
    }
    name = data_hash(dict(zip(_AXES, axes, strict=True)))
    done = run_pieces(pieces, parts / f"{sources[:16]}-{name[:8]}", scheduler, "tablegen influence")
    fine, coarse = (_stacked(done, k, axes) for k in (order, order - 1))
    errors = np.abs(fine - coarse).max(axis=-1) + sum(
        part.max(axis=-1) for part in left_out_errors(axes, fine, first=1)
    )
    digest = write_table(
        path,
        INFLUENCE_SCHEMA,
        {"influence": _datasets(axes, fine, errors)},
        {"influence": "gamma_n"},
        {
            "quantity": "influence",
            "material": "linear elastic layer on a rigid base, held by a glue line that yields in shear",
            "mesh": f"Q{order}/P{order - 1}, {influence_mesh().nelements} quadrilaterals, rim at {RIM:g} h",
            "solver": "reciprocity: lift projected on the traces; pressures eliminated per element, SuperLU",
            "tablegen_sources_sha256": sources,
            **{f"version_{name}": version(name) for name in ("underskin", "scikit-fem", "numpy", "scipy", "h5py")},
        },
    )
    shutil.rmtree(parts)
    return digest


def solve_piece(poisson_ratio: float, slip: float, rho: Floats, r: Floats, order: int) -> Arrays:
    """`solve_influence` as a dictionary of arrays, which can be sent to workers and stored."""
    solved = solve_influence(poisson_ratio, slip, rho, r, order)
    return {"normal": solved.normal, "tangential": solved.tangential}


def _stacked(done: dict[str, Arrays], order: int, axes: tuple[Floats, ...]) -> Floats:
    """γ_n and γ_t of one order, (2, *axes)."""
    shape = tuple(nodes.size for nodes in axes)
    pairs = [(i, j) for i in range(shape[0]) for j in range(shape[1])]
    return np.stack(
        [
            np.stack([done[f"order{order}-{i:02d}-{j:02d}"][kind] for i, j in pairs]).reshape(shape)
            for kind in ("normal", "tangential")
        ]
    )


def _datasets(axes: tuple[Floats, ...], values: Floats, errors: Floats) -> dict[str, Dataset]:
    meanings = (
        "Poisson's ratio",
        "slip of the glue line, 1/(1 + kappa), tau = kappa (G/h) u_r: 0 bonded, 1 frictionless",
        "sensor radius over thickness, rT/h",
        "distance of the load from the sensor's centre over thickness, r/h",
    )
    law = "mean stress on the sensor = -(3/2 pi h^2) (F3 gamma_n - F_outward gamma_t)"
    error = "absolute error, the largest over r: of orders {0} and {1}, and of the degree-5 spline"
    return {
        **{name: Dataset(nodes, text) for name, nodes, text in zip(_AXES, axes, meanings, strict=True)},
        "gamma_n": Dataset(values[0], f"normal influence: {law}", _AXES),
        "gamma_t": Dataset(values[1], f"tangential influence: {law}", _AXES),
        "gamma_n_error": Dataset(errors[0], error.format(ORDER, ORDER - 1), _AXES[:3]),
        "gamma_t_error": Dataset(errors[1], error.format(ORDER, ORDER - 1), _AXES[:3]),
    }
