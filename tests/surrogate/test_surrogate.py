"""The shipped table: accuracy, derivatives, domain, and every way in which a table is refused."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from tablegen import linear_layer
from tablegen.sigma import Nodes, solve_column
from tests.support.oracle import linear_layer_values
from underskin import TableError, load_table
from underskin.surrogate.hdf5_format import data_hash, read_table, tables_folder
from underskin.surrogate.sigma_table import SigmaTable

TABLE = load_table()
GENERATOR = np.random.default_rng(2018)
SOAK = "UNDERSKIN_SOAK" in os.environ


def test_linear_limit_equals_the_oracle() -> None:
    rho, a, offset, value = linear_layer_values("sigma_hertz")
    used = (offset == 0) & (value > 0.01) & (a <= 3) & (rho <= 3)
    assert used.sum() > 50
    assert TABLE.sigma(a[used], rho[used]).sigma == pytest.approx(value[used], rel=1e-6)


def test_linear_limit_between_the_nodes_and_at_the_limits() -> None:
    a = np.concatenate([[0.0, 3.0], GENERATOR.uniform(0, 3, 60)])
    rho = np.concatenate([[0.0, 3.0], GENERATOR.uniform(0, 3, 60)])[:, None]
    assert TABLE.sigma(a, rho).sigma == pytest.approx(linear_layer.sigma(a, rho), rel=2e-6)


def test_finite_strain_reference_values() -> None:
    load = [1e-3, 1e-2, 3e-2, 1e-1]
    ratio = TABLE.sigma(0.3, 0.6, load).sigma / TABLE.sigma(0.3, 0.6).sigma
    assert ratio == pytest.approx([1.01293, 1.02966, 1.04522, 1.07489], abs=1e-4)


def test_point_load_knows_no_finite_strain() -> None:
    """At fixed L the force vanishes with the contact radius: σ(0, ρ, L) = σ(0, ρ, 0)."""
    assert TABLE.sigma(0.0, 0.6, 0.1).sigma == pytest.approx(linear_layer.sigma(0.0, 0.6), rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(50 if SOAK else 1))
def test_finer_solves_agree_within_the_reported_error(number: int) -> None:
    generator = np.random.default_rng([50, number])
    a = generator.uniform(0.02, 0.5) if number % 3 == 0 else generator.uniform(0, 3)
    rho, load = generator.uniform(0, 3), generator.uniform(0, 0.1)
    rho_nodes = np.array([0.0, rho])
    nodes = Nodes(np.zeros(1), rho_nodes, np.cbrt([0.0, load]), np.zeros(1))
    order, refinement = (5, 2) if SOAK else (6, 1)
    fresh = linear_layer.sigma(a, rho_nodes) + solve_column(a, nodes, order, refinement).sigma_change[:, -1]
    answer = TABLE.sigma(a, rho_nodes, load)
    assert (np.abs(answer.sigma / fresh - 1) <= answer.rel_error).all()


def test_reported_error_is_small_and_the_elements_own_error_is_not_hidden() -> None:
    points = [GENERATOR.uniform(low, high, 20000) for low, high in TABLE.domain.values()]
    error = TABLE.sigma(*points).rel_error
    assert np.median(error) <= 2e-5
    assert error.max() <= 1e-4
    assert error.min() > 0
    assert np.abs(TABLE.fem_linear_error).max() < 1e-5
    assert TABLE.attributes["force_balance_error"] < 1e-6


def test_derivatives_match_finite_differences() -> None:
    a, rho, load = (GENERATOR.uniform(0.1, 0.9, 40) * high for _, high in TABLE.domain.values())
    exact = TABLE.gradient(a, rho, load)
    for axis, slope in enumerate(exact):
        steps = np.zeros((3, 1))
        steps[axis] = 1e-5 * (0.1 if axis == 2 else 3)
        up, down = (TABLE.sigma(*(np.stack([a, rho, load]) + sign * steps)).sigma for sign in (1, -1))
        assert slope == pytest.approx((up - down) / (2 * steps[axis, 0]), rel=2e-4, abs=1e-5)


def test_derivative_in_the_load_is_infinite_at_zero_load() -> None:
    assert np.isinf(TABLE.gradient(0.3, 0.6, 0.0)[2])


def test_outside_the_domain_is_nan_and_spoils_nothing() -> None:
    answer = TABLE.sigma([0.3, 3.01, 0.3, 0.3], [0.6, 0.6, 3.01, 0.6], [0.01, 0.01, 0.01, 0.101])
    assert answer.inside.tolist() == [True, False, False, False]
    assert np.isnan(answer.sigma[1:]).all()
    assert np.isnan(answer.rel_error[1:]).all()
    assert answer.sigma[0] == TABLE.sigma(0.3, 0.6, 0.01).sigma
    assert np.isnan(TABLE.gradient(3.01, 0.6)[0])
    assert np.isnan(TABLE.profile(8.1, 0.3))


def test_shapes_broadcast_and_empty_is_empty() -> None:
    assert TABLE.sigma(np.full((4, 1), 0.3), np.full(5, 0.6)).sigma.shape == (4, 5)
    assert TABLE.sigma(0.3, 0.6).sigma.shape == ()
    assert TABLE.sigma(np.zeros(0), 0.6).sigma.shape == (0,)


def test_many_rows_are_answered_as_few_are() -> None:
    """Also on the nodes and next to them, where a row goes from one cell to the next, and beyond the limits."""
    rows = 30_000
    columns = []
    for nodes in (TABLE.axes[0], TABLE.axes[1], TABLE.axes[2] ** 3):
        beside = [np.nextafter(nodes, -1), nodes, np.nextafter(nodes, 9), GENERATOR.uniform(0, nodes[-1], 200)]
        columns.append(GENERATOR.choice(np.concatenate(beside), rows))
    many = TABLE.sigma(*columns)
    few = [TABLE.sigma(*part) for part in np.split(np.stack(columns), 10, axis=1)]
    assert np.array_equal(many.inside, np.concatenate([part.inside for part in few]))
    assert np.array_equal(many.rel_error, np.concatenate([part.rel_error for part in few]), equal_nan=True)
    assert many.sigma == pytest.approx(np.concatenate([part.sigma for part in few]), rel=1e-13, nan_ok=True)
    assert 0.5 * rows < many.inside.sum() < rows
    single = TABLE.sigma(columns[0][:, None], 0.6, [0.01, 0.02])
    assert np.array_equal(single.sigma[:, 1], TABLE.sigma(columns[0], 0.6, 0.02).sigma, equal_nan=True)


def test_profile_averages_to_sigma_and_is_exact_off_centre() -> None:
    x, w = np.polynomial.legendre.leggauss(30)
    for rho, load in ((0.6, 0.05), (2.0, 0.1)):
        r = rho * (x + 1) / 2
        average = float((w * r * TABLE.profile(r, 0.8, load)).sum() / rho)
        assert average == pytest.approx(float(TABLE.sigma(0.8, rho, load).sigma), rel=2e-5)
    r = np.linspace(0, 8, 33)
    assert TABLE.profile(r, 0.7) == pytest.approx(linear_layer.sigma(0.7, 0.0, r), abs=2e-5)


@pytest.fixture
def table(tmp_path: Path) -> Path:
    return Path(shutil.copy(tables_folder() / "sigma.h5", tmp_path / "sigma.h5"))


def altered(file: h5py.File) -> None:
    file["sigma/sigma"][3, 3, 3] += 1e-9


def resigned(change: Callable[[h5py.File], None]) -> Callable[[h5py.File], None]:
    """The change with the hash made to fit, so that only the check behind the hash can see it."""

    def apply(file: h5py.File) -> None:
        change(file)
        data = {f"{group}/{name}": item[()] for group, items in file.items() for name, item in items.items()}
        file.attrs["data_sha256"] = data_hash(data)

    return apply


def not_finite(file: h5py.File) -> None:
    file["profile/profile"][0, 0, 0] = np.nan


def not_ascending(file: h5py.File) -> None:
    file["sigma/a_over_h"][5] = 2.0


def older_schema(file: h5py.File) -> None:
    file.attrs["schema"] = "underskin-sigma/0"


def lacks_a_dataset(file: h5py.File) -> None:
    del file["sigma/discretisation_error"]


def misshapen(file: h5py.File) -> None:
    values = file["sigma/sigma"][:-1]
    axes = file["sigma/sigma"].attrs["axes"]
    del file["sigma/sigma"]
    file["sigma/sigma"] = values
    file["sigma/sigma"].attrs["axes"] = axes


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (altered, "altered after it was written"),
        (resigned(not_finite), "not finite"),
        (resigned(not_ascending), "does not ascend"),
        (older_schema, "schema 'underskin-sigma/0'"),
        (resigned(lacks_a_dataset), "lacks the dataset 'sigma/discretisation_error'"),
        (resigned(misshapen), "has shape"),
    ],
)
def test_table_cannot_trusted_refused(table: Path, change: Callable[[h5py.File], None], reason: str) -> None:
    """A table that cannot be trusted is refused."""
    with h5py.File(table, "r+") as file:
        change(file)
    with pytest.raises(TableError, match=reason) as refusal:
        SigmaTable(table)
    assert str(table) in str(refusal.value)


@pytest.mark.parametrize("kept", [0, 5, 600, 100_000])
def test_a_truncated_table_is_refused(table: Path, kept: int) -> None:
    table.write_bytes(table.read_bytes()[:kept])
    with pytest.raises(TableError, match=r"truncated or damaged|not an HDF5 file"):
        SigmaTable(table)


def test_a_missing_table_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("UNDERSKIN_TABLES", str(tmp_path))
    with pytest.raises(TableError, match="No such file"):
        load_table()


def test_the_file_describes_itself() -> None:
    file = read_table(tables_folder() / "sigma.h5", "underskin-sigma/1")
    assert file.sha256 == TABLE.sha256 == file.attributes["data_sha256"]
    assert {"mesh", "solver", "material", "poisson_ratio", "version_scikit-fem"} <= set(file.attributes)
    with h5py.File(tables_folder() / "sigma.h5") as raw:
        for group in raw.values():
            assert group.attrs["NX_class"] == "NXdata"
            signal = group[group.attrs["signal"]]
            assert list(signal.attrs["axes"]) == list(group.attrs["axes"])
            assert signal.shape == tuple(group[axis].size for axis in group.attrs["axes"])
            assert all("units" in item.attrs and item.attrs["long_name"] for item in group.values())
