"""The shipped tables are what the code makes: some points are solved anew, and the sources are those on record."""

import json
from dataclasses import replace
from types import ModuleType

import h5py
import numpy as np
import pytest

from bench.soak import SOAK
from tablegen import contact_table, influence_table, sigma_table
from tablegen.sweep import sources_hash
from tests.support.cases import first
from underskin.surrogate.hdf5_format import tables_folder

MADE_BY = {"sigma.h5": sigma_table, "influence.h5": influence_table, "contact.h5": contact_table}


@pytest.mark.parametrize(("name", "maker"), MADE_BY.items())
def test_the_sources_on_record_are_these(name: str, maker: ModuleType) -> None:
    """In the table itself, or in `sources.json` for a table that was made before the digest left names out."""
    later = json.loads((tables_folder() / "sources.json").read_text(encoding="utf-8")).get(name, {})
    with h5py.File(tables_folder() / name) as file:
        on_record = [file.attrs["tablegen_sources_sha256"]]
        if later.get("data_sha256") == file.attrs["data_sha256"]:
            on_record.append(later["sources_sha256"])
    assert sources_hash(maker.SOURCES) in on_record, "run `make tables`"


@pytest.mark.slow
def test_sigma_solved_anew() -> None:
    loads = slice(None) if SOAK else slice(None, None, 12)
    nodes = replace(sigma_table.DEFAULT_NODES, cbrt_load=sigma_table.DEFAULT_NODES.cbrt_load[loads])
    with h5py.File(tables_folder() / "sigma.h5") as file:
        kept, linear_error = file["sigma/sigma"][:, :, loads], file["sigma/fem_linear_error"][:]
    for number in first(1, (41, 7)):
        column = sigma_table.solve_piece(float(nodes.a[number]), nodes, sigma_table.ORDER)
        # Where nothing is added to the exact linear layer, the column's own share is the whole difference.
        change = kept[number] - kept[number][:, :1]
        assert np.abs(column["sigma_change"] - change).max() < 1e-10
        assert np.abs(column["linear_error"] / kept[number][:, 0] - linear_error[number]).max() < 1e-9


@pytest.mark.soak
def test_influence_solved_anew() -> None:
    """In every run the table meets the exact layer (tests/surrogate/test_influence.py)."""
    axes = influence_table.DEFAULT_AXES
    with h5py.File(tables_folder() / "influence.h5") as file:
        normal, tangential = file["influence/gamma_n"][:], file["influence/gamma_t"][:]
    for i, j in (6, 9), (0, 0):
        solved = influence_table.solve_piece(
            float(axes[0][i]), float(axes[1][j]), axes[2], axes[3], influence_table.ORDER
        )
        assert np.abs(solved["normal"] - normal[i, j]).max() < 1e-9
        assert np.abs(solved["tangential"] - tangential[i, j]).max() < 1e-9
