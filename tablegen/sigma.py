"""σ of the finite-strain layer under the Hertz pressure: one contact radius, all sensor radii, all loads.

At each L the finite-element solution gives the *change* of the stress on the base against its own linear limit, divided
by the load; the table adds it to the exact linear solution. Both share mesh and element, so most of their error
cancels; the error of the linear limit against the exact solution is stored beside it, so that the exact part does not
hide it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from tablegen import linear_layer
from tablegen.base_stress import BaseStress, disc_averages
from tablegen.discretisation import discretise
from tablegen.faces import hertz_load
from tablegen.mesh import layer_mesh
from tablegen.neo_hookean import YOUNGS_MODULUS
from tablegen.newton import NonlinearLayer, State
from underskin.errors import SolverError
from underskin.physics.hertz import peak_pressure_over_modulus
from underskin.units import Floats

_SMALLEST_STEP = 1 / 32  # of the distance between two nodes of the load


@dataclass(frozen=True)
class Nodes:
    """The table's axes: a/h and rT/h, x = L^(1/3), and the radii r/h of the profile; all ascending from 0."""

    a: Floats
    rho: Floats
    cbrt_load: Floats
    r: Floats


@dataclass(frozen=True)
class Column:
    """The solution for one contact radius: changes against the linear limit, and the error of the linear limit."""

    sigma_change: Floats  # (rho, cbrt_load)
    profile_change: Floats  # (r, cbrt_load)
    linear_error: Floats  # (rho,): the finite-element σ at L = 0 minus the exact one
    force_error: float  # largest |total force on the base / load − 1| over the loads


def solve_column(a: float, nodes: Nodes, order: int, refinement: int = 1) -> Column:
    """Solve the layer for one contact radius at every load.

    Parameters
    ----------
    a : float
        Contact radius a/h, above 0.
    nodes : Nodes
        The axes of the table.
    order : int
        Order of the displacement elements.
    refinement : int
        Every element of the mesh is split into `refinement`² equal ones.

    Raises
    ------
    SolverError
        Names a/h and L where a load cannot be reached even with small steps.
    """
    with threadpool_limits(1):  # the same bits whatever the number of cores
        return _solve_column(a, nodes, order, refinement)


def _solve_column(a: float, nodes: Nodes, order: int, refinement: int) -> Column:
    layer = NonlinearLayer(discretise(layer_mesh(a, refinement), order))
    load = hertz_load(layer.discretisation, a)
    base = BaseStress(layer.discretisation)
    share = a**2  # t / (q0 a²) is in σ's scale: t = (3F/2πh²) σ with F = (2/3) π a² q0
    linear = base.at_points(layer.linear_force(load)) / share
    error = base.smooth(linear - linear_layer.sigma(a, 0.0, base.points))
    force_errors = [base.total_force(linear) * 3 - 1]
    sigma_change = np.zeros((nodes.rho.size, nodes.cbrt_load.size))
    profile_change = np.zeros((nodes.r.size, nodes.cbrt_load.size))
    peaks = peak_pressures(nodes.cbrt_load)

    def record(number: int, state: State) -> None:
        stress = base.at_points(layer.internal_force(state)) / (share * peaks[number])
        force_errors.append(base.total_force(stress) * 3 - 1)
        change = base.smooth(stress - linear)
        sigma_change[:, number] = disc_averages(change, nodes.rho)
        profile_change[:, number] = change(nodes.r)

    try:
        _follow(layer, load, nodes.cbrt_load, record)
    except SolverError as failure:
        raise SolverError(f"a/h = {a:g}, {failure}") from failure
    return Column(sigma_change, profile_change, disc_averages(error, nodes.rho), float(np.abs(force_errors).max()))


def peak_pressures(cbrt_load: Floats) -> Floats:
    """Peak pressure of Hertz theory over the shear modulus, q0/G, for x = L^(1/3) (loads,)."""
    return YOUNGS_MODULUS * peak_pressure_over_modulus(cbrt_load**3)


def _follow(layer: NonlinearLayer, load: Floats, cbrt_load: Floats, record: Callable[[int, State], None]) -> None:
    """Load continuation from rest (cbrt_load[0] = 0) through every load, halving the step where it fails."""
    peaks = peak_pressures(cbrt_load)
    before, reached = (0.0, layer.rest()), (0.0, layer.rest())
    for number, goal in enumerate(peaks[1:], start=1):
        smallest = _SMALLEST_STEP * (goal - peaks[number - 1])
        step = goal - reached[0]
        while reached[0] < goal:
            peak = min(goal, reached[0] + step)
            try:
                state = layer.equilibrium(_extrapolated(before, reached, peak), peak * load)
            except SolverError as failure:
                step /= 2
                if step < smallest:
                    raise SolverError(f"L = {cbrt_load[number] ** 3:g}: {failure}") from failure
                continue
            before, reached = reached, (peak, state)
        record(number, reached[1])


def _extrapolated(before: tuple[float, State], reached: tuple[float, State], peak: float) -> State:
    """The state at `peak` on the line through the last two."""
    if reached[0] == before[0]:
        return reached[1]
    factor = (peak - reached[0]) / (reached[0] - before[0])
    return State(
        reached[1].displacement + factor * (reached[1].displacement - before[1].displacement),
        reached[1].pressure + factor * (reached[1].pressure - before[1].pressure),
    )
