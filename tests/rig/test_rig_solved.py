"""The solved contact against exact results of the linear layer (PHYSICS.md, section 5) and against itself."""

import numpy as np
import pytest

from rig.solved.charge import inside
from rig.solved.layer import Material, PressedLayer, Sublayer

pytestmark = pytest.mark.slow

_BONDED = (Sublayer(1.0, Material()),)
EXACT = [(0.1, 1.0008, 0.9258), (0.3, 1.0197, 0.7945), (1.0, 1.4105, 0.5594), (2.0, 2.5981, 0.4549)]


def _pressed(a: float, depth: float, fineness: float = 1.0) -> tuple[PressedLayer, float]:
    """A sphere of radius 50 a, at depth·a²/R, and its force over that of Hertz at radius a."""
    radius = 50 * a
    layer = PressedLayer(_BONDED, radius, a, fineness)
    force = layer.press(depth * a * a / radius)
    return layer, force / (16 / 9 * a**3 / radius)


@pytest.mark.parametrize(("a", "force", "depth"), EXACT)
def test_force_radius_and_balance(a: float, force: float, depth: float) -> None:
    """At small strain the force at a depth is exact to 0.3 %, the radius to 1.5 %, and the base bears the force."""
    layer, found = _pressed(a, depth)
    assert found == pytest.approx(force, rel=3e-3)
    assert layer.contact_radius() == pytest.approx(a, rel=1.5e-2)
    assert layer.reaction.sum() == pytest.approx(found * 16 / 9 * a**2 / 50, rel=1e-5)


def test_mesh() -> None:
    """A finer mesh changes force and mean stress by less than 0.1 %."""
    r = np.linspace(0, 0.6, 601)
    coarse, fine = (_pressed(1.0, 0.5594, fineness) for fineness in (1.0, 1.5))
    assert coarse[1] == pytest.approx(fine[1], rel=1e-3)
    mean = [np.trapezoid(r * layer.base_pressure(r), r) for layer, _ in (coarse, fine)]
    assert mean[0] == pytest.approx(mean[1], rel=1e-3)


def test_disc_beside() -> None:
    """The share of circles inside a disc integrates to the disc's area, centred or beside the axis."""
    r = np.linspace(0, 3, 30001)
    for offset in (0.0, 0.3, 1.4):
        area = np.trapezoid(inside(r, 0.6, offset) * 2 * np.pi * r, r)
        assert area == pytest.approx(np.pi * 0.36, rel=1e-3)
