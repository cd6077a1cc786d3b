"""A sphere on the layer: independent values, the half space's limits, Dimitriadis' series, and the equation itself."""

import numpy as np
import pytest
from numpy.polynomial import legendre
from scipy.special import j0

from tests.support.oracle import sphere_rows
from tests.support.sphere_contact import SphereContact, SphereOnLayer
from underskin.errors import InvalidInput
from underskin.physics import elastic_layer, hertz
from underskin.physics.elastic_layer import ContactEquation, Layer, mode_transforms
from underskin.physics.hankel_transform import normal_stress
from underskin.units import Floats

RADIUS, MODULUS, DEEP, THICKNESS = 4e-3, 1e6, 1e6, 2.5e-3  # m, Pa
LAYERS = [Layer(), Layer(0.3), Layer(0.5, 1.0), Layer(0.45, 0.5), Layer(0.0)]


def _sigma(contact: SphereContact, setup: SphereOnLayer, rho: float, offset: float) -> float:
    transmitted = normal_stress(
        lambda k: setup.layer.transmission(k).value,
        contact.pressure_transform,
        contact.contact_radius / setup.thickness,
        rho,
        offset,
    )
    return float(transmitted) / contact.force


def test_every_row_of_the_oracle() -> None:
    rows = np.array([list(row.values()) for row in sphere_rows()])
    assert len(rows) == 60
    solved = ContactEquation(rows[:, 0]).solve(Layer())
    for found, expected in zip((solved.sphere_force, solved.sphere_depth, solved.stiffness), rows.T[1:], strict=True):
        assert found.value == pytest.approx(expected, rel=6e-8)
    setup = SphereOnLayer(RADIUS, MODULUS, THICKNESS, Layer())
    for a, force, depth, stiffness in rows[::12]:
        radius = a * THICKNESS
        contact = setup.at_radius(radius)
        assert contact.force == pytest.approx(force * 16 / 9 * MODULUS * radius**3 / RADIUS, rel=1e-7)
        assert contact.indentation == pytest.approx(depth * radius**2 / RADIUS, rel=1e-7)
        assert contact.stiffness == pytest.approx(stiffness * 8 / 3 * MODULUS * radius, rel=1e-7)
        assert setup.at_force(contact.force).contact_radius == pytest.approx(radius, rel=1e-10)


@pytest.mark.parametrize("body", LAYERS)
def test_the_surface_takes_the_indenters_shape(body: Layer) -> None:
    """u(r) = (2/E') [∫₀^r φ dt/√(r² − t²) − ∫ (1 − K) p̂ J0(kr) dk]: flat under a punch, δ − r²/2R under a sphere."""
    alpha = 1.3
    equation = ContactEquation(np.array([alpha]))
    solved = equation.solve(body)
    r = np.array([0.0, 0.4, 0.9, 1.25])
    k, weight = np.polynomial.legendre.leggauss(200)
    k, weight = 15 * (1 + k), 15 * weight

    def deflection(shape: Floats) -> Floats:
        orders = np.arange(equation.modes)
        series = np.zeros(2 * equation.modes - 1)
        series[::2] = np.sqrt(4 * orders + 1) * (-1.0) ** orders * shape
        angle = np.pi / 2 * (np.arange(64) + 0.5) / 64
        half_space = np.pi / 2 * legendre.legval(np.multiply.outer(r / alpha, np.sin(angle)), series).mean(axis=1)
        transform = alpha * mode_transforms(k * alpha, equation.modes) @ shape
        deflected: Floats = half_space - j0(np.multiply.outer(r, k)) @ (weight * body.stiffening(k).value * transform)
        return deflected

    punch = deflection(solved.punch_shape.value[0])
    assert punch == pytest.approx(punch[0], rel=1e-10)
    sphere = deflection(solved.sphere_shape.value[0])
    force = 4 / 3 * alpha**3 * solved.sphere_force.value[0]  # E' = h = R = 1; φ is force/(2πα) times the shape
    surface = 2 * force / (2 * np.pi * alpha) * sphere
    assert surface == pytest.approx(alpha**2 * solved.sphere_depth.value[0] - r**2 / 2, abs=1e-9)


def test_a_thick_layer_gives_hertz() -> None:
    for body in LAYERS:
        contact = SphereOnLayer(RADIUS, MODULUS, DEEP, body).at_force(0.5)
        radius = float(hertz.contact_radius(0.5, RADIUS, MODULUS, body.poisson_ratio))
        assert contact.contact_radius == pytest.approx(radius, rel=1e-8)
        assert contact.indentation == pytest.approx(radius**2 / RADIUS, rel=1e-8)
        assert contact.stiffness == pytest.approx(1.5 * 0.5 / contact.indentation, rel=1e-8)


def test_a_thick_layer_gives_johnson_kendall_roberts() -> None:
    work, body = 0.05, Layer(0.3)
    setup = SphereOnLayer(RADIUS, MODULUS, DEEP, body, work)
    modulus = setup.plane_modulus
    pull_off = setup.pull_off()
    assert pull_off.force == pytest.approx(-1.5 * np.pi * work * RADIUS, rel=1e-8)
    assert pull_off.contact_radius == pytest.approx(np.cbrt(9 * np.pi * work * RADIUS**2 / (8 * modulus)), rel=1e-6)
    jkr = 3 * np.pi * work * RADIUS
    for force in (-5e-4, 0.0, 0.01, 1.0):
        contact = setup.at_force(force)
        radius = np.cbrt(0.75 * RADIUS / modulus * (force + jkr + np.sqrt(2 * jkr * force + jkr**2)))
        assert contact.contact_radius == pytest.approx(radius, rel=1e-8)
        depth = radius**2 / RADIUS - np.sqrt(2 * np.pi * work * radius / modulus)
        assert contact.indentation == pytest.approx(depth, rel=1e-8)
        assert contact.pressure_transform(np.zeros(1)) == pytest.approx(force, abs=1e-12)


