"""Many contacts at once: against single exact ones, derivatives against differences, ends of the branches."""

import numpy as np
import pytest
from scipy.special import j0

from tests.support.sphere_contact import SphereOnLayer
from underskin.physics.elastic_layer import (
    LARGEST_A_OVER_H,
    ContactEquation,
    ContactRows,
    CurveGrid,
    Layer,
    mode_transforms,
)
from underskin.physics.hankel_transform import disc_average
from underskin.units import Floats

K = np.linspace(0.05, 25.0, 250)
GRID = CurveGrid(K)
LAYERS = [Layer(), Layer(0.3, 0.2), Layer(0.5, 0.999), Layer(0.0), Layer(0.45, 1.0)]
QUANTITIES = ["alpha", "load", "depth", "sphere_load", "stiffness"]
RADIUS, MODULUS, THICKNESS = 4e-3, 1e6, 2.5e-3  # m, Pa


def _dimensionless(setup: SphereOnLayer, force: Floats) -> tuple[Floats, Floats]:
    """P and U."""
    stiffness = setup.plane_modulus * setup.thickness**3
    load = force * setup.indenter_radius / stiffness
    return load, np.full_like(load, np.sqrt(setup.work_of_adhesion / stiffness) * setup.indenter_radius)


@pytest.mark.parametrize("body", LAYERS)
@pytest.mark.parametrize("work_of_adhesion", [0.0, 0.05, 20.0])
def test_rows_equal_single_contacts(body: Layer, work_of_adhesion: float) -> None:
    setup = SphereOnLayer(RADIUS, MODULUS, THICKNESS, body, work_of_adhesion)
    lowest = setup.pull_off().contact_radius if work_of_adhesion else 0.0
    radii = lowest + (LARGEST_A_OVER_H * THICKNESS - lowest) * np.array([0.01, 0.1, 0.5, 0.99])
    exact = [setup.at_radius(radius) for radius in radii]
    forces = np.array([contact.force for contact in exact])
    rows = GRID.curves(body).at_load(*_dimensionless(setup, forces))
    assert rows.alpha.value * THICKNESS == pytest.approx(radii, rel=1e-8)
    depths = rows.depth.value * THICKNESS**2 / RADIUS
    assert depths == pytest.approx([contact.indentation for contact in exact], rel=1e-6)
    stiffness = 2 * setup.plane_modulus * radii * rows.stiffness.value
    assert stiffness == pytest.approx([contact.stiffness for contact in exact], rel=1e-8)


@pytest.mark.parametrize("body", LAYERS)
def test_stress_from_the_points_in_a(body: Layer) -> None:
    """Contracting the transforms first and interpolating in a/h afterwards loses less than 1e-6 of σ."""
    alpha = np.linspace(0.005, 3.99, 41)
    equation = ContactEquation(alpha)
    solved = equation.solve(body)
    transforms = mode_transforms(np.multiply.outer(alpha, K), equation.modes)
    curves = GRID.curves(body)
    basis = curves.interval.basis(alpha)
    step = K[1] - K[0]
    for rho, offset in ((0.1, 0.0), (0.6, 0.0), (0.6, 1.0), (2.0, 5.0)):
        weight = step * K / 3 * body.transmission(K).value * disc_average(K * rho) * j0(K * offset)
        for shape, nodes in (
            (solved.sphere_shape, curves.sphere_transform),
            (solved.punch_shape, curves.punch_transform),
        ):
            exact = np.einsum("akn,an,k->a", transforms, shape.value, weight)
            found = basis @ curves.interval.coefficients(nodes.value @ weight)
            assert found == pytest.approx(exact, abs=1e-6)


def test_derivatives() -> None:
    given, adhesion = np.array([0.02, 0.3, 2.0, 3.9]), np.array([0.02, 0.1, 0.3, 0.01])

    def contacts(step: tuple[float, ...]) -> ContactRows:
        curves = GRID.curves(Layer(0.4 + step[2], 0.3 + step[3]))
        return curves.at_load(given + step[0], adhesion + step[1])

    middle = contacts((0.0, 0.0, 0.0, 0.0))
    for index in range(4):
        step = 1e-5
        higher, lower = (contacts(tuple(sign * step * (i == index) for i in range(4))) for sign in (1, -1))
        for name in QUANTITIES:
            difference = (getattr(higher, name).value - getattr(lower, name).value) / (2 * step)
            assert getattr(middle, name).slopes[index] == pytest.approx(difference, rel=1e-5, abs=1e-7), (name, index)


def test_derivatives_of_the_transforms() -> None:
    step, curves = 1e-5, GRID.curves(Layer(0.4, 0.3))
    neighbours = [
        (GRID.curves(Layer(0.4 + step, 0.3)), GRID.curves(Layer(0.4 - step, 0.3))),
        (GRID.curves(Layer(0.4, 0.3 + step)), GRID.curves(Layer(0.4, 0.3 - step))),
    ]
    for index, (higher, lower) in enumerate(neighbours):
        for name in ("sphere_transform", "punch_transform"):
            difference = (getattr(higher, name).value - getattr(lower, name).value) / (2 * step)
            assert getattr(curves, name).slopes[index] == pytest.approx(difference, abs=1e-8)


def test_a_whole_contact_is_the_sum_of_sphere_and_punch() -> None:
    setup = SphereOnLayer(RADIUS, MODULUS, THICKNESS, Layer(0.45), 0.3)
    curves = GRID.curves(setup.layer)
    node = 12
    contact = setup.at_radius(float(curves.interval.nodes[node]) * THICKNESS)
    load, adhesion = _dimensionless(setup, np.array([contact.force]))
    rows = curves.at_load(load, adhesion)
    punch = rows.load.value - rows.sphere_load.value
    whole = rows.sphere_load.value * curves.sphere_transform.value[node] + punch * curves.punch_transform.value[node]
    exact = contact.pressure_transform(K * curves.interval.nodes[node]) / contact.force
    assert whole / load == pytest.approx(exact, abs=1e-8)


def test_no_contact_is_nan() -> None:
    curves = GRID.curves(Layer())
    bare = np.zeros(4)
    rows = curves.at_load(np.array([1e9, -1.0, 0.0, 1.0]), bare)
    assert np.isnan(rows.alpha.value).tolist() == [True, True, True, False]
    setup = SphereOnLayer(RADIUS, MODULUS, THICKNESS, Layer(), 0.5)
    load, adhesion = _dimensionless(setup, setup.pull_off().force * np.array([1.001, 0.999]))
    rows = curves.at_load(load, adhesion)
    assert np.isnan(rows.stiffness.value).tolist() == [True, False]


def test_stiffness_at_a_given_radius() -> None:
    alpha, step = np.array([0.0, 0.3, 2.0, 3.9]), 1e-5
    found = GRID.curves(Layer(0.4, 0.3)).stiffness_at(alpha)
    assert found.value[0] == pytest.approx(1.0, abs=1e-8)
    exact = ContactEquation(alpha[1:]).solve(Layer(0.4, 0.3)).stiffness
    assert found.value[1:] == pytest.approx(exact.value, rel=1e-6)
    assert found.slopes[1:, 1:] == pytest.approx(exact.slopes, rel=1e-6)
    around = np.concatenate([alpha[1:] - step, alpha[1:] + step])
    neighbours = ContactEquation(around).solve(Layer(0.4, 0.3)).stiffness.value
    assert found.slopes[0, 1:] == pytest.approx((neighbours[3:] - neighbours[:3]) / (2 * step), rel=1e-6)
