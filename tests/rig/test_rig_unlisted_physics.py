"""The bench's physics against exact values and identities."""

import numpy as np
import pytest

from rig.unlisted.layer import (
    finite_strain_shift,
    hertz_pressure,
    hertz_radius,
    hertz_transform,
    sigma,
    stiffness_ratio,
    transfer,
)
from rig.unlisted.response import REFERENCE_HZ, MinimumPhase, frequency_law
from tests.support.oracle import linear_layer_values, sphere_rows


def test_sigma_against_the_exact_layer() -> None:
    rho, a, e, exact = linear_layer_values("sigma_hertz")
    assert len(a) > 200
    np.testing.assert_allclose(sigma(a, rho, e), exact, atol=5e-8)


def test_stiffness_against_the_exact_sphere() -> None:
    a, exact = (np.array([row[name] for row in sphere_rows()]) for name in ("a_over_h", "stiffness_over_hertz"))
    np.testing.assert_allclose(stiffness_ratio(a), exact, rtol=1e-6)


def test_pressure_integrates_to_the_force() -> None:
    a, force = 0.7, 1.3
    t, w = np.polynomial.legendre.leggauss(200)
    r = 0.5 * a * (t + 1.0)
    assert np.sum(0.5 * a * w * 2.0 * np.pi * r * hertz_pressure(r, a, force)) == pytest.approx(force, rel=1e-6)
    assert hertz_transform(np.zeros(1))[0] == 1.0
    k, m = transfer()
    assert m[0] == pytest.approx(1.0, abs=k[0])


@pytest.mark.parametrize(("a", "rho"), [(0.05, 0.1), (0.5, 0.6), (1.0, 1.0)])
def test_base_carries_the_whole_force(a: float, rho: float) -> None:
    """The mean over a disc, taken over the whole plane, is the force: 3 int sigma e de = 1."""
    t, w = np.polynomial.legendre.leggauss(200)
    e = 6.0 * (t + 1.0)
    total = 3.0 * np.sum(6.0 * w * e * sigma(np.full(e.size, a), rho, e))
    assert total == pytest.approx(1.0, abs=3e-4)


def test_hertz_and_its_exponents() -> None:
    a = hertz_radius(np.array([1.0, 8.0, 1.0]), np.array([4.0, 4.0, 32.0]), 16.0)
    np.testing.assert_allclose(a**3, [9.0 * 4.0 / 256.0, 8 * 9.0 * 4.0 / 256.0, 9.0 * 32.0 / 256.0])
    assert a[1] == pytest.approx(2.0 * a[0])
    assert a[2] == pytest.approx(2.0 * a[0])


def test_finite_strain_estimate_vanishes_with_the_load() -> None:
    assert float(finite_strain_shift(np.array([1e-9]), np.array([10.0]), 16.0)[0]) < 1e-4
    assert float(finite_strain_shift(np.array([1.6]), np.array([10.0]), 16.0)[0]) == pytest.approx(0.01285, abs=1e-4)


@pytest.mark.parametrize(
    ("form", "p"),
    [
        ("power", [0.05]),
        ("exponential", [0.3]),
        ("saturating", [0.4, np.log(20.0)]),
        ("threshold", [-0.3, np.log(40.0)]),
        ("peak", [2.0, np.log(60.0), np.log(0.1)]),
        ("peak", [-0.6, np.log(60.0), np.log(0.2)]),
    ],
)
def test_closed_forms_are_minimum_phase(form: str, p: list[float]) -> None:
    """Bode's relation, applied to the magnitude alone, gives the phase of the closed form."""
    f = np.geomspace(1.0, 400.0, 25)
    phase = MinimumPhase(f)
    closed = frequency_law(form, np.array(p), phase)
    wide = MinimumPhase(phase.grid_hz)
    scale = np.sqrt(wide.frequency_hz[-1] / f[-1]) if form == "exponential" else 1.0
    magnitude = np.log(np.abs(frequency_law(form, np.array([p[0] * scale, *p[1:]]), wide)))
    rebuilt = phase(lambda g: np.interp(np.log(g), np.log(phase.grid_hz), magnitude))
    np.testing.assert_allclose(np.angle(rebuilt), np.angle(closed), atol=0.02)


def test_echo_is_minimum_phase() -> None:
    """1 + r e^(-i w T) has no zero in the right half plane for |r| < 1: its phase returns to zero with each period."""
    f = np.linspace(1.0, 400.0, 1001)
    h = frequency_law("periodic", np.array([0.3, np.log(50.0)]), MinimumPhase(f))
    assert np.abs(np.angle(h)).max() == pytest.approx(np.arcsin(0.3), rel=1e-3)


def test_sign_of_the_phase() -> None:
    f = np.geomspace(1.0, 400.0, 20)
    phase = MinimumPhase(f)
    assert (np.angle(frequency_law("threshold", np.array([-0.5, np.log(30.0)]), phase)) < 0.0).all()
    assert (np.angle(frequency_law("power", np.array([0.1]), phase)) > 0.0).all()
    assert (np.angle(frequency_law("exponential", np.array([0.2]), phase)) < 0.0).all()
    at_reference = frequency_law("power", np.array([0.1]), MinimumPhase(np.array([1.0, REFERENCE_HZ])))
    assert abs(at_reference[1]) == pytest.approx(1.0)


def test_step_lags_where_it_falls() -> None:
    f = np.geomspace(1.0, 400.0, 60)
    h = frequency_law("step", np.array([-0.2, np.log(20.0)]), MinimumPhase(f))
    assert np.abs(h[0]) == pytest.approx(1.0, abs=1e-3)
    assert np.log(np.abs(h[-1])) == pytest.approx(-0.2, abs=1e-3)
    assert np.angle(h).min() < -0.1
    assert f[np.argmin(np.angle(h))] == pytest.approx(20.0, rel=0.15)
