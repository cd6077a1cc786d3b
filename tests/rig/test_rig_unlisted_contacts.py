"""Other layers and contacts against exact values: Poisson ratio, slip, moving edge, adhesion, sphere on a layer."""

import numpy as np
import pytest

from rig.unlisted.contact_pressure import adhesive_contact, force_over_hertz, layered_contact
from rig.unlisted.elastic_layer import layer_transfer
from rig.unlisted.layer import base_stress, hertz_radius, hertz_transform, punch_transform, sigma, transfer
from tests.support.oracle import layer_rows


def test_bonded_incompressible_layer_is_the_closed_form() -> None:
    np.testing.assert_allclose(layer_transfer(0.5), transfer()[1], rtol=1e-12)


@pytest.mark.parametrize("quantity", ["sigma_hertz", "sigma_edge"])
def test_any_layer_against_the_exact_values(quantity: str) -> None:
    """The oracle's glue stiffness is kappa/2."""
    rows = layer_rows(quantity)
    form = hertz_transform if quantity == "sigma_hertz" else punch_transform
    for case in sorted({(r["poisson_ratio"], r["glue_stiffness_h_over_2g"]) for r in rows}):
        same = [r for r in rows if (r["poisson_ratio"], r["glue_stiffness_h_over_2g"]) == case]
        a, rho, e, exact = (
            np.array([float(r[k]) for r in same]) for k in ("a_over_h", "rt_over_h", "offset_over_h", "value")
        )
        slip = 0.5 / max(float(case[1]), 1e-9)
        found = base_stress(form(transfer()[0] * a[:, None]), rho, e, layer_transfer(float(case[0]), slip))
        np.testing.assert_allclose(found, exact, atol=1e-7, err_msg=str(case))


def test_a_flat_punch_is_the_increment_of_a_growing_hertz_contact() -> None:
    """d(F sigma)/dF at fixed radius of the sphere, where a grows as F^(1/3)."""
    a, step = np.array([0.1, 0.3, 0.6, 1.0, 1.5, 2.0]), 1e-4
    up, down = ((1.0 + s) * sigma(a * np.cbrt(1.0 + s), 0.6, 0.2) for s in (step, -step))
    edge = base_stress(punch_transform(transfer()[0] * a[:, None]), 0.6, 0.2)
    np.testing.assert_allclose(edge, (up - down) / (2.0 * step), rtol=1e-5)


def test_adhesive_contact() -> None:
    """Force balance of JKR, unit force of its pressure, and Hertz's contact without adhesion."""
    force, radius, modulus, h = np.array([0.2, 1.0]), np.array([4.0, 10.0]), 3.0, 2.5
    plane = modulus / 0.75
    for work in (0.05, 2.0):
        a, pressure = adhesive_contact(force, radius, modulus, work, h)
        balance = 4.0 * plane * a**3 / (3.0 * radius) - np.sqrt(8.0 * np.pi * 1e-3 * work * plane * a**3)
        np.testing.assert_allclose(balance, force, rtol=1e-9)
        np.testing.assert_allclose(pressure[:, 0], 1.0, atol=1e-5)
    a, pressure = adhesive_contact(force, radius, modulus, 0.0, h)
    np.testing.assert_allclose(a, hertz_radius(force, radius, modulus))
    np.testing.assert_allclose(pressure, hertz_transform(transfer()[0] * (a / h)[:, None]))


def test_sphere_on_the_layer() -> None:
    a, exact = np.array([0.1, 0.3, 0.5, 1.0, 2.0]), np.array([1.0008, 1.0197, 1.0789, 1.4105, 2.5981])
    np.testing.assert_allclose(force_over_hertz(a), exact, atol=6e-5)
    radii, pressure = layered_contact(a * np.cbrt(exact))
    np.testing.assert_allclose(radii, a, rtol=1e-4)
    np.testing.assert_allclose(pressure[:, 0], 1.0, atol=1e-5)
    narrow, pressure = layered_contact(np.array([0.02]))
    np.testing.assert_allclose(pressure, hertz_transform(transfer()[0] * narrow[:, None]), atol=1e-6)
