"""Real `underskin serve` processes over a store that outlives them, and campaigns to send them."""

import os
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zlib import crc32

import httpx
import numpy as np

from tests.support import preloaded


@dataclass
class Place:
    """Where a store is: its folder and, on PostgreSQL, its database."""

    folder: Path
    database_url: str = ""

    def environment(self) -> dict[str, str]:
        """For every command that uses the store."""
        here = {"UNDERSKIN_DATA": str(self.folder), "UNDERSKIN_DATABASE_URL": self.database_url}
        return os.environ | here | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}

    def command(self, *arguments: str, **settings: str) -> "subprocess.CompletedProcess[str]":
        """Run `underskin` to its end."""
        return preloaded.run(*arguments, environment=self.environment() | settings)


@dataclass
class Server:
    """A running server and a client of it."""

    process: preloaded.Process
    http: httpx.Client
    place: Place

    def kill(self) -> None:
        """As when the power fails."""
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()


@contextmanager
def running(place: Place, *, key: str | None = None, **settings: str) -> Iterator[Server]:
    """A server over `place`; killed at the end, since it must not matter."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    environment = {"UNDERSKIN_DIAGNOSIS_READY": "false"} | place.environment() | settings
    log = place.folder.parent / f"{place.folder.name}.log"
    headers = {} if key is None else {"Authorization": f"Bearer {key}"}
    with log.open("ab") as stderr:
        process = preloaded.start(["serve", "--port", str(port)], environment, (0, 1, stderr.fileno()))
    try:
        with httpx.Client(base_url=f"http://127.0.0.1:{port}", headers=headers, timeout=300) as client:
            _wait_until_ready(client, process, log)
            yield Server(process, client, place)
    finally:
        process.kill()
        process.wait()


def _wait_until_ready(client: httpx.Client, process: preloaded.Process, log: Path) -> None:
    deadline = time.monotonic() + 240  # a machine may be busy
    while time.monotonic() < deadline:
        assert process.poll() is None, log.read_text()[-2000:]
        try:
            if client.get("/ready").status_code == 200:
                return
        except httpx.TransportError:
            time.sleep(0.02)
    raise AssertionError(f"not ready: {log.read_text()[-2000:]}")


def campaign(name: str, *, sensors: int = 3, lines: int = 20, d33: float = 14.0, **skin: Any) -> dict[str, Any]:
    """A campaign document: each sensor under two loads, noise around a plateau that d33 14 pC/N gives roughly."""
    generator = np.random.default_rng(crc32(name.encode()))
    frequency = np.geomspace(5, 130, lines).round(3).tolist()
    recordings = []
    for sensor in range(sensors):
        for preload in (1.0, 2.0):
            frf = 0.5 * d33 * generator.normal(1, 0.01) * (1 + 0.01 * generator.normal(size=lines))
            recordings.append(
                {
                    "id": f"s{sensor}-{preload:g}N",
                    "sensor": f"s{sensor}",
                    "indenter_radius_mm": 4.0,
                    "preload_n": preload,
                    "dynamic_force_n": 0.09,
                    "recorded_at": "2017-05-03T09:00:00Z",
                    "frequency_hz": frequency,
                    "frf_re_pc_per_n": frf.tolist(),
                    "frf_im_pc_per_n": (0.02 * generator.normal(size=lines)).tolist(),
                    "coherence": [0.999] * lines,
                }
            )
    description = {
        "thickness_mm": 2.5,
        "youngs_modulus_mpa": 16.0,
        "poisson_ratio": 0.5,
        "sensor_radius_mm": 1.5,
        "sensors": [{"id": f"s{sensor}", "x_mm": 8.0 * sensor, "y_mm": 0.0} for sensor in range(sensors)],
        **skin,
    }
    return {"schema": "campaign/1", "name": name, "skin": description, "recordings": recordings}
