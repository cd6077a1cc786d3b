"""The base model and the mechanisms of the layer and the sphere's place, against exact limits, independent values."""

from dataclasses import replace

import numpy as np
import pytest

from tests.mechanisms.mechanism_contacts import LINEAR_MM, RHO, E, H, level, linear_contact
from tests.support.mechanism_campaigns import SKIN, campaign, frf_recording, predicted, table
from tests.support.oracle import layer_rows
from tests.support.yielding_bodies import REDUCED, WAVE_NUMBERS, film_strain, layer, press, transmitted
from underskin.physics import charge_response, hertz
from underskin.physics.elastic_layer import Layer
from underskin.physics.hankel_transform import hertz_transform, normal_stress
from underskin.surrogate.off_centre_sigma import positioned_sigma


def test_the_base_model_is_the_table_at_hertz_radius() -> None:
    for preload, radius in ((0.5, 4.0), (2.0, 10.0)):
        a = hertz.contact_radius(preload, radius * 1e-3, E)
        load = hertz.load_parameter(preload, radius * 1e-3, E)
        expected = charge_response.frf(14e-12, table().sigma(a / H, RHO, load).sigma, RHO)
        found = predicted([], campaign([frf_recording(preload_n=preload, indenter_radius_mm=radius)]), d33=14.0)
        assert found == pytest.approx(np.full(len(found), complex(expected)), rel=1e-5)


def test_the_base_model_beside_the_sensor_is_the_profile_averaged_over_its_disc() -> None:
    a, load = hertz.contact_radius(1.0, 4e-3, E), hertz.load_parameter(1.0, 4e-3, E)
    for offset_mm in (0.7, 2.0, 4.5):
        e = np.array([offset_mm * 1e-3 / H])
        expected = positioned_sigma(table(), np.array([a / H]), RHO, np.array([load]), e, 0.01).sigma[0]
        found = level([], frf_recording(position_mm=(0.0, offset_mm)))
        assert found.real == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize("poisson_ratio", ["0.48", "0.45", "0.4", "0.3"])
def test_a_compressible_layer_transmits_as_the_exact_one(poisson_ratio: str) -> None:
    rows = layer_rows("sigma_hertz", poisson_ratio=poisson_ratio, glue_stiffness_h_over_2g="inf", rt_over_h="0.6")
    assert rows
    for row in rows:
        a, nu = float(row["a_over_h"]), float(poisson_ratio)
        if a <= 2:
            recording = linear_contact(a, nu, float(row["offset_over_h"]))
            found = level(["compressible_layer"], recording, poisson_ratio=nu)
            assert found.real == pytest.approx(float(row["value"]), abs=2e-5)


@pytest.mark.parametrize("glue", ["10.0", "1.0"])
def test_a_yielding_glue_line_transmits_as_the_exact_one(glue: str) -> None:
    rows = layer_rows("sigma_hertz", poisson_ratio="0.5", glue_stiffness_h_over_2g=glue, rt_over_h="0.6")
    assert rows
    for row in rows:
        a = float(row["a_over_h"])
        if a <= 2:
            recording = linear_contact(a, offset_over_h=float(row["offset_over_h"]))
            found = level(["interface_slip"], recording, glue_stiffness=2 * float(glue))
            assert found.real == pytest.approx(float(row["value"]), abs=2e-5)


def test_finite_strain_stays_when_the_layer_changes() -> None:
    recording = frf_recording(preload_n=2.0)
    a, load = hertz.contact_radius(2.0, 4e-3, E), hertz.load_parameter(2.0, 4e-3, E)
    extra = table().sigma(a / H, RHO, load).sigma - table().sigma(a / H, RHO, 0.0).sigma
    glued = normal_stress(lambda k: Layer(0.5, 0.5).transmission(k).value, hertz_transform, a / H, RHO)
    found = level(["interface_slip"], recording, glue_stiffness=1.0)
    assert found.real == pytest.approx(float(glued + extra), rel=1e-5)