@pytest.mark.parametrize("body", LAYERS)
def test_adhesion_balances_the_energy_released(body: Layer) -> None:
    """½ k'(a) (δ − δ_s)² = 2πaw with δ_s the depth without adhesion, and dF_s = k dδ_s: no crack formula goes in."""
    work, radius = 0.2, 2e-3
    bare = SphereOnLayer(RADIUS, MODULUS, THICKNESS, body)
    adhesive = SphereOnLayer(RADIUS, MODULUS, THICKNESS, body, work)
    step = 1e-4 * radius
    low, middle, high = (bare.at_radius(radius + change) for change in (-step, 0.0, step))
    released = (
        (high.stiffness - low.stiffness)
        / (4 * step)
        * (adhesive.at_radius(radius).indentation - middle.indentation) ** 2
    )
    assert released == pytest.approx(2 * np.pi * radius * work, rel=1e-6)
    tangent = (high.force - low.force) / (high.indentation - low.indentation)
    assert tangent == pytest.approx(middle.stiffness, rel=1e-6)


def _dimitriadis(poisson_ratio: float, chi: float) -> float:
    """F over Hertz' F at the same depth, bonded, χ = √(Rδ)/h (Dimitriadis et al. 2002, equation 11)."""
    alpha0 = -(1.2876 - 1.4678 * poisson_ratio + 1.3442 * poisson_ratio**2) / (1 - poisson_ratio)
    beta0 = (0.6387 - 1.0277 * poisson_ratio + 1.5164 * poisson_ratio**2) / (1 - poisson_ratio)
    linear, square = 1 - 2 * alpha0 / np.pi * chi, 4 * alpha0**2 / np.pi**2 * chi**2
    cube = -8 / np.pi**3 * (alpha0**3 + 4 * np.pi**2 / 15 * beta0) * chi**3
    return float(linear + square + cube + 16 * alpha0 / np.pi**4 * (alpha0**3 + 3 * np.pi**2 / 5 * beta0) * chi**4)


@pytest.mark.parametrize("poisson_ratio", [0.3, 0.4, 0.5])
@pytest.mark.parametrize(("a_over_h", "tolerance"), [(0.01, 6e-5), (0.03, 6e-5), (0.1, 2e-3)])
def test_small_contacts_agree_with_dimitriadis(poisson_ratio: float, a_over_h: float, tolerance: float) -> None:
    """To its own accuracy: fitted coefficients, and a term of order χ³ that is not complete."""
    contact = SphereOnLayer(RADIUS, MODULUS, THICKNESS, Layer(poisson_ratio)).at_radius(a_over_h * THICKNESS)
    chi = np.sqrt(RADIUS * contact.indentation) / THICKNESS
    half_space = 4 / 3 * MODULUS / (1 - poisson_ratio**2) * np.sqrt(RADIUS) * contact.indentation**1.5
    assert contact.force / half_space == pytest.approx(_dimitriadis(poisson_ratio, chi), rel=tolerance)


def test_the_base_carries_the_whole_force() -> None:
    setup = SphereOnLayer(RADIUS, MODULUS, THICKNESS, Layer(0.4, 0.3), 0.5)
    for a_over_h in (0.7, 2.0):
        contact = setup.at_radius(a_over_h * THICKNESS)
        assert 1.5 * 30.0**2 * _sigma(contact, setup, 30.0, 0.0) == pytest.approx(1.0, abs=1e-5)


def test_a_small_contact_transmits_like_hertz() -> None:
    setup = SphereOnLayer(RADIUS, MODULUS, THICKNESS, Layer(0.4, 0.3))
    contact = setup.at_radius(0.02 * THICKNESS)
    assert _sigma(contact, setup, 0.6, 0.5) == pytest.approx(
        float(elastic_layer.sigma(setup.layer, 0.02, 0.6, 0.5)), rel=1e-6
    )


def test_force_control_ends_at_pull_off() -> None:
    setup = SphereOnLayer(RADIUS, MODULUS, THICKNESS, Layer(), 0.5)
    pull_off = setup.pull_off()
    assert setup.at_force(pull_off.force * 0.999).contact_radius > pull_off.contact_radius
    with pytest.raises(InvalidInput, match="pull-off force"):
        setup.at_force(pull_off.force * 1.001)
    for radius in (0.9, 1.1):
        assert setup.at_radius(radius * pull_off.contact_radius).force > pull_off.force


def test_what_cannot_be_is_refused_by_name() -> None:
    setup = SphereOnLayer(RADIUS, MODULUS, THICKNESS, Layer())
    for force in (0.0, -1.0, np.nan, 1e9):
        with pytest.raises(InvalidInput, match="force"):
            setup.at_force(force)
    for radius in (0.0, 11 * THICKNESS):
        with pytest.raises(InvalidInput, match="contact_radius"):
            setup.at_radius(radius)
    with pytest.raises(InvalidInput, match="work_of_adhesion"):
        setup.pull_off()
    with pytest.raises(InvalidInput, match="work_of_adhesion"):
        SphereOnLayer(RADIUS, MODULUS, 1e-5, Layer(), 1e3).pull_off()
    with pytest.raises(InvalidInput, match="thickness"):
        SphereOnLayer(RADIUS, MODULUS, 0.0, Layer())
    with pytest.raises(InvalidInput, match="work_of_adhesion"):
        SphereOnLayer(RADIUS, MODULUS, THICKNESS, Layer(), -1.0)
