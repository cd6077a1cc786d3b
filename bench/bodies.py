"""JSON bodies of the largest allowed size: the response time of `/health` meanwhile, and the memory that they take."""

import http.client
import json
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from bench import servers
from bench.diagnosed import document
from bench.figures import Figure
from bench.servers import Server
from tests.support.process_memory import memory_bytes

_BYTES = 62_000_000
_QUIET_S = 3.0
_EVERY_S = 0.01
_P = 0.99


def _filled(start: str, element: str, end: str) -> bytes:
    """A body made of one repeated element."""
    return f"{start}{element * ((_BYTES - len(start) - len(end)) // len(element))}{end}".encode()


def _columns() -> bytes:
    """Two columns with all digits."""
    number = "0.30000000000000004, "
    column = f"[{number * (_BYTES // 2 // len(number))}1]"
    return f'{{"a_over_h": {column}, "rt_over_h": {column}}}'.encode()


def _campaign(size: int = _BYTES) -> bytes:
    """Recordings of 60 lines, of `size` bytes in all."""
    made = document({}, columns=4, preloads_n=(0.5, 1.0), lines=60)
    recordings = made["recordings"]
    assert isinstance(recordings, list)
    recording = json.dumps(recordings[0])
    entries = (
        recording.replace(f'"{recordings[0]["id"]}"', f'"r{number}"', 1) for number in range(size // len(recording))
    )
    return (
        json.dumps({**made, "recordings": []})
        .replace('"recordings": []', f'"recordings": [{",".join(entries)}]')
        .encode()
    )


_NUMBER = f"0.25{'0' * 28}, "  # so long that a list may have as many as there is room for


_BODIES: dict[str, tuple[str, Callable[[], bytes], int]] = {
    "sigma, all digits": ("/v1/sigma", _columns, 200),
    "sigma, empty lists": ("/v1/sigma", lambda: _filled('{"rt_over_h": 0.6, "a_over_h": [', "[],", "1]}"), 413),
    "d33, nulls": ("/v1/d33", lambda: _filled('{"thickness_mm": [', "null,", "1]}"), 413),
    "Evaluate": ("/umbridge/Evaluate", lambda: _filled('{"name": "sigma", "input": [[', _NUMBER, "1]]}"), 400),
    "campaign": ("/v1/campaigns", _campaign, 201),
}  # fmt: skip


def measure() -> list[Figure]:
    """The 99th percentile of `/health` while nothing else is asked and beside each body, and the most memory."""
    figures = []
    with servers.underskin() as server:
        with _small_requests(server) as quiet:
            time.sleep(_QUIET_S)
        _post(
            server, "/v1/campaigns", _campaign(_BYTES // 1000), 201
        )  # starts the processes that the server keeps ready afterwards
        time.sleep(_QUIET_S)
        figures.append(Figure("/health beside nothing, 99th percentile", 1e3 * _percentile(quiet.times_s), "ms"))
        for name, (path, make, status) in _BODIES.items():
            body = make()
            before = memory_bytes(server.process.pid)
            with _small_requests(server) as small_requests:
                _post(server, path, body, status)
            times = 1e3 * _percentile(small_requests.times_s)
            figures.append(Figure(f"/health beside 62 MB, {name}, 99th percentile", times, "ms", 200, "lower"))
            longest = f"processor time of the server within one /health beside 62 MB, {name}, longest"
            figures.append(Figure(longest, 1e3 * max(small_requests.held_s), "ms", 200, "lower"))
            grown = (small_requests.memory_bytes - before) / len(body)
            figures.append(Figure(f"memory beside 62 MB, {name}", grown, "× the body", 6, "lower"))
    return figures


class _SmallRequests:
    """What is measured while a request is answered."""

    def __init__(self) -> None:
        self.times_s: list[float] = []
        self.held_s: list[float] = []  # processor time of the server within each
        self.memory_bytes = 0
        self.ended = threading.Event()


@contextmanager
def _small_requests(server: Server) -> Iterator[_SmallRequests]:
    seen = _SmallRequests()

    def ask() -> None:
        connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=60)
        while not seen.ended.wait(_EVERY_S):
            start, held = time.perf_counter(), servers.processor_s(server.process.pid)
            connection.request("GET", "/health")
            connection.getresponse().read()
            seen.times_s.append(time.perf_counter() - start)
            seen.held_s.append(servers.processor_s(server.process.pid) - held)
        connection.close()

    def look() -> None:
        while not seen.ended.wait(_EVERY_S):
            seen.memory_bytes = max(seen.memory_bytes, memory_bytes(server.process.pid))

    threads = [threading.Thread(target=run) for run in (ask, look)]
    for thread in threads:
        thread.start()
    try:
        yield seen
    finally:
        seen.ended.set()
        for thread in threads:
            thread.join()


def _post(server: Server, path: str, body: bytes, status: int) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=600)
    connection.request("POST", path, body, {"Content-Type": "application/json"})
    answer = connection.getresponse()
    message = answer.read()
    connection.close()
    if answer.status != status:
        raise RuntimeError(f"{path} answered {answer.status}: {message[:500].decode()}")


def _percentile(times_s: list[float]) -> float:
    return sorted(times_s)[int(_P * (len(times_s) - 1))]
