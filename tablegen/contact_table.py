"""The contact table: its axes, the sweep over materials and contact edges, the measured errors, and the file.

The layer is neo-Hookean and incompressible, or of Yeoh's law with a second term c₂ over the first one
(`SECOND_OVER_FIRST`), or compressible (`POISSON_RATIOS`); the sphere is frictionless, or sticks (`FRICTIONS`). A column
of the sweep is one material contact edge with spheres up to the largest load (`tablegen.contact_column`). At each x =
L^(1/3) a spline over the columns in α, a/h of the linear contact, leads to the table's nodes. At x = 0 the layer is
linear, and at α = 0 the base bears a point force's stress at any strain (Saint-Venant): the correction is 0. Every
column is solved with elements of order 5 and of order 4; the table holds the former, their difference is the
discretisation error. The interpolation error is measured as in `tablegen.influence_table`, by leaving nodes out.
"""

import shutil
import sys
from collections.abc import Sequence
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
    linear_contact,
    linear_layer,
    neo_hookean,
    newton,
    sticking,
)
from tablegen.contact_column import RADII, solve_contact_column
from tablegen.contact_mesh import RIM
from tablegen.left_out_nodes import left_out_errors
from tablegen.neo_hookean import NEO_HOOKEAN, Material
from tablegen.sticking import Touched
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
    sticking,
    hankel_transform,
    hertz,
    linear_contact,
    linear_layer,
    sys.modules[__name__],
)
_RATIOS = ("contact_radius", "indentation", "stiffness")

SECOND_OVER_FIRST = np.array([0.0, 1.0, 3.0, 7.0])  # evenly in ln(1 + c₂), over which the effect bends little
POISSON_RATIOS = np.array([0.3, 0.37, 0.44, 0.5])
FRICTIONS = np.array([0.0, 1.0])
STICKING_EDGES, STICKING_ORDER = 2.8 * np.linspace(0.08, 1, 11) ** 1.5, 4  # for the small difference from frictionless
# a/h before pressing; at 2.637 h elements of order 4 do not converge at the largest load
DEFAULT_EDGES = np.delete(3.05 * np.linspace(0.03, 1, 22) ** 1.5, 19)
DEFAULT_AXES = 3.0 * np.linspace(0, 1, 33) ** 1.5, np.cbrt(0.15) * np.linspace(0, 1, 13)


def make_contact_table(
    path: Path,
    axes: tuple[Floats, Floats] = DEFAULT_AXES,
    edges: Floats = DEFAULT_EDGES,
    scheduler: str | None = None,
) -> str:
    """Solve, measure and write the table at `path`; returns its hash.

    Resumes from what an interrupted run left in `path`.parts. `axes`: a/h and L^(1/3), both from 0. Raises SolverError
    that names the point when a solve fails; the table is then not written.
    """
    sources = sources_hash(SOURCES)
    parts = path.with_name(path.name + ".parts")
    yeoh = [Material(second_over_first=c2) for c2 in SECOND_OVER_FIRST.tolist()]
    compressible = [Material(poisson_ratio=nu) for nu in POISSON_RATIOS.tolist()]
    pieces = {
        _piece(material, order, number): partial(solve_piece, float(a), axes[1], order, material)
        for material in dict.fromkeys([*yeoh, *compressible])
        for order in (ORDER, ORDER - 1)
        for number, a in enumerate(edges)
    }
    name = data_hash({"edges": edges, "alpha": axes[0], "x": axes[1]})
    folder = parts / f"{sources[:16]}-{name[:8]}"
    done = run_pieces(pieces, folder, scheduler, "tablegen contact")
    stuck = _solve_sticking(axes[1], folder, scheduler)

    def solved(material: Material) -> tuple[Floats, Floats]:
        return _with_errors(
            axes,
            *([done[_piece(material, order, number)] for number in range(edges.size)] for order in (ORDER, ORDER - 1)),
        )

    slips = solved(NEO_HOOKEAN)
    second = Dataset(SECOND_OVER_FIRST, "c2 of Yeoh's energy (G/2)(K + c2 K^2), K = I1 - 3")
    ratio = Dataset(POISSON_RATIOS, "Poisson's ratio")
    friction = Dataset(FRICTIONS, "0: the sphere slips freely, 1: it sticks")
    groups = {
        "frictionless": _group(axes, *slips),
        "yeoh": _further_group(axes, "second_over_first", second, [solved(material) for material in yeoh], 0),
        "compressible": _further_group(axes, "poisson_ratio", ratio, [solved(one) for one in compressible], -1),
        "sticking": _further_group(axes, "friction", friction, [slips, _sticks(axes, slips[0], stuck)], 0),
    }
    about = {
        "quantity": "contact",
        "poisson_ratio": 0.5,
        "material": "bonded layer, neo-Hookean, Yeoh's or compressible; rigid sphere, frictionless or sticking",
        "mesh": f"Q{ORDER}/P{ORDER - 1}, rim at a + {RIM:g} h, graded to the contact's edge",
        "solver": "contact edge prescribed, indentation free; augmented Lagrangian for volume and contact, SuperLU",
        "force_balance_error": max(
            float(piece["force_error"]) for pieces in (done.values(), *stuck) for piece in pieces
        ),
        "tablegen_sources_sha256": sources,
        **{f"version_{name}": version(name) for name in ("underskin", "scikit-fem", "numpy", "scipy", "h5py")},
    }
    digest = write_table(path, CONTACT_SCHEMA, groups, dict.fromkeys(groups, "correction"), about)
    shutil.rmtree(parts)
    return digest


