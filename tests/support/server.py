"""A real server process for the tests that talk HTTP."""

import os
import socket
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx

from tests.support import preloaded

_START_LIMIT = 240.0  # s: a machine may be busy
_END_LIMIT = 240.0  # s, with the diagnosis that it is at


@dataclass(frozen=True)
class Server:
    """A running `underskin serve`."""

    url: str
    process: preloaded.Process
    log: Path


def free_port() -> int:
    """A port of the loopback that nobody listens on."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return int(listener.getsockname()[1])


@contextmanager
def running(folder: Path, settings: Mapping[str, str] | None = None, *options: str) -> Iterator[Server]:
    """`underskin serve` with its data and log in `folder`; RuntimeError with its log when it does not start."""
    port = free_port()
    log = folder / "server.log"
    environment = {
        **os.environ,
        "UNDERSKIN_DIAGNOSIS_READY": "false",
        "UNDERSKIN_DATA": str(folder / "data"),
        **dict(settings or {}),
    }
    with log.open("wb") as errors:
        files = (0, errors.fileno(), errors.fileno())
        process = preloaded.start(["serve", "--port", str(port), *options], environment, files)
    try:
        url = f"http://127.0.0.1:{port}"
        _await_ready(url, process, log)
        yield Server(url, process, log)
    finally:
        process.terminate()
        process.wait(_END_LIMIT)


def _await_ready(url: str, process: preloaded.Process, log: Path) -> None:
    end = time.monotonic() + _START_LIMIT
    with httpx.Client(timeout=_START_LIMIT) as client:  # one: its certificates take longer to load than the answer
        while time.monotonic() < end and process.poll() is None:
            try:
                if client.get(f"{url}/ready").status_code == 200:
                    return
            except httpx.TransportError:
                time.sleep(0.05)
    raise RuntimeError(f"the server did not start: {log.read_text()[-2000:]}")