def test_a_wrong_modulus_or_thickness_is_the_declared_one_changed() -> None:
    recording = frf_recording(position_mm=(1.0, 0.5))
    softer = level([], recording, replace(SKIN, youngs_modulus_mpa=1.4))
    assert level(["modulus_error"], recording, modulus_factor=0.7) == pytest.approx(softer, rel=1e-6)
    thinner = level([], recording, replace(SKIN, thickness_mm=2.0))
    found = level(["thickness_error"], recording, thickness_factor=0.8) * 0.8**2
    assert found == pytest.approx(thinner, rel=2e-5)


def test_misalignment_is_a_moved_position() -> None:
    moved = level([], frf_recording(position_mm=(1.3, -0.2)))
    found = level(["misalignment"], frf_recording(position_mm=(0.8, 0.1)), offset_x=0.5, offset_y=-0.3)
    assert found == pytest.approx(moved, rel=1e-6)


def test_where_every_press_is_centred_misalignment_has_a_length_only() -> None:
    moved = level([], frf_recording(position_mm=(0.0, 0.9)))
    assert level(["misalignment"], frf_recording(), offset=0.9) == pytest.approx(moved, rel=1e-6)


def test_neighbours_tell_in_which_direction_a_centred_press_is_misaligned() -> None:
    names = ["misalignment", "crosstalk"]
    for sensor, (x, y) in {"s1": (0.0, 0.0), "s2": (4.0, 0.0)}.items():
        moved = level(["crosstalk"], frf_recording(sensor=sensor, position_mm=(x - 0.4, y + 0.7)), fraction=0.2)
        centred = frf_recording(sensor=sensor, position_mm=(x, y))
        assert level(names, centred, offset_x=-0.4, offset_y=0.7, fraction=0.2) == pytest.approx(moved, rel=1e-6)
        other = level(names, centred, offset_x=0.4, offset_y=0.7, fraction=0.2)
        assert abs(other / moved - 1) > 0.005


@pytest.mark.parametrize(("a_over_h", "lag_over_h"), [(0.3, 0.05), (0.9, 0.2), (0.9, 0.8)])
def test_film_stretched_on_its_glue(a_over_h: float, lag_over_h: float) -> None:
    """The charge by stretch is that of a membrane solved by finite differences."""
    shape = np.asarray(hertz_transform(WAVE_NUMBERS * a_over_h))
    per_strain = 0.4 * 1.35 * H / 0.05e-3
    expected = transmitted(layer()[0] * shape, RHO) + per_strain * film_strain(shape, RHO, lag_over_h)
    found = level(["film_shear"], linear_contact(a_over_h), shear_lag=1e3 * lag_over_h * H, lateral_ratio=0.4)
    assert found.real == pytest.approx(expected, rel=3e-5)


@pytest.mark.parametrize(("depth", "ratio"), [(0.002, 1.0), (0.02, 0.5), (0.02, 4.0)])
def test_a_tip_that_yields_presses_the_layer_as_rings_of_pressure_on_both_bodies_do(depth: float, ratio: float) -> None:
    force, shape = press(50.0, depth, 1 / ratio)
    modulus = E / 0.75
    preload = 50.0 * force / REDUCED * modulus * H**3 / (LINEAR_MM * 1e-3)
    recording = frf_recording(indenter_radius_mm=LINEAR_MM, preload_n=preload, dynamic_force_n=preload / 1e3)
    found = level(["layered_contact", "elastic_tip"], recording, modulus_ratio=ratio)
    assert found.real == pytest.approx(transmitted(layer()[0] * shape, RHO), rel=2e-4)


def test_tip_yields_on_a_half_space() -> None:
    """There it is a rigid sphere, larger by the skin's share of what yields, at finite strain too."""
    larger = level([], frf_recording(indenter_radius_mm=6.0, preload_n=2.0))
    found = level(["elastic_tip"], frf_recording(indenter_radius_mm=4.0, preload_n=2.0), modulus_ratio=2.0)
    assert found == pytest.approx(larger, rel=1e-6)