def _solve_sticking(cbrt_load: Floats, folder: Path, scheduler: str | None) -> list[list[Arrays]]:
    """The columns of a contact that sticks, of the higher and the lower order; each needs those of smaller edges."""
    columns: dict[int, list[Arrays]] = {STICKING_ORDER: [], STICKING_ORDER - 1: []}
    for number, a in enumerate(STICKING_EDGES.tolist()):
        pieces = {
            f"sticking-order{order}-{number:02d}": partial(
                solve_piece,
                a,
                cbrt_load,
                order,
                earlier=[
                    Touched(edge, column["strain"], column["spread"])
                    for edge, column in zip(STICKING_EDGES.tolist(), former, strict=False)
                ],
            )
            for order, former in columns.items()
        }
        done = run_pieces(pieces, folder, scheduler, f"tablegen contact that sticks, a/h {a:.2f}")
        for former, piece in zip(columns.values(), pieces, strict=True):
            former.append(done[piece])
    return list(columns.values())


def _sticks(axes: tuple[Floats, Floats], slips: Floats, stuck: list[list[Arrays]]) -> tuple[Floats, Floats]:
    """All quantities of a contact that sticks at the nodes, and their errors: the columns' differences from `slips`,
    the frictionless contact at the nodes."""
    count = len(_RATIOS)
    scale = np.concatenate([slips[..., :count], np.ones_like(slips[..., count:])], axis=-1)
    offset = np.concatenate([np.zeros_like(slips[..., :count]), slips[..., count:]], axis=-1)

    def at(values: Floats, alpha: Floats) -> Floats:
        return np.stack([make_interp_spline(axes[0], values[:, i])(x) for i, x in enumerate(alpha)])

    added: list[list[Arrays]] = [
        [
            {**column, "values": (column["values"] - at(offset, column["alpha"])) / at(scale, column["alpha"])}
            for column in of_order
        ]
        for of_order in stuck
    ]
    values, errors = _with_errors(axes, *added)
    return offset + scale * values, scale * errors


def _piece(material: Material, order: int, number: int) -> str:
    return f"c2-{material.second_over_first:g}-nu-{material.poisson_ratio:g}-order{order}-{number:02d}"


def solve_piece(
    a: float,
    cbrt_load: Floats,
    order: int,
    material: Material = NEO_HOOKEAN,
    earlier: Sequence[Touched] | None = None,
) -> Arrays:
    """`solve_contact_column` as a dictionary of arrays, which can be sent to workers and stored."""
    alpha, values, force_error, touched = solve_contact_column(a, cbrt_load, order, material, earlier)
    return {
        "alpha": alpha,
        "values": values,
        "force_error": np.array(force_error),
        "strain": touched.strain,
        "spread": touched.spread,
    }


