"""Time of one Newton step (residual, matrix, solution) at equal unknowns: tablegen against FElupe, on one core.

The same layer on the same tensor grid of points, hence the same displacements: elements of order p against FElupe's
elements through the same points. FElupe in two ways, each with its own assembly and its default solver: its
condensed nearly incompressible solid on 4-node elements (constant pressures, eliminated; of low order), and its
three-field solid on 9-node elements with continuous pressures (Taylor–Hood), the one of comparable accuracy.
"""

from collections.abc import Callable
from functools import partial
from statistics import median
from typing import Any

import felupe
import numpy as np
from threadpoolctl import threadpool_limits

from bench.figures import Figure, interleaved, ratio, seconds
from tablegen.discretisation import discretise
from tablegen.faces import hertz_load
from tablegen.mesh import layer_mesh
from tablegen.newton import NonlinearLayer
from tests.support.felupe_layer import BULK_MODULUS, FelupeLayer, Floats, quadratic_mesh

CONTACT_RADIUS = 0.3
PEAK_PRESSURE = 0.1
SIZES = ((4, 1), (4, 2), (5, 2))  # order, refinement; an even product: FElupe's elements have a middle node
ROUNDS = 5

Step = Callable[[], object]


def measure() -> list[Figure]:
    """Seconds for ours, and how many times longer FElupe takes."""
    figures = []
    with threadpool_limits(1):
        for order, refinement in SIZES:
            steps, size = _contestants(order, refinement)
            for step in steps.values():
                step()  # set-up, which is done once, is not part of a step
            times = interleaved({name: partial(seconds, step) for name, step in steps.items()}, ROUNDS)
            at = f"Newton step, {size:,} displacements"
            figures += [
                Figure(f"{at}: tablegen", median(times["ours"]), "s"),
                Figure(f"{at}: FElupe's condensed solid", ratio(times["condensed"], times["ours"]), "× ours", 1.0),
                Figure(f"{at}: FElupe's three-field solid", ratio(times["mixed"], times["ours"]), "× ours", 1.0),
            ]
    return figures


def _contestants(order: int, refinement: int) -> tuple[dict[str, Step], int]:
    """A step of each code on one grid of points, and the number of free displacements, equal for all."""
    mesh = layer_mesh(CONTACT_RADIUS, refinement)
    layer = NonlinearLayer(discretise(mesh, order))
    load = PEAK_PRESSURE * hertz_load(layer.discretisation, CONTACT_RADIUS)
    r, z = (_subdivided(np.unique(coordinates), order) for coordinates in mesh.p)
    mixed = FelupeLayer(CONTACT_RADIUS, quadratic_mesh(z[::2], r[::2]))
    mixed.apply(PEAK_PRESSURE)
    condensed = _condensed_solid(z, r)
    steps: dict[str, Step] = {
        "ours": partial(layer.linear_force, load),  # one increment from rest and the forces after it
        "condensed": _felupe_step(condensed, mixed.load.values),
        "mixed": _felupe_step(mixed.body, mixed.load.values),
    }
    free = layer.discretisation.free.size
    if free != _free(condensed.field)[1].size:
        raise RuntimeError("the meshes do not have the same unknowns")
    return steps, free


def _condensed_solid(z: Floats, r: Floats) -> Any:
    region = felupe.RegionQuad(felupe.Grid(z, r))
    field = felupe.FieldContainer([felupe.FieldAxisymmetric(region, dim=2)])
    return felupe.SolidBodyNearlyIncompressible(felupe.NeoHooke(mu=1.0), field, bulk=BULK_MODULUS)


def _felupe_step(body: Any, surface_forces: Floats) -> Step:
    """FElupe's own way through one iteration: assemble, partition, solve, with forces on the nodes at z = 1."""
    field = body.field
    points = field.region.mesh.points
    surface = np.flatnonzero(np.isclose(points[:, 0], 1.0))
    surface = surface[np.argsort(points[surface, 1])]
    load = felupe.PointLoad(field, surface, surface_forces)
    held, free = _free(field)

    def step() -> object:
        residual = (body.assemble.vector(field) - load.assemble.vector(field)).toarray()[:, 0]
        matrix = body.assemble.matrix(field)
        return felupe.solve.solve(*felupe.solve.partition(field, matrix, free, held, residual))

    return step


def _free(field: Any) -> Any:
    """Held and free unknowns: the base is bonded, the axis stays on the axis."""
    boundaries = {
        "base": felupe.Boundary(field[0], fx=0.0),
        "axis": felupe.Boundary(field[0], fy=0.0, skip=(1, 0)),
    }
    return felupe.dof.partition(field, boundaries)


def _subdivided(nodes: Floats, parts: int) -> Floats:
    """The nodes with every interval cut into equal parts."""
    fractions = np.arange(parts) / parts
    return np.append((nodes[:-1, None] + np.diff(nodes)[:, None] * fractions).ravel(), nodes[-1])
