"""The sweep survives being killed, distrusts damaged pieces, and gives the same table on a cluster."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from bench.soak import SOAK
from tablegen import sigma_table
from tablegen.sigma import Nodes
from tablegen.sigma_table import make_sigma_table
from tests.support.cases import first
from tests.support.dask_cluster import local_cluster
from tests.support.repository import ROOT
from underskin import SolverError

ORDER = sigma_table.ORDER if SOAK else 2
SMALL = Nodes(
    a=np.linspace(0, 3.0, 7), rho=np.linspace(0, 3, 7), cbrt_load=np.linspace(0, 0.03, 7), r=np.linspace(0, 8, 9)
)
# Arguments: the table, the order of the elements, and how often a piece is begun or finished on the disk until a kill.
SCRIPT = """
import os, signal, sys
from pathlib import Path
import numpy as np
from tablegen import sigma_table

def kill_late(event, arguments):
    global left
    if event in ("open", "os.rename") and str(arguments[0]).endswith(".partial"):
        left -= 1
        if left == 0:
            os.killpg(0, signal.SIGKILL)

if __name__ == "__main__":
    sigma_table.ORDER, left = int(sys.argv[2]), int(sys.argv[3])
    sys.addaudithook(kill_late)
    axes = np.linspace(0, 3, 7), np.linspace(0, 3, 7), np.linspace(0, 0.03, 7), np.linspace(0, 8, 9)
    sigma_table.make_sigma_table(Path(sys.argv[1]), sigma_table.Nodes(*axes))
"""


def datasets(path: Path) -> dict[str, bytes]:
    found: dict[str, bytes] = {}
    with h5py.File(path) as file:
        file.visititems(
            lambda name, item: found.update({name: item[()].tobytes()}) if isinstance(item, h5py.Dataset) else None
        )
    return found


@pytest.fixture(autouse=True)
def _order(monkeypatch: pytest.MonkeyPatch) -> None:
    """A sweep goes on as it does whatever its elements; coarse ones are solved in no time."""
    monkeypatch.setattr(sigma_table, "ORDER", ORDER)


@pytest.mark.slow
def test_killed_at_any_moment_it_resumes_to_the_table_that_a_cluster_makes(tmp_path: Path) -> None:
    """Killed as a piece is begun or finished on the disk; a piece that was cut there is solved again."""
    with local_cluster() as cluster:
        make_sigma_table(tmp_path / "cluster.h5", SMALL, scheduler=cluster.scheduler_address)
    path, script = tmp_path / "sigma.h5", tmp_path / "make.py"
    script.write_text(SCRIPT)
    for late in first(1, (5, 1, 2, 1, 4, 2, 3, 2)):
        command = [sys.executable, str(script), str(path), str(ORDER), str(late)]
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        sweep = subprocess.run(command, env=environment, start_new_session=True, stdout=subprocess.DEVNULL, check=False)
        assert sweep.returncode == -signal.SIGKILL
    pieces = list(tmp_path.glob("sigma.h5.parts/*/*.npz"))
    pieces[0].write_bytes(pieces[0].read_bytes()[:100])
    make_sigma_table(path, SMALL)
    assert datasets(path) == datasets(tmp_path / "cluster.h5")
    assert not list(tmp_path.glob("*.parts"))


@pytest.mark.slow
def test_no_table_is_written_when_a_point_fails(tmp_path: Path) -> None:
    hopeless = Nodes(a=np.array([0.0, 3.0]), rho=SMALL.rho, cbrt_load=np.array([0.0, 1e6]), r=SMALL.r)
    with pytest.raises(SolverError, match=r"a/h = 3, L = 1e\+18"):
        make_sigma_table(tmp_path / "sigma.h5", hopeless)
    assert not [*tmp_path.rglob("*.h5"), *tmp_path.rglob("*.npz")]
