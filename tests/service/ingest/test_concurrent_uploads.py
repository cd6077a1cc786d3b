"""Many large uploads at once: the service goes on answering, in little memory, and each upload is kept or turned away.

Eight of 6 MB; with UNDERSKIN_SOAK=1 a hundred of 60 MB.
"""

import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Self

import httpx
import numpy as np
import pytest

from bench.figures import Figure
from bench.soak import SOAK, record
from tests.support.memory import family_mb
from tests.support.server import Server, running

UPLOADS = 100 if SOAK else 8
MEGABYTES = 60 if SOAK else 6
MOST_MEMORY_MB = 1500
SLOWEST_HEALTH_S = 0.2 if SOAK else 1.0  # other tests run beside this one
RIG = """\
skin: {thickness_mm: 2.5, youngs_modulus_mpa: 16, sensor_radius_mm: 1.5}
recording: {sensor: s1, indenter_radius_mm: 4, preload_n: 1, dynamic_force_n: 0.09}
"""


def table(number: int) -> bytes:
    """A CSV file of so many megabytes whose columns no rig description maps: it is read whole, and refused."""
    values = np.random.default_rng(number).normal(size=(20_000, 3))
    block = "\n".join(",".join(f"{value:.6e}" for value in row) for row in values).encode() + b"\n"
    return b"time,one,two\n" + block * (MEGABYTES * 1_000_000 // len(block) + 1)


# In a process of its own, as a monitor is: beside a hundred threads that send, a thread waits for its interpreter.
PROBE = """\
import sys, time, urllib.request
while True:
    begun = time.monotonic()
    with urllib.request.urlopen(sys.argv[1], timeout=240) as answer:
        answer.read()
    print(time.monotonic() - begun, flush=True)
    time.sleep(0.1)
"""


class Watch:
    """Memory of a server and of the processes below it, and how long /health takes, while a block lasts."""

    def __init__(self, server: Server) -> None:
        self._server = server
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._look)
        self.memory_mb: list[float] = []
        self.health_s: list[float] = []

    def __enter__(self) -> Self:
        command = [sys.executable, "-c", PROBE, f"{self._server.url}/health"]
        self._probe = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.set()
        self._thread.join()
        assert self._probe.poll() is None, "/health was not answered"
        self._probe.terminate()
        self.health_s = [float(line) for line in self._probe.communicate()[0].splitlines()]

    def _look(self) -> None:
        while not self._ending.wait(0.1):
            self.memory_mb.append(family_mb(self._server.process.pid))


@pytest.mark.soak
@pytest.mark.alone
def test_many_large_uploads_at_once(tmp_path: Path) -> None:
    content = table(1)

    def send(number: int) -> int:
        files = {"file": (f"{number}.csv", content), "rig": ("rig.yaml", RIG.encode())}
        while True:
            answer = httpx.post(f"{server.url}/v1/campaigns", files=files, timeout=1800)
            if answer.status_code != 503:
                return answer.status_code
            time.sleep(float(answer.headers["Retry-After"]))

    with running(tmp_path) as server, Watch(server) as watch, ThreadPoolExecutor(UPLOADS) as senders:
        answers = list(senders.map(send, range(UPLOADS)))
    assert set(answers) == {422}, answers
    assert max(watch.memory_mb) <= MOST_MEMORY_MB
    assert max(watch.health_s) <= SLOWEST_HEALTH_S
    record(Figure("100 uploads of 60 MB at once: memory of all processes", max(watch.memory_mb), "MB", 1500, "lower"))
    record(Figure("100 uploads of 60 MB at once: /health, slowest", 1e3 * max(watch.health_s), "ms", 200, "lower"))