def _with_errors(axes: tuple[Floats, Floats], *columns: list[Arrays]) -> tuple[Floats, Floats]:
    """All quantities at the nodes (α, x, quantities), and their errors, from columns of the higher and lower order."""
    fine, coarse = (_on_the_nodes(axes, of_order) for of_order in columns)
    return fine, np.abs(fine - coarse) + sum(left_out_errors(axes, fine))


def _on_the_nodes(axes: tuple[Floats, Floats], columns: list[Arrays]) -> Floats:
    """All quantities of the columns at the table's nodes: (α, x, quantities); from those that reach the load."""
    alpha, cbrt_load = axes
    solved = np.stack([column["alpha"] for column in columns])
    values = np.stack([column["values"] for column in columns])
    nodes, count = [], len(_RATIOS)
    for number, x in enumerate(cbrt_load):
        reaching = np.isfinite(solved[:, number])
        along, at = solved[reaching, number], values[reaching, number]
        if not along[-1] >= alpha[-1]:
            raise ValueError(f"the contact edges do not reach all of a/h at x = {x:g}")
        ratios = make_interp_spline(along, at[:, :count], k=5)(alpha)  # at α = 0, the half space, a little beyond
        from_zero = np.concatenate([np.zeros((1, at.shape[1] - count)), at[:, count:]])
        correction = make_interp_spline(np.append(0.0, along), from_zero, k=5)(alpha)
        correction[0] = 0.0
        nodes.append(np.concatenate([ratios, correction], axis=1))
    return np.stack(nodes, axis=1)


def _group(axes: tuple[Floats, Floats], values: Floats, errors: Floats) -> dict[str, Dataset]:
    along = ("a_over_h", "cbrt_load_parameter")
    group = {
        "a_over_h": Dataset(axes[0], "contact radius over thickness of the linear layer's contact, a/h"),
        "cbrt_load_parameter": Dataset(axes[1], "cube root of L = F/(R^2 E)"),
        "r_over_h": Dataset(RADII, "distance from the contact's axis over thickness, r/h"),
    }
    for number, name in enumerate(_RATIOS):
        group[name] = Dataset(values[..., number], f"{name} over that of the linear layer at the same force", along)
        relative = errors[..., number] / values[..., number]
        group[f"{name}_error"] = Dataset(relative, f"relative error of {name}", along)
    count, meaning = len(_RATIOS), "stress on the base less the linear contact's, in sigma's scale: -T3 2 pi h^2/(3 F)"
    group["correction"] = Dataset(values[..., count:], meaning, (*along, "r_over_h"))
    group["correction_error"] = Dataset(errors[..., count:], "absolute error of correction", (*along, "r_over_h"))
    return group


def _further_group(
    axes: tuple[Floats, Floats], name: str, axis: Dataset, solved: list[tuple[Floats, Floats]], reference: int
) -> dict[str, Dataset]:
    """What a property of the layer adds, over the `axis` of this name; `reference` is the neo-Hookean layer in it."""
    along = (name, "a_over_h", "cbrt_load_parameter")
    group = {
        "a_over_h": Dataset(axes[0], "contact radius over thickness of the linear layer's contact, a/h"),
        "cbrt_load_parameter": Dataset(axes[1], "cube root of L = F/(R^2 E), times (0.75/(1 - nu^2))^(2/3)"),
        "r_over_h": Dataset(RADII, "distance from the contact's axis over thickness, r/h"),
        name: axis,
    }
    values, errors = (np.stack(arrays) for arrays in zip(*solved, strict=True))
    errors = errors + errors[reference]
    errors[reference] = 0.0  # nothing is added
    count = len(_RATIOS)
    ratios = values[..., :count] / values[reference, ..., :count]
    for number, quantity in enumerate(_RATIOS):
        meaning = f"{quantity} over that of the linear layer, over the same of the neo-Hookean incompressible layer"
        group[quantity] = Dataset(ratios[..., number], meaning, along)
        group[f"{quantity}_error"] = Dataset(
            errors[..., number] / values[reference, ..., number], f"absolute error of {quantity}", along
        )
    meaning = "stress on the base less the linear contact's, less the same of the neo-Hookean incompressible layer"
    group["correction"] = Dataset((values - values[reference])[..., count:], meaning, (*along, "r_over_h"))
    group["correction_error"] = Dataset(errors[..., count:], "absolute error of correction", (*along, "r_over_h"))
    return group
