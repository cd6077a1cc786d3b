"""The contact table: an independent code, fresh solves, the linear limit, and what lies outside."""

import csv
import os
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from tablegen import linear_layer
from tablegen.contact_column import press_spheres
from tablegen.contact_interpolation import ContactInterpolation
from tests.support import felupe_contact
from tests.support.cases import first
from tests.support.oracle import NEEDS_ORACLE
from tests.support.sphere_contact import SphereOnLayer
from underskin import TableError
from underskin.physics import hertz
from underskin.physics.elastic_layer import Layer
from underskin.physics.hankel_transform import normal_stress
from underskin.surrogate.sigma_table import load_table, tables_folder

TABLE = ContactInterpolation(tables_folder() / "contact.h5")
RHO = [0.2, 0.6, 1.0]


@pytest.mark.slow
@pytest.mark.parametrize(("radius", "load"), first(1, [(1.6, 0.1), (4.0, 0.05), (1.6, 0.01), (0.5, 0.1)]))
def test_an_independent_code_finds_the_same_contact(radius: float, load: float) -> None:
    """FElupe at the table's indentation: the force (3 G = E), the contact radius to its mesh, and the stress."""
    contact = TABLE.contact(radius, load)
    force, a, sigma = felupe_contact.press(radius, float(contact.indentation_over_h), float(contact.a_over_h), RHO)
    assert force / (3 * radius**2) == pytest.approx(load, rel=1e-3)
    assert a == pytest.approx(float(contact.a_over_h), rel=0.03)
    assert TABLE.stress(radius, load, RHO).sigma == pytest.approx(sigma, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("a", "radius"), first(1, [(0.47, 1.3), (0.9, 5.3), (0.06, 0.7)]))
def test_fresh_solves_agree_within_the_reported_error(a: float, radius: float) -> None:
    (sphere,) = press_spheres(a, np.array([radius]), np.array(RHO), 5)
    load = sphere.cbrt_load**3
    contact, stress = TABLE.contact(radius, load), TABLE.stress(radius, load, RHO)
    assert abs(contact.a_over_h / sphere.contact_radius - 1) <= np.minimum(contact.a_error, 1e-5)
    assert abs(contact.indentation_over_h / sphere.indentation - 1) <= contact.indentation_error
    assert abs(contact.stiffness / (sphere.stiffness / 3) - 1) <= contact.stiffness_error
    assert (np.abs(stress.sigma - sphere.sigma) <= stress.sigma_error).all()
    assert (np.abs(stress.sigma_increment - sphere.sigma_increment) <= stress.sigma_increment_error).all()


@NEEDS_ORACLE
def test_small_loads_meet_the_exact_linear_contact() -> None:
    with (Path(os.environ["UNDERSKIN_ORACLE"]) / "sphere_on_layer.csv").open(newline="") as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    columns = {name: np.array([1.0, *(row[name] for row in rows)]) for name in rows[0]}
    columns["a_over_h"][0] = 0.0
    load = 1e-8  # a/R 0.002
    for radius in (1.0, 3.0, 8.0):
        found = TABLE.contact(radius, load)
        force, depth, stiffness = (
            float(CubicSpline(columns["a_over_h"], columns[name])(found.a_over_h))
            for name in ("force_over_hertz", "indentation_r_over_a2", "stiffness_over_hertz")
        )
        a = float(found.a_over_h)
        assert 16 / 9 * a**3 / radius**3 * force == pytest.approx(load, rel=1e-3)
        assert found.indentation_over_h * radius / a**2 == pytest.approx(depth, rel=1e-3)
        assert found.stiffness / (2 * a / 0.75) == pytest.approx(stiffness, rel=1e-3)


def test_stiffness_is_the_slope_of_force_over_indentation() -> None:
    radius, load = np.array([0.5, 1.1, 3.0, 8.0]), 0.05
    low, high = (TABLE.contact(radius, load * f) for f in (0.99, 1.01))
    slope = 0.02 * load * radius**2 / (high.indentation_over_h - low.indentation_over_h)
    assert TABLE.contact(radius, load).stiffness == pytest.approx(slope, rel=1e-3)


