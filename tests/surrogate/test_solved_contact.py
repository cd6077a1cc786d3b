"""σ and radius of the layer's own contact, against the exact linear contact and the forward model's."""

import numpy as np
import pytest

from tests.support.sphere_contact import SphereOnLayer
from underskin.physics.charge_response import Indenter, Skin
from underskin.physics.elastic_layer import Layer
from underskin.physics.hankel_transform import normal_stress
from underskin.prediction.forward_model import predict
from underskin.prediction.pressed_skin import Transmission, frf_gradient, transmission
from underskin.recordings.campaign import SkinDescription, frf_conditions
from underskin.surrogate.hdf5_format import load_contact
from underskin.surrogate.sigma_table import load_table
from underskin.surrogate.solved_contact import linear_contact, solved_contact

SOLVED, TABLE = solved_contact(), load_table()
MODULUS = 16e6
PROTOTYPE = Skin(*(np.array(value) for value in (2.5e-3, MODULUS, 1.5e-3, 0.5)))


def pressed(thickness: float, sensor_radius: float, radius: float, force: float) -> Transmission:
    skin = Skin(*(np.array(value) for value in (thickness, MODULUS, sensor_radius, 0.5)))
    return transmission(SOLVED, skin, Indenter(np.array(radius)), force)


def random_rows(count: int) -> tuple[Skin, Indenter, np.ndarray]:
    """Within the domain: a/h 0.1 to 2.5, rT/h 0.05 to 2.5, L 1e-3 to 0.12."""
    generator = np.random.default_rng(11)
    alpha, rho = generator.uniform(0.1, 2.5, count), generator.uniform(0.05, 2.5, count)
    load, h = generator.uniform(0.1, 0.49, count) ** 3, generator.uniform(0.2e-3, 5e-3, count)
    over_cube, _ = SOLVED.load_over_cube(alpha)
    radius = h * np.cbrt(over_cube * alpha**3 / 0.75 / load)  # L R³/h³ = F R/(E h³)
    skin = Skin(h, np.full(count, MODULUS), rho * h, np.full(count, 0.5))
    return skin, Indenter(radius), load * radius**2 * MODULUS


@pytest.mark.parametrize(("alpha", "rho"), [(0.05, 0.02), (0.31, 0.6), (1.0, 0.2), (1.7, 1.1), (2.9, 2.7)])
def testlinear_contact(alpha: float, rho: float) -> None:
    """At small strain radius and σ are the exact linear contact's, to the bound on the error."""
    h, radius = 1e-3, 10.0
    exact = SphereOnLayer(radius, MODULUS, h, Layer()).at_radius(alpha * h)
    reached = pressed(h, rho * h, radius, exact.force)
    layer = Layer()
    stress = normal_stress(lambda k: layer.transmission(k).value, exact.pressure_transform, alpha, rho)
    at_small_strain = SOLVED.sigma(alpha, rho, 0.0)
    assert reached.small_strain_a_over_h == pytest.approx(alpha, rel=1e-7)
    assert reached.load_parameter < 1e-7
    assert reached.contact_radius == pytest.approx(alpha * h, rel=1e-3)
    assert at_small_strain.sigma == pytest.approx(stress / exact.force, rel=float(at_small_strain.rel_error))


def test_spline_between_nodes() -> None:
    """Between all nodes in a/h and rT/h the linear contact's σ is within the bound that the table states."""
    generator = np.random.default_rng(3)
    alpha = np.sort(np.append(0.0, generator.uniform(0, 3, 120)))
    rho = generator.uniform(0, 3, 120)
    exact, _ = linear_contact(alpha, rho, np.zeros(1))
    answer = SOLVED.sigma(alpha[:, None], rho, 0.0)
    assert np.abs(answer.sigma / exact - 1).max() < answer.rel_error.min()


