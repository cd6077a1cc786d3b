"""The contact table: an independent code, fresh solves off its nodes, the linear limit, and what is refused."""

import shutil
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.interpolate import RectBivariateSpline

from bench.soak import SOAK
from tablegen.contact_column import RADII, press_spheres
from tablegen.linear_contact import LinearContact
from tests.support import felupe_contact
from tests.support.cases import first
from underskin import TableError
from underskin.physics import hertz
from underskin.surrogate.hdf5_format import ContactTable, load_contact, tables_folder
from underskin.surrogate.sigma_table import load_table
from underskin.units import Floats

RHO = np.array([0.05, 0.2, 0.6, 1.0, 1.5, 3.0])
EDGES = np.array([0.03, 0.13, 0.37, 0.86, 1.7, 2.55]) if SOAK else np.array([0.37])
STRAINS = np.array([0.2, 0.35, 0.6, 0.8, 0.97]) if SOAK else np.array([0.9])


@dataclass(frozen=True)
class Contact:
    """What linear contact and table together say; lengths in thicknesses, stresses in G."""

    a: float
    indentation: float
    stiffness: float
    linear_sigma: Floats  # (RHO,)
    sigma: Floats


class Contacts:
    """Linear contact and table, which is interpolated by cubic splines over (a/h, L^(1/3))."""

    def __init__(self, table: ContactTable) -> None:
        x, w = np.polynomial.legendre.leggauss(24)
        t = (1 + x) / 2
        means = [(table.profile_over(rho * t) * (w * t)).sum(axis=-1) for rho in RHO]
        ratios = (table.contact_radius, table.indentation, table.stiffness)
        self._linear = LinearContact(np.zeros(1), RHO)
        self._splines = [RectBivariateSpline(*table.contact_axes, values) for values in (*ratios, *means)]

    def at(self, force: float, radius: float) -> Contact:
        linear = self._linear.sphere(force, radius)
        x = np.cbrt(hertz.load_parameter(force, radius, 3.0))
        a, indentation, stiffness, *added = (
            float(spline(np.array([linear.alpha]), np.array([x]))[0, 0]) for spline in self._splines
        )
        sigma = self._linear.sigma(linear.alpha)
        return Contact(
            a * linear.alpha,
            indentation * linear.indentation,
            stiffness * linear.stiffness,
            sigma,
            sigma + np.array(added),
        )


@pytest.fixture(scope="module")
def table() -> ContactTable:
    return load_contact()


@pytest.fixture(scope="module")
def contacts(table: ContactTable) -> Contacts:
    return Contacts(table)


@pytest.mark.slow
@pytest.mark.parametrize(("radius", "load"), first(1, [(1.6, 0.21), (1.6, 0.1), (4.0, 0.05), (1.6, 0.01), (0.5, 0.1)]))
def test_an_independent_code_finds_the_same_contact(contacts: Contacts, radius: float, load: float) -> None:
    """FElupe at the table's indentation: the force (3 G = E), the contact radius to its mesh, and the stress."""
    contact = contacts.at(3 * load * radius**2, radius)
    rho = RHO[1:4]
    force, a, sigma = felupe_contact.press(radius, contact.indentation, contact.a, rho.tolist())
    assert force / (3 * radius**2) == pytest.approx(load, rel=1e-3)
    assert a == pytest.approx(contact.a, rel=0.03)
    assert contact.sigma[1:4] == pytest.approx(sigma, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("edge", EDGES)
def test_fresh_solves_off_the_nodes(table: ContactTable, contacts: Contacts, edge: float) -> None:
    """Contact, stress, and d(Fσ)/dF at fixed R by differentiating the table, against the solver's own."""
    largest_cbrt_load = table.largest_solved
    largest = largest_cbrt_load * np.cbrt(9 / 16 / (1 + edge + 0.3 * edge**2))  # a/R at the largest load, about
    for sphere in press_spheres(edge, edge / (largest * STRAINS), RHO, 5):
        force, radius, step = sphere.force, sphere.radius, 0.002
        assert sphere.cbrt_load < largest_cbrt_load
        contact = contacts.at(force, radius)
        assert contact.a == pytest.approx(sphere.contact_radius, rel=1e-5)
        assert contact.indentation == pytest.approx(sphere.indentation, rel=1e-5)
        assert contact.stiffness == pytest.approx(sphere.stiffness, rel=2e-5)
        assert contact.sigma == pytest.approx(sphere.sigma, rel=1e-4)
        low, high = (contacts.at(force * f, radius).sigma * f for f in (1 - step, 1 + step))
        assert (high - low) / (2 * step) == pytest.approx(sphere.sigma_increment, rel=2e-4)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("edge", "strain"), first(1, [(0.52, 0.46), (0.05, 0.49), (1.05, 0.4), (1.5, 0.35), (2.06, 0.31)])
)
def test_continued_beyond_the_solved_loads(table: ContactTable, contacts: Contacts, edge: float, strain: float) -> None:
    """Up to L = 0.222 the splines meet fresh solves: σ to 0.5 % and its increment to 1 %, with a margin of ten."""
    (sphere,) = press_spheres(edge, edge / np.array([strain]), RHO, 4)
    continued = table.contact_axes[1][-1]
    assert table.largest_solved < sphere.cbrt_load < continued
    force, radius, step = sphere.force, sphere.radius, 0.002
    contact = contacts.at(force, radius)
    assert contact.a == pytest.approx(sphere.contact_radius, rel=5e-4)
    assert contact.indentation == pytest.approx(sphere.indentation, rel=5e-4)
    assert contact.sigma == pytest.approx(sphere.sigma, rel=5e-4)
    low, high = (contacts.at(force * f, radius).sigma * f for f in (1 - step, 1 + step))
    assert (high - low) / (2 * step) == pytest.approx(sphere.sigma_increment, rel=1e-3)


