"""The exact linear layer against independent values (good to about 2e-8) and its limits."""

import numpy as np
import pytest

from tablegen import linear_layer
from tests.support.oracle import linear_layer_values
from underskin.physics import half_space
from underskin.physics.hankel_transform import normal_stress, punch_transform


def test_reference_values() -> None:
    a = [0.289, 0.3, 0.6, 1.0, 2.0]
    rho = [0.2, 0.6, 0.6, 0.6, 0.6]
    assert linear_layer.sigma(a, rho) == pytest.approx([1.35506, 0.936505, 0.799567, 0.568500, 0.209139], abs=6e-6)
    assert linear_layer.sigma(0.0, 0.0) == pytest.approx(1.57096, abs=5e-6)
    assert linear_layer.gamma_n([0, 0.5, 1, 2], 0.6) == pytest.approx(
        [0.988193, 0.669810, 0.193228, 0.002007], abs=1e-6
    )


def test_half_space_error_falls_with_the_depth_of_the_substrate() -> None:
    """At (0.289, 0.2) in units of the sensor's depth, with the substrate at the sensor: −34.7 %."""
    error = half_space.sigma(0.289, 0.2) / linear_layer.sigma(0.289, 0.2) - 1
    assert error == pytest.approx(-0.347, abs=5e-4)


def test_sigma_equals_the_oracle() -> None:
    rho, a, offset, value = linear_layer_values("sigma_hertz")
    assert len(value) > 100
    assert linear_layer.sigma(a, rho, offset) == pytest.approx(value, abs=3e-8)


def test_influence_of_a_point_force_equals_the_oracle() -> None:
    rho, _, offset, value = linear_layer_values("gamma_n")
    assert len(value) > 10
    assert linear_layer.gamma_n(offset, rho) == pytest.approx(value, abs=3e-8)


def test_the_moving_edge_increment_is_a_flat_punch() -> None:
    """σ + (a/3) ∂σ/∂a equals the stress under the flat punch's pressure (Johnson 1985, section 3.4)."""
    rho, a, offset, value = linear_layer_values("sigma_edge")
    punch = normal_stress(linear_layer.transmission, punch_transform, a, rho, offset)
    assert punch == pytest.approx(value, abs=3e-8)


def test_the_base_carries_the_whole_force() -> None:
    for a in (0.1, 1.0, 3.0):
        assert 1.5 * 30.0**2 * linear_layer.sigma(a, 30.0) == pytest.approx(1.0, abs=1e-6)


def test_shapes_broadcast() -> None:
    assert linear_layer.sigma(np.ones((3, 1)), np.ones(4)).shape == (3, 4)
    assert linear_layer.sigma(0.5, 0.5).shape == ()