def test_forward_model() -> None:
    """σ is that of `layered_contact`, which finds it otherwise, at thin and thick skins and up to the table's L."""
    for thickness, sensor_radius, radius, loads in (
        (2.5, 1.5, 4.0, [0.5, 1.0, 3.0, 20.0]),
        (0.4, 0.3, 2.0, [0.1, 1.0, 5.0]),
        (0.2, 0.5, 4.0, [0.5, 1.0]),
    ):
        described = SkinDescription(
            poisson_ratio=0.5, thickness_mm=thickness, youngs_modulus_mpa=16.0, sensor_radius_mm=sensor_radius
        )
        conditions = frf_conditions(described, indenter_radius_mm=radius, preload_n=loads, frequency_hz=[30.0])
        predicted = predict(conditions, TABLE, {"d33": 1.0}, mechanisms=["layered_contact"])
        skin = Skin(*(np.array(x) for x in (thickness * 1e-3, MODULUS, sensor_radius * 1e-3, 0.5)))
        reached = transmission(SOLVED, skin, Indenter(np.array(radius * 1e-3)), loads)
        assert predicted.inside.all()
        assert reached.inside.all()
        np.testing.assert_allclose(reached.frf(1.0), predicted.value.real, rtol=1e-4)


def test_paper_in_the_limit() -> None:
    """A contact that is small against the layer is Hertz', and at small strain so is its σ."""
    force, radius = 1e-3, np.array(10e-3)  # a/h 0.02, L 6e-7
    solved, paper = (transmission(model, PROTOTYPE, Indenter(radius), force) for model in (SOLVED, TABLE))
    assert solved.contact_radius == pytest.approx(paper.contact_radius, rel=1e-3)
    assert solved.sigma == pytest.approx(paper.sigma, rel=3e-4)


def test_gradient() -> None:
    """∂FRF/∂ of each input against central differences."""
    skin, indenter, force = random_rows(40)
    inputs = {
        "thickness": skin.thickness,
        "youngs_modulus": skin.youngs_modulus,
        "sensor_radius": skin.sensor_radius,
        "indenter_radius": indenter.radius,
        "preload": force,
    }

    def frf(name: str, factor: float) -> np.ndarray:
        moved = {**inputs, name: inputs[name] * factor}
        new = Skin(moved["thickness"], moved["youngs_modulus"], moved["sensor_radius"], skin.poisson_ratio)
        return transmission(SOLVED, new, Indenter(moved["indenter_radius"]), moved["preload"]).frf(1.0)

    slopes = frf_gradient(SOLVED, skin, indenter, force, 1.0)
    for name, value in inputs.items():
        difference = (frf(name, 1 + 1e-5) - frf(name, 1 - 1e-5)) / 2e-5
        np.testing.assert_allclose(slopes[name] * value, difference, rtol=1e-5, atol=1e-7)


def test_outside() -> None:
    """Rows beyond a/h 3, L 0.222, or of another ν have no σ, and spoil no other row."""
    h = np.array([2.5e-3, 0.1e-3, 2.5e-3, 2.5e-3, 2.5e-3])
    force = np.array([1.0, 1.0, 60.0, 1.0, np.inf])
    nu = np.array([0.5, 0.5, 0.5, 0.45, 0.5])
    skin = Skin(h, np.full(5, MODULUS), np.full(5, 0.3e-3), nu)
    reached = transmission(SOLVED, skin, Indenter(np.array(4e-3)), force)
    assert reached.inside.tolist() == [True, False, False, False, False]
    assert np.isfinite(reached.sigma).tolist() == reached.inside.tolist()
    alone = pressed(2.5e-3, 0.3e-3, 4e-3, 1.0)
    assert reached.sigma[0] == pytest.approx(float(alone.sigma))
    assert reached.small_strain_a_over_h[1] > 3
    assert reached.load_parameter[2] > 0.222


def test_finite_strain_is_the_table_s() -> None:
    """At a node of the contact table a small disc's σ is the linear contact's and the correction on the axis."""
    table = load_contact()
    nodes, cbrt_load = table.contact_axes
    row, column = 14, 9
    change = SOLVED.sigma(nodes[row], 0.0, cbrt_load[column] ** 3).sigma - SOLVED.sigma(nodes[row], 0.0, 0.0).sigma
    assert change == pytest.approx(table.profile_over(np.zeros(1))[row, column, 0], rel=1e-9)
    assert SOLVED.profile(0.0, nodes[row], 0.0) == pytest.approx(
        float(SOLVED.sigma(nodes[row], 0.0, 0.0).sigma), rel=1e-5
    )
