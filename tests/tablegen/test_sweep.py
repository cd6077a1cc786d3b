"""The sweep survives being killed, distrusts damaged pieces, and gives the same table on a cluster."""

import os
import shutil
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pytest

from tablegen.sigma import Nodes
from tablegen.sigma_table import ORDER, SOURCES, make_sigma_table, nodes_hash, solve_piece
from tablegen.sweep import run_pieces, sources_hash
from tests.support.repository import ROOT
from underskin import SolverError

SOAK = "UNDERSKIN_SOAK" in os.environ
PIECES = "sigma.h5.parts/*/*.npz"
SMALL = Nodes(
    a=np.linspace(0, 3.0, 7), rho=np.linspace(0, 3, 7), cbrt_load=np.linspace(0, 0.03, 7), r=np.linspace(0, 8, 9)
)
SCRIPT = """
from pathlib import Path
import sys
from tests.tablegen.test_sweep import SMALL, make_sigma_table
if __name__ == "__main__":
    make_sigma_table(Path(sys.argv[1]), SMALL)
"""


def datasets(path: Path) -> dict[str, bytes]:
    found: dict[str, bytes] = {}
    with h5py.File(path) as file:
        file.visititems(
            lambda name, item: found.update({name: item[()].tobytes()}) if isinstance(item, h5py.Dataset) else None
        )
    return found


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All pieces of the table, in the folder in which a sweep looks for them."""
    parts = tmp_path_factory.mktemp("pieces") / "sigma.h5.parts"
    pieces = {
        f"order{order}-{number:03d}": partial(solve_piece, float(a), SMALL, order)
        for order in (ORDER, ORDER - 1)
        for number, a in enumerate(SMALL.a)
        if a > 0
    }
    run_pieces(pieces, parts / f"{sources_hash(SOURCES)[:16]}-{nodes_hash(SMALL)[:8]}")
    return parts


@pytest.fixture(scope="module")
def uninterrupted(solved: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("whole") / "sigma.h5"
    parts = path.with_name("sigma.h5.parts")
    shutil.copytree(solved, parts)
    make_sigma_table(path, SMALL)
    assert not parts.exists()
    return path


def all_but(count: int, solved: Path, folder: Path) -> None:
    """Put the pieces of a table but for the last few of either order into a folder; in `make soak` none of them."""
    if SOAK:
        return
    shutil.copytree(solved, folder / "sigma.h5.parts")
    for order in (ORDER, ORDER - 1):
        for piece in sorted(folder.glob(f"sigma.h5.parts/*/order{order}-*.npz"))[-count:]:
            piece.unlink()


@pytest.mark.slow
def test_killed_at_any_moment_it_resumes_to_the_same_table(solved: Path, uninterrupted: Path, tmp_path: Path) -> None:
    all_but(2, solved, tmp_path)
    script = tmp_path / "make.py"
    script.write_text(SCRIPT)
    path = tmp_path / "sigma.h5"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    generator = np.random.default_rng(1)
    for _ in range(8 if SOAK else 1):
        seen = len(list(tmp_path.glob(PIECES)))
        sweep = subprocess.Popen(
            [sys.executable, script, path], env=environment, start_new_session=True, stdout=subprocess.DEVNULL
        )
        while sweep.poll() is None and len(list(tmp_path.glob(PIECES))) == seen:
            time.sleep(0.05)
        time.sleep(generator.uniform(0, 0.5))
        assert sweep.poll() is None, "the sweep ended before it could be killed"
        os.killpg(sweep.pid, signal.SIGKILL)
        sweep.wait()
    pieces = list(tmp_path.glob(PIECES))
    if pieces:
        pieces[0].write_bytes(pieces[0].read_bytes()[:100])
    subprocess.run([sys.executable, script, path], env=environment, check=True, stdout=subprocess.DEVNULL)
    assert datasets(path) == datasets(uninterrupted)


@pytest.mark.slow
def test_a_dask_cluster_gives_the_same_table(solved: Path, uninterrupted: Path, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="the cluster extra is not installed")
    all_but(1, solved, tmp_path)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0", host="127.0.0.1"
    ) as cluster:
        make_sigma_table(tmp_path / "sigma.h5", SMALL, scheduler=cluster.scheduler_address)
    assert datasets(tmp_path / "sigma.h5") == datasets(uninterrupted)


def fail() -> dict[str, np.ndarray]:
    raise SolverError("a/h = 1, L = 0.1: Newton's method did not converge")


def succeed() -> dict[str, np.ndarray]:
    return {"value": np.ones(1)}


@pytest.mark.slow
def test_a_failed_piece_stops_the_sweep_and_keeps_the_others(tmp_path: Path) -> None:
    with pytest.raises(SolverError, match=r"a/h = 1, L = 0\.1"):
        run_pieces({"good": succeed, "bad": fail}, tmp_path)
    assert not (tmp_path / "bad.npz").exists()
    assert run_pieces({"good": succeed}, tmp_path)["good"]["value"] == [1.0]


@pytest.mark.slow
def test_no_table_is_written_when_a_point_fails(tmp_path: Path) -> None:
    hopeless = Nodes(a=np.array([0.0, 3.0]), rho=SMALL.rho, cbrt_load=np.array([0.0, 1e6]), r=SMALL.r)
    with pytest.raises(SolverError, match="a/h"):
        make_sigma_table(tmp_path / "sigma.h5", hopeless)
    assert not (tmp_path / "sigma.h5").exists()
