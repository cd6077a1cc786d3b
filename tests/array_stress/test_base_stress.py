"""The normal stress on the base under several loads, on a grid: the exact layer's, and what a sensor averages."""

import numpy as np
import pytest

from tests.array_stress.stress_documents import PRESS, document
from underskin.array_stress.answer import answer, base_stress
from underskin.array_stress.request import read_request
from underskin.physics import elastic_layer
from underskin.physics.elastic_layer import Layer
from underskin.surrogate.influence_table import load_influence

TABLE = load_influence()
UNIT_MPA = 1.5 / np.pi / 2.5**2  # of 1 N on 2.5 mm


def test_it_is_that_of_the_exact_layer_summed_over_the_loads() -> None:
    """Point sensors under two small spheres, one of them sheared."""
    contacts = [
        {**PRESS, "x_mm": 1.0, "y_mm": 2.0, "normal_force_n": 0.01, "tangential_force_n": [0.006, -0.003]},
        {**PRESS, "x_mm": 6.0, "y_mm": -1.0, "normal_force_n": 0.02},
    ]
    x, y = np.array([-2.0, 0.5, 3.0, 7.0]), np.array([-1.5, 0.0, 4.0])
    found = base_stress(TABLE, read_request(document(*contacts, poisson_ratio=0.45)), x, y)
    body = Layer(0.45)
    expected = np.zeros((3, 4))
    for contact, a in zip(contacts, found.contact_radius_mm / 2.5, strict=True):
        away = np.stack(np.meshgrid(contact["x_mm"] - x, contact["y_mm"] - y), axis=-1)
        r = np.hypot(away[..., 0], away[..., 1])
        outward = away @ np.array(contact.get("tangential_force_n", [0.0, 0.0])) / r
        expected -= UNIT_MPA * contact["normal_force_n"] * elastic_layer.sigma(body, a, 0.0, r / 2.5)
        expected += UNIT_MPA * outward * elastic_layer.gamma_t(body, r / 2.5, 0.0)
    assert found.sigma_zz_mpa == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())
    assert (expected > 0).any()  # the shear pulls somewhere


def test_a_sensors_mean_stress_is_the_mean_over_its_disc() -> None:
    request = read_request(document({**PRESS, "x_mm": 1.0}, {**PRESS, "x_mm": -2.0, "y_mm": 3.0}))
    grid = np.linspace(-1.5, 1.5, 61)
    stress = base_stress(TABLE, request, grid, grid).sigma_zz_mpa
    disc = np.hypot(*np.meshgrid(grid, grid)) <= 1.5
    assert -stress[disc].mean() == pytest.approx(answer(TABLE, request).columns["mean_stress_mpa"][0], rel=0.01)


def test_nothing_is_felt_far_away() -> None:
    found = base_stress(TABLE, read_request(document(PRESS)), np.array([8.0, 100.0]), np.array([0.0]))
    assert found.sigma_zz_mpa[0, 0] < -0.1
    assert found.sigma_zz_mpa[0, 1] == 0.0
