"""Processes end with the one that started them, and what they work out does not depend on how many there are."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.cases import first
from tests.support.diagnosis_campaigns import Made, campaign
from tests.support.lean_reports import BESIDE_SKINS
from underskin.recordings.campaign import to_dict
from underskin.surrogate.sigma_table import load_table

SMALL = Made(sensors=1, spheres_mm=(4.0,), preloads_n=(0.6, 2.4), lines=8)
SLEEPING = """
import time
from pathlib import Path
from proof.stored import Work, of_each
if __name__ == "__main__":
    of_each(Work(Path("."), 2), [0.0] * 4 + [60.0] * 4, time.sleep, lambda done, count: Path("{done}").touch())
"""
PATIENCE_S = 240.0


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("campaigns")
    table = load_table()
    for number in range(4):
        document = to_dict(campaign(replace(SMALL, seed=number), table))
        (folder / f"palm-{number}.json").write_text(json.dumps(document), encoding="utf-8")
    return sorted(folder.iterdir())


def diagnosing(files: list[Path], output_dir: Path, workers: int, *without: str) -> list[str]:
    given = ["--output-dir", str(output_dir), "--workers", str(workers)]
    given += [part for name in without for part in ("--without", name)]
    return [sys.executable, "-m", "underskin", "diagnose", *map(str, files), *given]


def sleeping(_: list[Path], output_dir: Path) -> list[str]:
    script = output_dir / "sleeping.py"
    script.write_text(SLEEPING.format(done=output_dir / "done.json"), encoding="utf-8")
    return [sys.executable, str(script)]


def diagnosing_in_two(files: list[Path], output_dir: Path) -> list[str]:
    return diagnosing(files, output_dir, 2)


def workers_of(parent: int) -> list[int]:
    """Its processes but the one that multiprocessing keeps beside them."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            state, above = (folder / "stat").read_text().rpartition(")")[2].split()[:2]
            command = (folder / "cmdline").read_text()
        except OSError:
            continue
        if int(above) == parent and state not in "ZX" and "spawn_main" in command:
            found.append(int(folder.name))
    return found


def lives(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


def awaited(what: Callable[[], bool]) -> bool:
    end = time.monotonic() + PATIENCE_S
    while not what():
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "number"),
    first(
        2,
        [
            (sleeping, signal.SIGKILL),
            (diagnosing_in_two, signal.SIGTERM),
            (sleeping, signal.SIGTERM),
            (sleeping, signal.SIGINT),
        ],
    ),
)
def test_workers_end_with_what_started_them(
    command: Callable[[list[Path], Path], list[str]], number: signal.Signals, files: list[Path], tmp_path: Path
) -> None:
    with subprocess.Popen(command(files, tmp_path), stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as parent:
        try:
            assert awaited(lambda: any(tmp_path.glob("*.json")))
            workers = workers_of(parent.pid)
            assert len(workers) == 2
            parent.send_signal(number)
            assert parent.wait(PATIENCE_S) != 0
            assert awaited(lambda: not any(map(lives, workers)))
        finally:
            parent.kill()


@pytest.mark.slow
def test_reports_bytes_whatever_number_processes(files: list[Path], tmp_path: Path) -> None:
    """Reports are the same bytes whatever the number of processes and threads and whichever is killed."""
    found = []
    for workers, threads in ((1, "1"), (2, "2")):
        folder = tmp_path / str(workers)
        environment = os.environ | {"OMP_NUM_THREADS": threads, "OPENBLAS_NUM_THREADS": threads}
        command = diagnosing(files[:2], folder, workers, *BESIDE_SKINS)
        with subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True) as parent:
            if workers == 2:
                assert awaited(lambda: len(workers_of(parent.pid)) == 2)
                os.kill(workers_of(parent.pid)[0], signal.SIGKILL)
            _, said = parent.communicate()
        assert parent.returncode == 0, said
        found.append({file.name: file.read_bytes() for file in folder.iterdir()})
    assert sorted(found[0]) == [file.name for file in files[:2]]
    assert found[0] == found[1]
