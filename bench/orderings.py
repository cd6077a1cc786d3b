"""Alternatives to the solver, on one Newton step: pressures eliminated or not, and SuperLU's orderings."""

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix
from scipy.sparse.linalg import splu
from threadpoolctl import threadpool_limits

from bench.figures import Figure, interleaved, ratio, seconds
from tablegen.discretisation import discretise
from tablegen.mesh import layer_mesh
from tablegen.newton import NonlinearLayer, factorise

CONTACT_RADIUS = 0.3
ORDER = 4
ROUNDS = 3
ORDERINGS = ("COLAMD", "MMD_ATA")


def measure() -> list[Figure]:
    """Seconds for the chosen solver, and the ratios of the others."""
    layer = NonlinearLayer(discretise(layer_mesh(CONTACT_RADIUS), ORDER))
    condensed, saddle = layer.condensed_matrix(layer.rest()), _saddle_matrix(layer)
    tries: dict[str, Callable[[], object]] = {"taken": partial(factorise, condensed)}
    for ordering in ORDERINGS:
        tries[f"pressures eliminated, {ordering}"] = partial(splu, condensed, permc_spec=ordering)
    for ordering in (*ORDERINGS, "MMD_AT_PLUS_A"):
        tries[f"pressures kept (zero block), {ordering}"] = partial(splu, saddle, permc_spec=ordering)
    with threadpool_limits(1):
        times = interleaved({name: partial(seconds, action) for name, action in tries.items()}, ROUNDS)
    size = condensed.shape[0]
    taken = Figure(f"factors of {size:,} displacements, pressures eliminated, MMD_AT_PLUS_A", min(times["taken"]), "s")
    return [taken, *(Figure(name, ratio(times[name], times["taken"]), "× that") for name in tries if name != "taken")]


def _saddle_matrix(layer: NonlinearLayer) -> csc_matrix:
    """[[K, Cᵀ], [C, 0]] with every element's pressures as unknowns of their own."""
    d = layer.discretisation
    stiffness, constraint = layer.element_matrices(layer.rest())
    elements, modes, _ = constraint.shape
    pressure = np.arange(elements * modes).reshape(elements, modes)
    rows = np.broadcast_to(pressure[:, :, None], constraint.shape)
    columns = np.broadcast_to(d.numbers[:, None, :], constraint.shape)
    shape = (pressure.size, d.size)
    c = coo_matrix((constraint.ravel(), (rows.ravel(), columns.ravel())), shape=shape).tocsc()[:, d.free].tocoo()
    k = d.assemble_matrix(stiffness).tocoo()
    size = k.shape[0]
    entries = np.concatenate([k.data, c.data, c.data])
    places = np.concatenate([k.row, c.row + size, c.col]), np.concatenate([k.col, c.col, c.row + size])
    return coo_matrix((entries, places), shape=(size + pressure.size,) * 2).tocsc()
