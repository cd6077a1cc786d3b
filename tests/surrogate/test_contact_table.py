"""The contact table: fresh solves off its nodes, their increments, the linear limit, and what is refused."""

import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.interpolate import RectBivariateSpline

from bench.soak import SOAK
from tablegen.contact_column import RADII, press_spheres
from tablegen.linear_contact import LinearContact
from underskin import TableError
from underskin.surrogate.contact_table import ContactTable, load_contact
from underskin.surrogate.sigma_table import tables_folder

RHO = np.array([0.2, 0.6, 1.5])
EDGES = np.array([0.03, 0.13, 0.37, 0.86, 1.7, 2.55]) if SOAK else np.array([0.37])
STRAINS = np.array([0.2, 0.35, 0.6, 0.8, 0.97]) if SOAK else np.array([0.9])


@pytest.fixture(scope="module")
def table() -> ContactTable:
    return load_contact()


def disc_means(table: ContactTable) -> list[RectBivariateSpline]:
    """The correction's means over the discs RHO, cubic in a/h and L^(1/3)."""
    x, w = np.polynomial.legendre.leggauss(24)
    t = (1 + x) / 2
    means = [(table.profile_over(rho * t) * (w * t)).sum(axis=-1) for rho in RHO]
    return [RectBivariateSpline(*table.contact_axes, mean) for mean in means]


@pytest.mark.slow
@pytest.mark.parametrize("edge", EDGES)
def test_fresh_solves_off_the_nodes(table: ContactTable, edge: float) -> None:
    """σ within 0.5 %, and d(Fσ)/dF at fixed R by differentiating the table within 1 % of the solver's own."""
    largest = table.contact_axes[1][-1] * np.cbrt(9 / 16 / (1 + edge))  # a/R at the largest load, about
    linear, corrections = LinearContact(np.zeros(1), RHO), disc_means(table)
    for sphere in press_spheres(edge, edge / (largest * STRAINS), RHO, 5):

        def sigma(force: float, radius: float = sphere.radius) -> np.ndarray:
            alpha, x = linear.sphere(force, radius).alpha, np.cbrt(force / (3 * radius**2))
            added = [spline(np.array([alpha]), np.array([x]))[0, 0] for spline in corrections]
            return np.asarray(linear.sigma(alpha) + np.array(added))

        force, step = sphere.force, 0.002
        assert sigma(force) == pytest.approx(sphere.sigma, rel=5e-3)
        gained = ((1 + step) * sigma(force * (1 + step)) - (1 - step) * sigma(force * (1 - step))) / (2 * step)
        assert gained == pytest.approx(sphere.sigma_increment, rel=1e-2)


def test_nothing_is_added_without_strain_or_size(table: ContactTable) -> None:
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


def test_reported_errors(table: ContactTable) -> None:
    assert table.attributes["force_balance_error"] < 1e-5
    assert table.correction_error.max() < 5e-3
    assert table.domain["a_over_h"] == (0.0, 3.0)


def test_an_altered_table_is_refused(tmp_path: Path) -> None:
    path = Path(shutil.copy(tables_folder() / "contact.h5", tmp_path))
    with h5py.File(path, "r+") as file:
        del file["frictionless/correction_error"]
    with pytest.raises(TableError, match="was altered"):
        ContactTable(path)


def test_the_shipped_tables_are_small() -> None:
    assert sum(path.stat().st_size for path in tables_folder().glob("*.h5")) < 15e6
