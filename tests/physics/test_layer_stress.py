"""The stress inside the layer: balance of forces, the pressure on the surface, the base, and the half space."""

import numpy as np
import pytest

from underskin.physics import elastic_layer, half_space, hertz
from underskin.physics.elastic_layer import Layer
from underskin.physics.layer_stress import depth_transmission, half_space_stress, layer_stress
from underskin.units import Floats

RATIOS = [0.0, 0.3, 0.45, 0.5]
A = np.array([0.05, 0.3, 1.0, 3.0])
R = np.linspace(0.0, 5.0, 41)
UNIT = 1.5 / np.pi  # of the stresses here, for F = 1 N and h = 1 m


def _rings(end: float, widest: float) -> tuple[Floats, Floats]:
    """Radii from 0 to `end` with the weights of ∫ … 2πr dr, fine up to `widest`."""
    x, w = np.polynomial.legendre.leggauss(20)
    edges = np.concatenate([np.linspace(0.0, widest, 31), np.linspace(widest, end, 31)[1:]])
    half = np.diff(edges)[:, None] / 2
    r = (edges[:-1, None] + half * (1 + x)).ravel()
    return r, 2 * np.pi * r * (half * w).ravel()


@pytest.mark.parametrize("poisson_ratio", RATIOS)
def test_every_plane_bears_the_force(poisson_ratio: float) -> None:
    r, ring = _rings(40.0, 6.0)
    depth = np.array([0.05, 0.5, 1.0])
    assert UNIT * layer_stress(poisson_ratio, A, r, depth) @ ring == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("poisson_ratio", RATIOS)
def test_the_surface_bears_the_hertz_pressure(poisson_ratio: float) -> None:
    surface = layer_stress(poisson_ratio, A, R, np.zeros(1))[:, 0]
    expected = hertz.pressure(R, 1.0, A[:, None]) / UNIT
    assert surface == pytest.approx(expected, rel=1e-12, abs=1e-9)


def test_the_pressure_is_reached_continuously() -> None:
    near, on = (layer_stress(0.5, A, R, np.array([depth]))[:, 0] for depth in (1e-7, 0.0))
    largest = on.max(axis=1, keepdims=True)
    assert np.abs(near - on) / largest == pytest.approx(0.0, abs=2e-3)  # steepest where the contact ends


@pytest.mark.parametrize("poisson_ratio", RATIOS)
def test_the_base_bears_what_the_transform_of_the_layer_gives(poisson_ratio: float) -> None:
    base = layer_stress(poisson_ratio, A, R, np.ones(1))[:, 0]
    assert base == pytest.approx(elastic_layer.sigma(Layer(poisson_ratio), A[:, None], 0.0, R), abs=1e-11)


def test_the_transmission_is_that_of_surface_and_base_at_the_ends() -> None:
    k = np.array([1e-4, 0.1, 1.0, 5.0, 30.0])
    for poisson_ratio in RATIOS:
        surface, base = depth_transmission(poisson_ratio, k, np.array([0.0, 1.0]))
        assert surface == pytest.approx(1.0, rel=1e-12)
        assert base == pytest.approx(Layer(poisson_ratio).transmission(k).value, rel=1e-11)


def test_the_closed_form_of_the_half_space_is_its_transform() -> None:
    """Huber's closed form against the Hankel integral, whose unit of length is the depth."""
    for depth in (0.2, 1.0, 4.0):
        closed = half_space_stress(A, R, np.array([depth]))[:, 0]
        integral = half_space.sigma(A[:, None] / depth, 0.0, R / depth) / depth**2
        assert closed == pytest.approx(integral, rel=1e-8, abs=1e-10)


def test_a_point_force_on_the_half_space_is_boussinesqs() -> None:
    depth = np.array([0.2, 0.5, 1.0])
    expected = depth[:, None] ** 3 / (R**2 + depth[:, None] ** 2) ** 2.5
    assert half_space_stress(np.array([1e-4]), R, depth)[0] == pytest.approx(expected, rel=1e-6)


def test_a_small_contact_near_the_surface_does_not_feel_the_base() -> None:
    """a/h → 0 at depths of the order of a: half the Hertz pressure at d = a, as in the half space, 1/(1 + (d/a)²)."""
    a = np.array([0.002])
    depth = a[0] * np.array([0.5, 1.0, 2.0])
    on_axis = layer_stress(0.5, a, np.zeros(1), depth)[0, :, 0]
    assert on_axis * a[0] ** 2 == pytest.approx(1 / (1 + np.array([0.5, 1.0, 2.0]) ** 2), rel=1e-5)


@pytest.mark.parametrize("poisson_ratio", RATIOS)
def test_the_stress_is_in_equilibrium_and_compatible(poisson_ratio: float) -> None:
    """Without body forces σ_zz is biharmonic: ∇²∇²σ_zz = 0, with ∇² = ∂²/∂r² + (1/r) ∂/∂r + ∂²/∂z², on the axis."""
    step, middle = 0.04, 0.5
    offsets = np.linspace(-3 * step, 3 * step, 7)

    def laplacian(values: Floats) -> Floats:
        """Of even functions of r on a grid (depths, radii) that starts on the axis."""
        mirrored = np.concatenate([values[:, 1:2], values], axis=1)
        r = step * np.arange(values.shape[1] - 1)
        second_r = (mirrored[:, 2:] - 2 * mirrored[:, 1:-1] + mirrored[:, :-2]) / step**2
        first_r = (mirrored[:, 2:] - mirrored[:, :-2]) / (2 * step)
        radial = second_r + np.where(r > 0, first_r / np.where(r > 0, r, 1.0), second_r)
        second_z = (values[2:] - 2 * values[1:-1] + values[:-2]) / step**2
        return radial[1:-1] + second_z[:, :-1]

    field = layer_stress(poisson_ratio, np.array([1.0]), np.linspace(0.0, 7 * step, 8), middle + offsets)[0]
    once = laplacian(field)
    assert abs(laplacian(once)[1, 0]) < 0.02 * np.abs(once).max() / step**2
    assert np.abs(once).max() > 0.1  # not harmonic, so that the test can fail
