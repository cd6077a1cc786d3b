"""The finite-element contact: the exact linear limit, balance, contact conditions, and increments as the edge moves."""

import numpy as np
import pytest

from tablegen import linear_layer
from tablegen.base_stress import BaseStress
from tablegen.contact import ContactLayer
from tablegen.contact_column import SphereSolution, press_spheres
from tablegen.contact_mesh import contact_mesh
from tablegen.discretisation import discretise
from tests.support.cases import first
from tests.support.oracle import sphere_rows
from underskin import SolverError

RHO = np.array([0.0, 0.2, 0.6, 1.0, 3.0])


def hertz_ratios(sphere: SphereSolution, a: float) -> list[float]:
    """F, δ and dF/dδ over Hertz's for the contact radius a, in the oracle's manner; E' = 4 G."""
    hertz = 16 / 3 * a**3 / sphere.radius
    return [sphere.force / hertz, sphere.indentation * sphere.radius / a**2, sphere.stiffness / (8 * a)]


@pytest.mark.slow
@pytest.mark.parametrize("a", first(1, [1.0, 0.05, 0.3, 2.0]))
def test_the_small_load_limit_is_the_exact_linear_contact(a: float) -> None:
    """Two small a/R, extrapolated to 0; force, indentation and stiffness."""
    (row,) = [row for row in sphere_rows() if row["a_over_h"] == a]
    exact = [row[name] for name in ("force_over_hertz", "indentation_r_over_a2", "stiffness_over_hertz")]
    first, second = (np.array(hertz_ratios(s, a)) for s in press_spheres(a, a / np.array([1e-3, 2e-3]), RHO, 5))
    assert 2 * first - second == pytest.approx(exact, rel=2e-4)


@pytest.mark.slow
def test_stress_under_a_small_contact_is_the_exact_layers() -> None:
    """For a/h → 0 the pressure is Hertz's, and its increment that of a flat punch: a point force for the sensors."""
    (sphere,) = press_spheres(0.02, np.array([20.0]), RHO, 4)
    assert sphere.sigma == pytest.approx(linear_layer.sigma(0.02, RHO), rel=3e-4)
    assert sphere.sigma_increment == pytest.approx(linear_layer.gamma_n(0.0, RHO), rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("a", "radius"), first(1, [(1.0, 3.0), (0.1, 0.25)]))
def test_contact_conditions_hold(a: float, radius: float) -> None:
    """On the sphere inside the edge, off it outside, pressure throughout, volume kept, and the base bears it all."""
    layer = ContactLayer(discretise(contact_mesh(a), 5), a)
    now = layer.untouched()
    for strain in (0.5 * a / radius, a / radius):
        now = layer.press(now, a / strain)
    inside, outside = np.linspace(0, 0.999 * a, 50), a * np.array([1.001, 1.01, 1.1, 1.5])

    def gap(r: np.ndarray) -> np.ndarray:
        places = layer.surface(now, r) - [0.0, 1 + radius - now.indentation]
        return np.asarray(np.hypot(*places.T) - radius)

    assert np.abs(gap(inside)).max() < 1e-5 * now.indentation
    assert (gap(outside) > 0).all()
    assert (np.diff(gap(outside)) > 0).all()
    pressure = layer.pressure(now)
    assert pressure.min() > 0
    assert pressure[-1].max() < 0.1 * pressure.max()
    base = BaseStress(layer.discretisation)
    total = base.total_force(base.at_points(layer.internal_force(now.state)))
    assert total == pytest.approx(layer.force(now, radius), rel=1e-6)
    assert layer.volume_change(now.state) < 1e-6


@pytest.mark.soak
def test_increments_are_the_slopes_over_neighbours_whose_edges_differ() -> None:
    """One sphere at contact edges of 0.85 to 1.15, each on its own mesh: dF/dδ and d(Fσ)/dF at fixed R. The table's
    increments are those slopes in every run (tests/surrogate/test_contact_table.py)."""
    edges = np.linspace(0.85, 1.15, 7)
    spheres = [press_spheres(a, np.array([4.0]), RHO, 4)[0] for a in edges]
    middle = spheres[3]

    def slope(values: list[float] | np.ndarray) -> np.ndarray:
        return np.polynomial.polynomial.polyfit(edges - 1, values, 4)[1]

    force = slope([sphere.force for sphere in spheres])
    assert middle.stiffness == pytest.approx(force / slope([sphere.indentation for sphere in spheres]), rel=3e-4)
    gained = slope(np.array([sphere.force * sphere.sigma for sphere in spheres])) / force
    assert middle.sigma_increment == pytest.approx(gained, rel=3e-4)


@pytest.mark.slow
def test_a_sphere_out_of_reach_names_the_point() -> None:
    with pytest.raises(SolverError, match=r"contact edge 1 h, R = "):
        press_spheres(1.0, np.array([0.3]), RHO, 2)
