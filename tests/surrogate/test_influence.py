"""The influence table: the exact linear layer for every skin, fields of pressure, and what lies outside."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from bench.soak import SOAK
from tablegen.influence import solve_influence
from tablegen.influence_table import make_influence_table
from tests.support.oracle import layer_rows
from underskin import TableError
from underskin.array_stress.load_integration import Load, array_stress, contact_load, pressure_map_loads
from underskin.physics import elastic_layer
from underskin.physics.contact_pressure import SpherePressure
from underskin.physics.elastic_layer import Layer
from underskin.surrogate.hdf5_format import read_table, tables_folder
from underskin.surrogate.influence_table import InfluenceTable, load_influence
from underskin.units import Floats

TABLE = load_influence()
GENERATOR = np.random.default_rng(2018)
HERTZ_SHAPE = np.array([1.0, 1 / np.sqrt(5)])


def assert_accurate(found: Floats, exact: Floats) -> None:
    """Relative error 1e-4 where |γ| > 0.01, absolute error 1e-5 elsewhere."""
    allowed = np.where(np.abs(exact) > 0.01, 1e-4 * np.abs(exact), 1e-5)
    worst = int(np.argmax(np.abs(found - exact) / allowed))
    assert (np.abs(found - exact) <= allowed).all(), (worst, found.flat[worst], exact.flat[worst])


def hertz_load(a: float, place: Floats) -> Load:
    """1 N spread by Hertz over a contact of radius a on a layer of unit thickness."""
    return contact_load(place, (0.0, 0.0, 1.0), SpherePressure(a, HERTZ_SHAPE), 1.0)


def numbers(row: dict[str, str]) -> tuple[float, float, float, float, float]:
    """ν, slip, ρ, r̂/h and the value of a row; its glue stiffness is κ/2."""
    names = ("poisson_ratio", "rt_over_h", "offset_over_h", "value")
    poisson_ratio, rho, offset, value = (float(row[name]) for name in names)
    return poisson_ratio, elastic_layer.slip(2 * float(row["glue_stiffness_h_over_2g"])), rho, offset, value


@pytest.mark.slow
@pytest.mark.parametrize("quantity", ["gamma_n", "gamma_t"])
def test_point_forces_equal_the_oracle(quantity: str) -> None:
    found, exact = [], []
    for poisson_ratio, slip, rho, offset, value in map(numbers, layer_rows(quantity)):
        influence = TABLE.at(rho, poisson_ratio, slip)
        assert influence is not None
        found.append(float(getattr(influence, quantity)(offset)))
        exact.append(value)
    assert len(found) > 250
    assert_accurate(np.array(found), np.array(exact))


def test_the_hertz_pressure_beside_the_sensor_equals_the_oracle() -> None:
    found, exact = [], []
    for row in layer_rows("sigma_hertz")[:: 1 if SOAK else 4]:
        poisson_ratio, slip, rho, offset, value = numbers(row)
        influence = TABLE.at(rho, poisson_ratio, slip)
        assert influence is not None
        load = hertz_load(float(row["a_over_h"]), np.zeros(2))
        answer = influence.stress(1.0, np.array([[0.6 * offset, -0.8 * offset]]), load.positions, load.forces)
        found.append(-float(answer.stress[0]) * 2 * np.pi / 3)
        exact.append(value)
    assert len(found) > (600 if SOAK else 150)
    assert_accurate(np.array(found), np.array(exact))


@pytest.mark.slow
def test_every_skin_of_the_domain_meets_the_exact_layer_within_the_reported_error() -> None:
    r = np.linspace(0, 12, 121)
    for _ in range(40 if SOAK else 20):
        poisson_ratio, slip, rho = (GENERATOR.uniform(*limits) for limits in list(TABLE.domain.values())[:3])
        influence = TABLE.at(rho, poisson_ratio, slip)
        assert influence is not None
        exact = Layer(poisson_ratio, slip)
        pairs = [
            (influence.gamma_n(r), elastic_layer.gamma_n(exact, r, rho), influence.normal_error),
            (influence.gamma_t(r), elastic_layer.gamma_t(exact, r, rho), influence.tangential_error),
        ]
        for found, truth, reported in pairs:
            assert np.abs(found - truth).max() <= reported
            assert_accurate(found, truth)


def test_reported_errors_are_small() -> None:
    data = read_table(tables_folder() / "influence.h5", "underskin-influence/1").data
    errors = np.concatenate([data[f"influence/{name}_error"].ravel() for name in ("gamma_n", "gamma_t")])
    assert errors.max() < 2e-4
    assert np.median(errors) < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize(
    ("poisson_ratio", "slip", "orders"), [(0.5, 0.0, (2, 3)), (0.5, 1.0, (2, 3)), (0.35, 0.2, (2, 3, 4))]
)
def test_the_elements_converge_to_the_exact_layer(poisson_ratio: float, slip: float, orders: Sequence[int]) -> None:
    rho, r = np.array([0.1, 0.6, 2.0]), np.linspace(0, 6, 13)
    exact = elastic_layer.gamma_n(Layer(poisson_ratio, slip), r, rho[:, None])
    errors = [np.abs(solve_influence(poisson_ratio, slip, rho, r, order).normal - exact).max() for order in orders]
    assert all(coarse > 3 * fine for coarse, fine in pairwise(errors))


def test_a_load_in_balance_is_all_that_the_base_bears() -> None:
    """∫ T̄ over the places of a sensor is −F3 but for what lies beyond the reach, below 2e-4 of it."""
    influence = TABLE.at(0.5)
    assert influence is not None
    x, weight = np.polynomial.legendre.leggauss(80)
    r = influence.reach * (1 + x) / 2
    total = 3 * float((weight * r * influence.gamma_n(r)).sum()) * influence.reach / 2
    assert total == pytest.approx(1.0, abs=2e-4)


def test_superposition_mirror_and_rotation() -> None:
    influence = TABLE.at(0.6, 0.45, 0.1)
    assert influence is not None
    places, forces = GENERATOR.uniform(-2, 2, (5, 2)), GENERATOR.normal(size=(5, 3))
    sensors = GENERATOR.uniform(-2, 2, (4, 2))
    whole = influence.stress(1.0, sensors, places, forces).stress
    parts = [influence.stress(1.0, sensors, places[i : i + 1], forces[i : i + 1]).stress for i in range(5)]
    assert whole == pytest.approx(np.sum(parts, axis=0), rel=1e-12)
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    turned = np.column_stack([forces[:, :2] @ turn.T, forces[:, 2]])
    assert influence.stress(1.0, sensors @ turn.T, places @ turn.T, turned).stress == pytest.approx(whole, rel=1e-10)
    mirrored = influence.stress(1.0, sensors * [1, -1], places * [1, -1], forces * [1, -1, 1]).stress
    assert mirrored == pytest.approx(whole, rel=1e-12)


def test_a_force_that_points_away_from_the_sensor_pulls_at_it() -> None:
    influence = TABLE.at(0.6)
    assert influence is not None
    sensors, place = np.zeros((1, 2)), np.array([[0.8, 0.0]])
    assert influence.stress(1.0, sensors, place, np.array([[1.0, 0.0, 0.0]])).stress[0] > 0.05
    assert influence.stress(1.0, sensors, place, np.array([[-1.0, 0.0, 0.0]])).stress[0] < -0.05
    assert influence.stress(1.0, sensors, place, np.array([[0.0, 1.0, 0.0]])).stress[0] == 0.0
    assert influence.stress(1.0, sensors, place, np.array([[0.0, 0.0, 1.0]])).stress[0] < -0.05


@pytest.mark.parametrize("cells", [21, 201])
def test_a_map_of_the_hertz_pressure_gives_the_contact(cells: int) -> None:
    influence = TABLE.at(0.6)
    assert influence is not None
    a, sensors = 1.0, np.array([[0.0, 0.0], [0.7, 0.4], [3.0, -1.0]])
    load = hertz_load(a, np.array([0.1, 0.2]))
    contact = influence.stress(1.0, sensors, load.positions, load.forces).stress
    x = np.linspace(-1.2, 1.4, cells)
    square = ((x - 0.1) ** 2 + (x[:, None] - 0.2 - 0.1) ** 2) / a**2
    pressure = 1.5 / np.pi / a**2 * np.sqrt(np.clip(1 - square, 0, None))
    found = array_stress(influence, 1.0, sensors, pressure_map_loads(x, x - 0.1, pressure, 1.0)).stress
    assert found == pytest.approx(contact, rel=1.5 / cells)


def test_uniform_pressure_over_wide_cells_is_integrated_within_them() -> None:
    """Cells twice as wide as the layer is thick give what a map of narrow ones gives."""
    influence = TABLE.at(0.6)
    assert influence is not None
    sensors = np.array([[0.3, 0.0], [2.0, 1.0]])
    wide = np.array([-2.0, 0.0, 2.0])
    narrow = -3 + 6 * (np.arange(120) + 0.5) / 120
    maps = [pressure_map_loads(x, x, np.ones((x.size, x.size)), 1.0) for x in (wide, narrow)]
    first, second = (array_stress(influence, 1.0, sensors, loads).stress for loads in maps)
    assert first == pytest.approx(second, rel=3e-5)


def test_beyond_the_reach_nothing_is_extrapolated() -> None:
    influence = TABLE.at(0.6)
    assert influence is not None
    assert np.isnan(influence.gamma_n([12.01, -0.1])).all()
    assert np.isfinite(influence.gamma_t([0.0, 12.0])).all()
    places, forces = np.array([[0.0, 0.0], [20.0, 0.0]]), np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]])
    answer = influence.stress(1.0, np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 30.0]]), places, forces)
    assert answer.inside.tolist() == [True, True, False]
    alone = influence.stress(1.0, np.zeros((1, 2)), places[:1], forces[:1])
    assert answer.stress[0] == alone.stress[0]
    assert answer.error[0] - alone.error[0] == pytest.approx(1.5 / np.pi * influence.normal_beyond)
    assert influence.normal_beyond > np.abs(elastic_layer.gamma_n(Layer(), np.linspace(12, 20, 50), 0.6)).max()


@pytest.mark.parametrize("skin", [(3.1, 0.5, 0.0), (0.6, 0.29, 0.0), (0.6, 0.5, 1.1), (float("nan"), 0.5, 0.0)])
def test_a_skin_outside_has_no_influence(skin: tuple[float, float, float]) -> None:
    assert TABLE.at(*skin) is None


def test_the_table_describes_itself() -> None:
    file = read_table(tables_folder() / "influence.h5", "underskin-influence/1")
    assert file.sha256 == TABLE.sha256
    assert {"mesh", "solver", "material", "quantity", "version_scikit-fem"} <= set(file.attributes)


def test_another_table_is_refused() -> None:
    with pytest.raises(TableError, match="schema 'underskin-sigma/1'"):
        InfluenceTable(tables_folder() / "sigma.h5")


@pytest.mark.soak
def test_a_small_sweep_writes_a_table(tmp_path: Path) -> None:
    path, r = tmp_path / "influence.h5", 6 * np.linspace(0, 1, 33) ** 1.5
    axes = (np.linspace(0.44, 0.5, 7), (0.5 - 0.5 * np.cos(np.pi * np.linspace(0, 1, 7))), np.linspace(0, 1, 9), r)
    make_influence_table(path, axes, order=2)
    found = InfluenceTable(path).at(0.5, 0.48, 0.2)
    assert found is not None
    exact = elastic_layer.gamma_n(Layer(0.48, 0.2), r, 0.5)
    assert np.abs(found.gamma_n(r) - exact).max() <= found.normal_error < 0.05
    assert not path.with_name("influence.h5.parts").exists()
