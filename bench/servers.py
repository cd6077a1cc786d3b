"""Real server processes, each pinned to one core: ours and the peers'."""

import http.client
import json
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from underskin.surrogate.hdf5_format import tables_folder
from underskin.surrogate.sigma_table import SIGMA_TABLE

CHECKOUT = Path(__file__).parent.parent
TABLE = tables_folder() / SIGMA_TABLE
_CORES = sorted(os.sched_getaffinity(0))
SERVER_CORE, LOAD_CORE = _CORES[0], _CORES[-1]
_START_LIMIT = 60.0  # s


@dataclass(frozen=True)
class Server:
    """A running server."""

    process: subprocess.Popen[bytes]
    port: int
    started_in: float  # s, from launching the process to its first answer

    def resident_mb(self) -> float:
        """Memory of the process, which has no children."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmRSS")) / 1024

    def post(self, path: str, body: object) -> Any:
        """The answer to one JSON request."""
        return self._request("POST", path, json.dumps(body))

    def get(self, path: str) -> Any:
        """The JSON at `path`."""
        return self._request("GET", path, None)

    def _request(self, method: str, path: str, body: str | None) -> Any:
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        connection.request(method, path, body, {"Content-Type": "application/json"})
        response = connection.getresponse()
        text = response.read()
        connection.close()
        if response.status not in (200, 201):
            raise RuntimeError(f"{path} answered {response.status}: {text[:500].decode()}")
        return json.loads(text)


def processor_s(pid: int) -> float:
    """Processor time of a process so far, without the processes that it started."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@contextmanager
def underskin(data: Path | None = None) -> Iterator[Server]:
    """Our service as `make serve` starts it; its data are in `data`, or deleted at the end."""
    port = _free_port()
    command = [str(Path(sys.executable).with_name("underskin")), "serve", "--port", str(port)]
    with (
        tempfile.TemporaryDirectory() as scratch,
        _running(command, port, "/ready", {"UNDERSKIN_DATA": str(data or scratch)}) as server,
    ):
        yield server


def umbridge() -> AbstractContextManager[Server]:
    """The umbridge package's server."""
    return _peer("umbridge_server", "/Info")


def plain_sigma() -> AbstractContextManager[Server]:
    """A FastAPI route around SciPy's spline, on the same event loop and HTTP parser as ours."""
    return _peer("plain_sigma", "/ready")


@contextmanager
def _peer(module: str, path: str) -> Iterator[Server]:
    """A server in bench/peers, which answers from our table and is up once `path` answers."""
    port = _free_port()
    with _running([sys.executable, "-m", f"bench.peers.{module}", str(TABLE), str(port)], port, path) as server:
        yield server


@contextmanager
def tesseract() -> Iterator[Server]:
    """Tesseract Core's runtime, from the environment that `make bench` installs for it."""
    port = _free_port()
    command = [str(CHECKOUT / ".venv-tesseract" / "bin" / "tesseract-runtime"), "serve", "--port", str(port)]
    settings = {
        "TESSERACT_API_PATH": str(CHECKOUT / "bench" / "peers" / "tesseract_api.py"),
        "SIGMA_TABLE": str(TABLE),
        "PYTHONPATH": str(CHECKOUT),
    }
    with _running(command, port, "/health", settings) as server:
        yield server


@contextmanager
def _running(
    command: Sequence[str], port: int, path: str, settings: Mapping[str, str] | None = None
) -> Iterator[Server]:
    single_thread = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    # Tesseract's runtime leaves a folder per request where it runs; in memory it is not slowed by the disk.
    with tempfile.TemporaryFile("w+") as errors, tempfile.TemporaryDirectory(dir="/dev/shm") as scratch:
        start = time.perf_counter()
        process = subprocess.Popen(
            ["taskset", "-c", str(SERVER_CORE), *command],
            env=os.environ | single_thread | dict(settings or {}),
            cwd=scratch,
            stdout=subprocess.DEVNULL,
            stderr=errors,
        )
        try:
            while not _answers(port, path):
                if process.poll() is not None or time.perf_counter() - start > _START_LIMIT:
                    errors.seek(0)
                    raise RuntimeError(f"did not start: {' '.join(command)}\n{errors.read()[-2000:]}")
                time.sleep(0.002)
            yield Server(process, port, time.perf_counter() - start)
        finally:
            process.terminate()
            process.wait(10)


def _answers(port: int, path: str) -> bool:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=5)
    try:
        connection.request("GET", path)
        return connection.getresponse().status == 200
    except OSError:
        return False
    finally:
        connection.close()


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
