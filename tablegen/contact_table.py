"""The contact table: its axes, the sweep over contact edges, the measured errors, and the file.

A column of the sweep is one material contact edge with spheres up to the largest load (`tablegen.contact_column`). At
each x = L^(1/3) the columns lie close in R/h, and a spline in R/h takes them to the table's nodes. At x = 0 the contact
vanishes, and Hertz' solution and a point force on the linear layer are exact. Every column is solved with elements of
order 5 and of order 4; the table holds the former, their difference is the discretisation error. The interpolation
error is measured as in `tablegen.influence_table`, by leaving nodes out.
"""

import shutil
import sys
from functools import partial
from importlib.metadata import version
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline

from tablegen import (
    base_stress,
    contact,
    contact_column,
    contact_mesh,
    discretisation,
    faces,
    left_out_nodes,
    linear_layer,
    neo_hookean,
    newton,
)
from tablegen.contact_column import solve_contact_column
from tablegen.contact_mesh import RIM
from tablegen.left_out_nodes import left_out_errors
from tablegen.sweep import Arrays, run_pieces, sources_hash
from underskin.physics import hankel_transform, hertz
from underskin.surrogate.hdf5_format import CONTACT_SCHEMA, Dataset, data_hash, write_table
from underskin.units import Floats

ORDER = 5
SOURCES = (
    base_stress,
    contact,
    contact_column,
    contact_mesh,
    discretisation,
    faces,
    left_out_nodes,
    neo_hookean,
    newton,
    hankel_transform,
    hertz,
    linear_layer,
    sys.modules[__name__],
)
_RATIOS = ("contact_radius", "indentation", "stiffness")

DEFAULT_EDGES = np.linspace(np.sqrt(0.009), np.sqrt(2.05), 27) ** 2  # a/h before pressing: R/h 0.5 to 8 at every x
DEFAULT_AXES = (
    0.5 * 2 ** np.linspace(0, 4, 17),
    np.cbrt(0.1) * np.linspace(0, 1, 19),
    3.0 * np.linspace(0, 1, 33),
)


def make_contact_table(
    path: Path,
    axes: tuple[Floats, Floats, Floats] = DEFAULT_AXES,
    edges: Floats = DEFAULT_EDGES,
    scheduler: str | None = None,
) -> str:
    """Solve, measure and write the table at `path`; returns its hash.

    Resumes from what an interrupted run left in `path`.parts. `axes`: R/h, L^(1/3) from 0, rT/h. Raises SolverError
    that names the point when a solve fails; the table is then not written.
    """
    sources = sources_hash(SOURCES)
    parts = path.with_name(path.name + ".parts")
    pieces = {
        f"order{order}-{number:02d}": partial(solve_piece, float(a), axes[2], axes[1][1:], order)
        for order in (ORDER, ORDER - 1)
        for number, a in enumerate(edges)
    }
    name = data_hash({"edges": edges, "radius": axes[0], "x": axes[1], "rho": axes[2]})
    done = run_pieces(pieces, parts / f"{sources[:16]}-{name[:8]}", scheduler, "tablegen contact")
    fine, coarse = (
        _on_the_nodes(axes, [done[f"order{order}-{number:02d}"] for number in range(edges.size)])
        for order in (ORDER, ORDER - 1)
    )
    errors = np.abs(fine - coarse) + sum(left_out_errors((np.log(axes[0]), axes[1]), fine))
    about = {
        "quantity": "contact",
        "poisson_ratio": 0.5,
        "material": "incompressible neo-Hookean layer bonded to a rigid base; rigid frictionless sphere",
        "mesh": f"Q{ORDER}/P{ORDER - 1}, rim at a + {RIM:g} h, graded to the contact's edge",
        "solver": "contact edge prescribed, indentation free; augmented Lagrangian for volume and contact, SuperLU",
        "force_balance_error": max(float(piece["force_error"]) for piece in done.values()),
        "tablegen_sources_sha256": sources,
        **{f"version_{name}": version(name) for name in ("underskin", "scikit-fem", "numpy", "scipy", "h5py")},
    }
    groups = {"contact": _contact_group(axes, fine, errors), "stress": _stress_group(axes, fine, errors)}
    digest = write_table(path, CONTACT_SCHEMA, groups, {"contact": "contact_radius", "stress": "sigma"}, about)
    shutil.rmtree(parts)
    return digest


def solve_piece(a: float, rho: Floats, cbrt_load: Floats, order: int) -> Arrays:
    """`solve_contact_column` as a dictionary of arrays, which can be sent to workers and stored."""
    radius, values, force_error = solve_contact_column(a, rho, cbrt_load, order)
    return {"radius": radius, "values": values, "force_error": np.array(force_error)}


def _on_the_nodes(axes: tuple[Floats, Floats, Floats], columns: list[Arrays]) -> Floats:
    """All quantities of the columns at the table's nodes: (R/h, x, quantities)."""
    radius, cbrt_load, rho = axes
    radii = np.stack([column["radius"] for column in columns])
    values = np.stack([column["values"] for column in columns])
    point = linear_layer.gamma_n(0.0, rho)
    vanishing = np.concatenate([np.ones(len(_RATIOS)), point, point])
    nodes = [np.broadcast_to(vanishing, (radius.size, vanishing.size))]
    for number in range(cbrt_load.size - 1):
        if not (radii[0, number] <= radius[0] and radius[-1] <= radii[-1, number]):
            raise ValueError(f"the contact edges do not reach all of R/h at x = {cbrt_load[number + 1]:g}")
        nodes.append(make_interp_spline(radii[:, number], values[:, number], k=5)(radius))
    return np.stack(nodes, axis=1)


def _contact_group(axes: tuple[Floats, Floats, Floats], values: Floats, errors: Floats) -> dict[str, Dataset]:
    meanings = (
        "contact radius over a = (9 F R/(16 E))^(1/3), Hertz at the same force",
        "indentation over a^2/R, Hertz at the same force",
        "dF/d(indentation) over 2 a E/(1 - nu^2), Hertz at the same force",
    )
    along = ("indenter_radius_over_h", "cbrt_load_parameter")
    group = dict(_shared(axes))
    for number, (name, meaning) in enumerate(zip(_RATIOS, meanings, strict=True)):
        group[name] = Dataset(values[..., number], meaning, along)
        relative = errors[..., number] / values[..., number]
        group[f"{name}_error"] = Dataset(relative, f"relative error of {name}", along)
    return group


def _stress_group(axes: tuple[Floats, Floats, Floats], values: Floats, errors: Floats) -> dict[str, Dataset]:
    rho, count = axes[2], len(_RATIOS)
    along = ("indenter_radius_over_h", "cbrt_load_parameter", "rt_over_h")
    group = dict(_shared(axes))
    group["rt_over_h"] = Dataset(rho, "sensor radius over thickness, rT/h")
    for name, part, meaning in (
        (
            "sigma",
            slice(count, count + rho.size),
            "transmission factor: mean stress on the sensor = 3 F sigma/(2 pi h^2)",
        ),
        ("sigma_increment", slice(count + rho.size, None), "d(F sigma)/dF at fixed R: the edge moves with the force"),
    ):
        group[name] = Dataset(values[..., part], meaning, along)
        group[f"{name}_error"] = Dataset(errors[..., part], f"absolute error of {name}", along)
    return group


def _shared(axes: tuple[Floats, Floats, Floats]) -> dict[str, Dataset]:
    return {
        "indenter_radius_over_h": Dataset(axes[0], "radius of the sphere over thickness, R/h"),
        "cbrt_load_parameter": Dataset(axes[1], "cube root of L = F/(R^2 E)"),
    }
