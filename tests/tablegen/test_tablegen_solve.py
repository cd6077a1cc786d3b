"""The finite-element layer: exact linear limit, convergence rate, force balance, and what must not matter."""

import numpy as np
import pytest
from scipy.sparse import csc_matrix, hstack, vstack
from scipy.sparse.linalg import splu

import tablegen.mesh
from tablegen import linear_layer
from tablegen.base_stress import BaseStress
from tablegen.discretisation import discretise
from tablegen.faces import hertz_load
from tablegen.mesh import layer_mesh
from tablegen.neo_hookean import IDENTITY, volume_ratio
from tablegen.newton import NonlinearLayer, State
from tablegen.sigma import Nodes, peak_pressures, solve_column
from underskin import SolverError
from underskin.units import Floats

RHO = np.array([0.0, 0.1, 0.2, 0.6, 1.0, 2.0, 3.0])
R = np.linspace(0, 8, 17)


def nodes(*load_parameters: float) -> Nodes:
    return Nodes(np.zeros(1), RHO, np.cbrt([0.0, *load_parameters]), R)


@pytest.mark.slow
@pytest.mark.parametrize("a", [0.02, 1.0, 3.0])
def test_linear_limit_is_the_exact_layer(a: float) -> None:
    column = solve_column(a, nodes(), order=5)
    assert np.abs(column.linear_error / linear_layer.sigma(a, RHO)).max() < 3e-6
    assert column.force_error < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("order", [3, 4])
def test_convergence_rate_of_the_stress_on_the_base(order: int) -> None:
    """Stresses of elements of order k converge like h^k in the mean square, here on the base under a wide contact."""
    errors = []
    for refinement in (1, 2):
        layer = NonlinearLayer(discretise(layer_mesh(1.0, refinement), order))
        base = BaseStress(layer.discretisation)
        stress = base.at_points(layer.linear_force(hertz_load(layer.discretisation, 1.0)))
        exact = linear_layer.sigma(1.0, 0.0, base.points)
        errors.append(np.sqrt(base.total_force(np.where(base.points < 3, (stress - exact) ** 2, 0.0))))
    assert errors[0] / errors[1] > 2 ** (order - 0.25)


@pytest.mark.slow
def test_finite_strain_reference_values() -> None:
    """Computed independently: σ(L)/σ(0) at a/h 0.3, ρ 0.6 (Richardson, ± 5e-5); the base carries the force."""
    column = solve_column(0.3, nodes(1e-3, 1e-2, 3e-2, 1e-1), order=5)
    assert np.abs(column.linear_error / linear_layer.sigma(0.3, RHO)).max() < 3e-6
    assert column.force_error < 1e-6
    ratio = 1 + column.sigma_change[3] / linear_layer.sigma(0.3, 0.6)
    assert ratio == pytest.approx([1, 1.01293, 1.02966, 1.04522, 1.07489], abs=1e-4)


@pytest.mark.slow
def test_volume_is_kept_and_the_path_of_loading_does_not_matter() -> None:
    layer = NonlinearLayer(discretise(layer_mesh(0.5), 4))
    load = hertz_load(layer.discretisation, 0.5)
    peak = float(peak_pressures(np.cbrt(np.array([0.1])))[0])
    direct = layer.equilibrium(layer.rest(), peak * load)
    overshoot = layer.equilibrium(direct, 1.2 * peak * load)
    back = layer.equilibrium(overshoot, peak * load)
    assert layer.volume_change(direct) < 1e-8
    assert back.displacement == pytest.approx(direct.displacement, abs=2e-8)


@pytest.mark.slow
def test_the_surface_sinks_under_the_contact_and_the_base_does_not_move() -> None:
    d = discretise(layer_mesh(0.5), 4)
    layer = NonlinearLayer(d)
    state = layer.equilibrium(layer.rest(), 0.3 * hertz_load(d, 0.5))
    vertices = d.basis.mesh.p
    on_axis = np.flatnonzero((vertices[0] == 0) & (vertices[1] == 1.0))
    on_base = np.flatnonzero(vertices[1] == 0.0)
    scalar = d.basis.nodal_dofs[0]
    assert (state.displacement[2 * scalar[on_axis] + 1] < -0.01).all()
    assert (state.displacement[2 * scalar[on_base] + 1] == 0).all()


@pytest.mark.slow
def test_the_rim_does_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    here = solve_column(1.0, nodes(0.1), order=4)
    monkeypatch.setattr(tablegen.mesh, "RIM", 16.0)
    there = solve_column(1.0, nodes(0.1), order=4)
    scale = linear_layer.sigma(1.0, RHO)[:, None]
    assert np.abs((there.sigma_change - here.sigma_change) / scale).max() < 2e-6


@pytest.mark.slow
def test_the_augmentation_does_not_matter() -> None:
    """The same equilibrium without it: displacements and pressures in one system, by a solver that pivots."""
    layer = NonlinearLayer(discretise(layer_mesh(1.0), 3))
    load = float(peak_pressures(np.cbrt(np.array([0.1])))[0]) * hertz_load(layer.discretisation, 1.0)
    augmented = layer.equilibrium(layer.rest(), load)
    state = layer.rest()
    for _ in range(4):
        state = after_newton_step(layer, state, load)
    assert augmented.displacement == pytest.approx(state.displacement, abs=1e-10)
    assert augmented.pressure == pytest.approx(state.pressure, abs=1e-10)


def after_newton_step(layer: NonlinearLayer, state: State, load: Floats) -> State:
    """The solution of K du − Cᵀ dp = f − r and C du = −c, with r the internal force and c = ∫ ψ (J − 1)."""
    d = layer.discretisation
    strain = (d.gradient @ state.displacement[d.numbers][:, None, :, None])[..., 0]
    volume = (d.weight * (volume_ratio(IDENTITY + strain) - 1)) @ d.pressure
    stiffness, c = layer.element_matrices(state)
    rows = np.broadcast_to(np.arange(volume.size).reshape(volume.shape)[:, :, None], c.shape)
    columns = np.broadcast_to(d.numbers[:, None, :], c.shape)
    everywhere = csc_matrix((c.ravel(), (rows.ravel(), columns.ravel())), shape=(volume.size, d.size))
    constraint = everywhere[:, d.free]
    above = hstack([d.assemble_matrix(stiffness), -constraint.T])
    system = vstack([above, hstack([constraint, csc_matrix((volume.size, volume.size))])], format="csc")
    step = splu(system).solve(np.concatenate([(load - layer.internal_force(state))[d.free], -volume.ravel()]))
    displacement = state.displacement.copy()
    displacement[d.free] += step[: d.free.size]
    return State(displacement, state.pressure + step[d.free.size :].reshape(state.pressure.shape))


@pytest.mark.slow
def test_change_grows_like_the_cube_root_of_the_load() -> None:
    """σ(L) − σ(0) ∝ L^(1/3) as L → 0, so that the table's axis is smooth."""
    column = solve_column(0.5, nodes(1e-6, 8e-6), order=4)
    assert column.sigma_change[3, 2] / column.sigma_change[3, 1] == pytest.approx(2.0, rel=0.01)


@pytest.mark.slow
def test_an_unreachable_load_names_the_point() -> None:
    with pytest.raises(SolverError, match=r"a/h = 1, L = 200"):
        solve_column(1.0, nodes(200.0), order=2)