@pytest.mark.parametrize("radius", [0.5, 1.1, 3.0, 8.0])
def test_stiffness_is_the_slope_of_force_over_indentation(contacts: Contacts, radius: float) -> None:
    force = 3 * 0.05 * radius**2
    low, high = (contacts.at(force * f, radius).indentation for f in (0.99, 1.01))
    assert contacts.at(force, radius).stiffness == pytest.approx(0.02 * force / (high - low), rel=1e-3)


def test_a_small_contact_is_the_sigma_tables(contacts: Contacts) -> None:
    """At a/h 0.1 the layer is a half space to the sphere: its pressure is Hertz's but for finite strain."""
    load = 1e-3
    radius = 0.1 / float(np.cbrt(9 / 16 * load))
    prescribed = load_table().sigma(0.1, RHO, load).sigma
    assert contacts.at(3 * load * radius**2, radius).sigma == pytest.approx(prescribed, rel=5e-3)


@pytest.mark.parametrize(("load", "most"), [(0.001, 0.006), (0.01, 0.013), (0.1, 0.03)])
def test_finite_strain_adds_little_beneath_a_sphere(contacts: Contacts, load: float, most: float) -> None:
    """Less than under Hertz' pressure as a dead load; what README.md and the findings of /v1/stress say."""
    for radius in np.geomspace(0.5, 8, 7):
        contact = contacts.at(3 * load * radius**2, float(radius))
        assert np.abs(contact.sigma / contact.linear_sigma - 1).max() < 1.02 * most


def test_nothing_is_added_without_strain_or_size(table: ContactTable) -> None:
    """At L = 0 the layer is linear; a contact that vanishes is a point force to the base at any strain."""
    correction = table.profile_over(RADII)
    assert not correction[:, 0].any()
    assert not correction[0].any()
    assert np.abs(correction[1]).max() < 0.01
    assert table.contact_radius[:, 0] == pytest.approx(1.0, abs=1e-9)


def test_the_correction_keeps_the_force(table: ContactTable) -> None:
    """The linear part alone bears F, so the correction's integral over the base is 0 up to the profile's end."""
    r = np.linspace(0, 8, 1601)
    moment = np.trapezoid(table.profile_over(r) * r, r, axis=-1)
    assert np.abs(moment).max() < 1e-3


def test_reported_errors_and_the_balance_of_forces(table: ContactTable) -> None:
    assert table.attributes["force_balance_error"] < 1e-5
    assert 0 < table.correction_error.max() < 5e-3
    assert table.domain["a_over_h"] == (0.0, 3.0)


def test_an_altered_table_is_refused(tmp_path: Path) -> None:
    path = Path(shutil.copy(tables_folder() / "contact.h5", tmp_path))
    with h5py.File(path, "r+") as file:
        del file["frictionless/correction_error"]
    with pytest.raises(TableError, match="was altered"):
        ContactTable(path)


def test_the_shipped_tables_are_small() -> None:
    assert sum(path.stat().st_size for path in tables_folder().glob("*.h5")) < 15e6
