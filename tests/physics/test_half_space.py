"""The half space against closed forms and limits."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from underskin.physics import half_space, hertz

RADII = np.array([0.0, 0.1, 0.5, 1.0, 3.0, 10.0])


def test_point_force_on_a_point_sensor_is_boussinesq() -> None:
    assert half_space.gamma_n(RADII, 0.0) == pytest.approx((1 + RADII**2) ** -2.5, abs=1e-13)
    assert half_space.gamma_t(RADII, 0.0) == pytest.approx(RADII * (1 + RADII**2) ** -2.5, abs=1e-13)


def test_point_force_over_a_centred_disc() -> None:
    rho = RADII[1:]
    exact = 2 / (3 * rho**2) * (1 - (1 + rho**2) ** -1.5)
    assert half_space.gamma_n(0.0, rho) == pytest.approx(exact, rel=1e-12)


def test_hertz_pressure_on_a_point_sensor_is_delta() -> None:
    assert half_space.sigma(RADII, 0.0) == pytest.approx(half_space.delta(RADII), rel=1e-11)


def test_limits_named_in_the_paper() -> None:
    assert half_space.sigma(0.0, RADII) == pytest.approx(half_space.gamma_n(0.0, RADII), rel=1e-13)
    assert half_space.delta(0.0) == 1.0


def test_the_plane_at_depth_carries_the_whole_force() -> None:
    """2π ∫ T3 r dr = −F: with ρ large, σ (3/2) ρ² → 1."""
    assert 1.5 * 10.0**2 * half_space.sigma(0.5, 10.0) == pytest.approx(1.0, abs=2e-3)


@given(a=st.floats(0, 5), rho=st.floats(0, 5), offset=st.floats(0, 5))
def test_reciprocity_of_pressure_and_sensor_discs(a: float, rho: float, offset: float) -> None:
    """A uniform pressure disc of radius a over a sensor disc of radius ρ equals the two exchanged."""
    from underskin.physics.hankel_transform import disc_average, normal_stress

    def transmission(k: np.ndarray) -> np.ndarray:
        return (1 + k) * np.exp(-k)

    forward = normal_stress(transmission, disc_average, a, rho, offset)
    backward = normal_stress(transmission, disc_average, rho, a, offset)
    assert forward == pytest.approx(backward, abs=1e-12)


def test_hertz_formulas_are_consistent() -> None:
    force, radius, modulus = 1.0, 4e-3, 16e6
    a = hertz.contact_radius(force, radius, modulus)
    load = hertz.load_parameter(force, radius, modulus)
    assert a / radius == pytest.approx(hertz.contact_radius_over_indenter_radius(load), rel=1e-13)
    assert hertz.peak_pressure(force, a) / modulus == pytest.approx(hertz.peak_pressure_over_modulus(load), rel=1e-13)
    r, w = np.polynomial.legendre.leggauss(200)
    r, w = a * (r + 1) / 2, a * w / 2
    total = float((2 * np.pi * r * w) @ hertz.pressure(r, force, a))
    assert total == pytest.approx(force, rel=1e-6)
    assert hertz.pressure(1.01 * a, force, a) == 0.0
