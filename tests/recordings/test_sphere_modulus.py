"""E of an indentation by the law that its geometry declares, and none where no law of a sphere holds."""

from collections.abc import Callable

import numpy as np
import pytest

from tests.support.sphere_curves import campaign, hertz, pressed, ways
from underskin.errors import InvalidInput
from underskin.inversion.elastomer import of_campaign
from underskin.physics.elastic_layer import CurveGrid, Layer
from underskin.recordings.campaign import Campaign
from underskin.recordings.modulus import IndentationModulus
from underskin.units import Floats

pytestmark = pytest.mark.slow


def whole_sphere(radius_mm: float) -> Callable[[Floats], Floats]:
    """Sneddon's law of a sphere on a half space of 1 MPa [N of mm], by its own table."""
    a = radius_mm * np.linspace(0.0, 0.999, 5000)
    depth = a * np.arctanh(a / radius_mm)
    force = 4 / 3 * ((a**2 + radius_mm**2) * np.arctanh(a / radius_mm) - a * radius_mm)
    return lambda at: np.interp(at, depth, force)


def bonded_layer(thickness_mm: float, radius_mm: float) -> Callable[[Floats], Floats]:
    """The exact linear layer of 1 MPa, incompressible [N of mm]."""
    alpha = np.linspace(1e-6, 3.9, 4000)
    force, depth, *_ = CurveGrid(np.ones(1)).curves(Layer(0.5)).ratios_at(alpha).T
    deep = alpha**2 * thickness_mm**2 / radius_mm * depth
    return lambda at: np.interp(at, deep, 16 / 9 * alpha**3 * thickness_mm**3 / radius_mm * force)


def result(read: Campaign) -> IndentationModulus:
    (found,) = of_campaign(read)
    assert isinstance(found.result, IndentationModulus), found.result
    return found.result


def refusal(read: Campaign) -> str:
    (found,) = of_campaign(read)
    assert isinstance(found.result, InvalidInput)
    return str(found.result)


@pytest.mark.parametrize("depth_mm", [0.1, 0.25])
def test_a_declared_thickness_gives_the_layers_law(depth_mm: float) -> None:
    depth = ways(-0.05, depth_mm, samples=400)
    force = pressed(depth, bonded_layer(2.0, 2.0))
    found = result(campaign(depth, force, skin={"thickness_mm": 2.0}))
    assert found.modulus == pytest.approx(1e6, rel=0.01)
    assert abs(found.modulus - 1e6) < 2 * found.uncertainty
    assert f"{depth_mm / 2:.2g} of the thickness" in found.statement
    on_half_space = result(campaign(depth, force))  # which nobody declared otherwise
    assert on_half_space.modulus > 1.3e6
    assert "times the noise: the law is incomplete" in on_half_space.statement
    assert "times the noise" not in found.statement


@pytest.mark.parametrize("over_radius", [0.6, 1.5])
def test_a_sphere_pressed_deep_is_no_paraboloid(over_radius: float) -> None:
    depth = ways(-0.1, 0.2 * over_radius, -0.1, samples=400)
    read = campaign(depth, pressed(depth, whole_sphere(0.2)), indenter_radius_mm=0.2)
    found = result(read)
    assert found.modulus == pytest.approx(1e6, rel=0.01)
    assert abs(found.modulus - 1e6) < 2 * found.uncertainty
    assert f"pressed {over_radius:.2g} of the radius" in result(read).statement


@pytest.mark.parametrize("noise", [1e-3, 1e-2, 2e-2])
@pytest.mark.parametrize("skin", [{}, {"thickness_mm": 30.0, "youngs_modulus_mpa": 1.0}])
@pytest.mark.parametrize(("power", "radius_mm", "like"), [(1.0, 1.0, "flat punch"), (2.0, 5.0, "cone")])
def test_tip_no_sphere_gives_no_modulus(
    power: float, radius_mm: float, like: str, skin: dict[str, float], noise: float
) -> None:
    """A tip that is no sphere gives no modulus, whatever the noise of the force.

    The force follows another power of the depth than a sphere's.
    """
    depth = ways(-0.1, 0.3, -0.1, samples=400)
    force = pressed(depth, lambda at: at**power, noise=noise)
    assert like in refusal(campaign(depth, force, indenter_radius_mm=radius_mm, skin=skin))


@pytest.mark.parametrize("seed", range(4))
def test_noise_makes_no_other_tip(seed: int) -> None:
    """A sphere stays one under noise of 5 % of the force."""
    depth = ways(-0.1, 0.3, samples=200)
    read = campaign(depth, pressed(depth, seed=seed, noise=0.05))
    assert result(read).modulus == pytest.approx(1e6, rel=0.1)


def test_beyond_a_law_no_modulus_is_quoted() -> None:
    depth = ways(-0.1, 0.3, samples=400)
    deep = refusal(campaign(depth, pressed(depth, lambda at: at**2), indenter_radius_mm=0.02))
    assert "times the declared radius" in deep
    thin = refusal(campaign(depth, pressed(depth, bonded_layer(0.4, 2.0)), skin={"thickness_mm": 0.4}))
    assert "of the declared thickness" in thin


def test_adhesion_creep_and_stiffening_leave_a_sphere_a_sphere() -> None:
    """What a sphere's force usually shows beside Hertz's law is no other tip."""
    depth = ways(-0.1, 0.3, samples=400)
    sticks = pressed(depth) - 0.05 * (depth > 0)
    stiffens = pressed(depth, lambda at: hertz(at) * (1 + 0.8 * np.sqrt(at / 0.3)))
    for force in (sticks, stiffens):
        assert result(campaign(depth, force)).modulus > 0
