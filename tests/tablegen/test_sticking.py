"""The finite-element contact that sticks: the linear limit by integral equations, its history, and balance."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from tablegen.contact_column import press_spheres
from tests.support.grown_contacts import grown
from tests.support.sticking_punch import sticking_punch, sticking_spheres

RHO = np.array([0.2, 0.6, 1.2])


@pytest.mark.slow
def test_linear_contact_is_the_integral_equations() -> None:
    """Small strain, E' = 4 G: increments against a punch that sticks; force, depth and σ against a sum of them."""
    exact = sticking_spheres(1.3, RHO)
    of_edge = CubicSpline(exact.a, np.column_stack([exact.load / exact.a**3, exact.depth / exact.a**2, exact.sigma]))
    for a, sphere in zip((0.6, 1.2), grown([0.2, 0.6, 1.2], 1.2e4, RHO, 4)[1:], strict=True):
        punch = sticking_punch(a, RHO)
        assert sphere.stiffness == pytest.approx(punch.stiffness, rel=3e-4)
        assert sphere.sigma_increment == pytest.approx(punch.sigma, rel=3e-4)
        assert sphere.force_error == pytest.approx(0.0, abs=1e-6)
        found = sphere.force * sphere.radius / a**3, sphere.indentation * sphere.radius / a**2, *sphere.sigma
        assert found == pytest.approx(of_edge(a), rel=1e-3)


@pytest.mark.slow
def test_history_is_a_sum_of_increments() -> None:
    """One sphere, its contact growing: increments are slopes of force, depth and stress over the neighbouring edges;
    and half of the edges up to there give the same contact."""
    edges = [0.35, 0.7, *np.linspace(0.9, 1.1, 5).tolist()]
    spheres = grown(edges, 4.0, RHO, 4)[2:]
    middle = spheres[2]

    def slope(values: list[float] | np.ndarray) -> np.ndarray:
        return np.polynomial.polynomial.polyfit(np.array(edges[2:]) - 1, values, 4)[1]

    force = slope([sphere.force for sphere in spheres])
    assert middle.stiffness == pytest.approx(force / slope([sphere.indentation for sphere in spheres]), rel=1e-3)
    gained = slope(np.array([sphere.force * sphere.sigma for sphere in spheres])) / force
    assert middle.sigma_increment == pytest.approx(gained, rel=1e-3)
    coarse = grown([0.5, 1.0], 4.0, RHO, 4)[-1]
    assert coarse.force == pytest.approx(middle.force, rel=1e-3)
    assert coarse.sigma == pytest.approx(middle.sigma, rel=1e-3)


@pytest.mark.slow
def test_small_contact_does_not_feel_it() -> None:
    """On an incompressible half space nothing slips anyway: at small strain and a/h 0.05 force and stress are alike."""
    (slips,) = press_spheres(0.05, np.array([50.0]), RHO, 4)
    (sticks,) = grown([0.05], 50.0, RHO, 4)
    assert sticks.force == pytest.approx(slips.force, rel=1e-5)
    assert sticks.sigma == pytest.approx(slips.sigma, rel=1e-4)
