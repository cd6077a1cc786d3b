"""Charge, FRF and d33."""

import numpy as np
import pytest

from underskin.physics import charge_response


def test_frf_is_the_paper_s_and_d33_inverts_it() -> None:
    d33, sigma, rho = 14e-12, np.array([0.93, 0.5]), 0.6
    frf = charge_response.frf(d33, sigma, rho)
    assert frf == pytest.approx(d33 * 1.5 * rho**2 * sigma, rel=1e-15)
    value, uncertainty = charge_response.d33(frf, 0.02 * frf, sigma, 0.0, rho)
    assert value == pytest.approx([d33, d33], rel=1e-14)
    assert uncertainty == pytest.approx(0.02 * value, rel=1e-14)


def test_uncertainties_add_in_quadrature_and_have_no_sign() -> None:
    value, uncertainty = charge_response.d33(-1e-12, 3e-14, 0.9, 4e-2, 0.6)
    assert value < 0
    assert uncertainty == pytest.approx(abs(value) * 0.05, rel=1e-12)


def test_a_wide_sensor_collects_d33_times_the_force() -> None:
    """σ → 2/(3ρ²) when the sensor catches all of the force."""
    rho = 100.0
    assert charge_response.frf(14e-12, 2 / (3 * rho**2), rho) == pytest.approx(14e-12, rel=1e-15)


def test_mean_stress_is_the_charge_over_d33_and_area() -> None:
    h, rt, force, sigma, d33 = 2.5e-3, 1.5e-3, 2.0, 0.9, 14e-12
    charge = force * charge_response.frf(d33, sigma, rt / h)
    assert charge_response.mean_stress(force, sigma, h) == pytest.approx(charge / d33 / (np.pi * rt**2), rel=1e-14)