def test_sigma_increment_is_the_derivative_of_the_stress() -> None:
    radius, load = np.array([0.7, 2.0, 6.0])[:, None], 0.03
    low, high = (TABLE.stress(radius, load * f, RHO).sigma * f for f in (0.99, 1.01))
    assert TABLE.stress(radius, load, RHO).sigma_increment == pytest.approx((high - low) / 0.02, rel=1e-3)


def test_no_load_is_hertz_and_a_point_force() -> None:
    assert TABLE.contact(2.0, 0.0).a_over_h == 0.0
    assert TABLE.stress(2.0, 0.0, RHO).sigma == pytest.approx(linear_layer.gamma_n(0.0, np.array(RHO)), rel=1e-6)


def test_a_small_contact_is_the_sigma_tables() -> None:
    """At a/h 0.1 the layer is a half space to the sphere: its pressure is Hertz's but for finite strain."""
    load = 1e-3
    radius = 0.1 / float(hertz.contact_radius_over_indenter_radius(load))
    prescribed = load_table().sigma(0.1, RHO, load).sigma
    assert TABLE.stress(radius, load, RHO).sigma == pytest.approx(prescribed, rel=5e-3)


@pytest.mark.parametrize(("load", "most"), [(0.001, 0.006), (0.01, 0.013), (0.1, 0.03)])
def test_finite_strain_adds_little_beneath_a_sphere(load: float, most: float) -> None:
    """Less than under Hertz' pressure as a dead load; what README.md and the findings of /v1/stress say."""
    rho = np.array([0.05, 0.2, 0.6, 1.2, 3.0])
    for radius in np.geomspace(0.5, 8, 7):
        contact = SphereOnLayer(radius, 1.0, 1.0, Layer()).at_force(load * radius**2)
        pressure = contact.pressure_transform
        linear = normal_stress(linear_layer.transmission, pressure, contact.contact_radius, rho) / contact.force
        added = TABLE.stress(radius, load, rho).sigma / linear - 1
        assert np.abs(added).max() < 1.02 * most


def test_reported_errors_and_the_balance_of_forces() -> None:
    assert TABLE.attributes["force_balance_error"] < 1e-5
    contact = TABLE.contact(np.geomspace(0.5, 8, 40)[:, None], np.linspace(1e-4, 0.1, 40))
    for error in (contact.a_error, contact.indentation_error, contact.stiffness_error):
        assert error.min() > 0
        assert error.max() < 1e-3


def test_outside_the_domain_is_nan_and_spoils_nothing() -> None:
    answer = TABLE.contact([2.0, 0.4, 8.1, 2.0, -1.0, np.nan], [0.01, 0.01, 0.01, 0.11, 0.01, 0.01])
    assert answer.inside.tolist() == [True, False, False, False, False, False]
    assert np.isfinite(answer.a_over_h).tolist() == answer.inside.tolist()
    assert answer.stiffness[0] == TABLE.contact(2.0, 0.01).stiffness
    assert np.isnan(TABLE.stress(2.0, 0.01, 3.1).sigma)
    assert TABLE.stress(np.full((3, 1), 2.0), 0.01, np.full(4, 0.6)).sigma.shape == (3, 4)


def test_a_table_that_lacks_a_dataset_is_refused(tmp_path: Path) -> None:
    path = Path(shutil.copy(tables_folder() / "contact.h5", tmp_path))
    with h5py.File(path, "r+") as file:
        del file["stress/sigma_error"]
    with pytest.raises(TableError, match="was altered"):
        ContactInterpolation(path)


def test_the_shipped_tables_are_small() -> None:
    assert sum(path.stat().st_size for path in tables_folder().glob("*.h5")) < 15e6
