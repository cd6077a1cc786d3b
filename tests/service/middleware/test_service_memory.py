"""What anybody may send without a key takes no memory: bodies, headers and trailers are counted as they come in."""

import json
import re
import select
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import httpx
import pytest

from service.auth.keys import KeyStore
from tests.service.connections import assert_too_large, connect, read_answer
from tests.support.server import Server, running

UNFINISHED = 20
SENT = 10_000_000  # bytes on each connection
FORM = "Host: localhost\r\nContent-Type: application/x-www-form-urlencoded\r\n"


@pytest.fixture(scope="module")
def keyed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server that has a key; it is not used."""
    folder = tmp_path_factory.mktemp("memory")
    KeyStore(folder / "data").create("lab", "write")
    with running(folder) as started:
        yield started


def memory_kb(server: Server) -> int:
    """Of the server's process, now."""
    found = re.search(r"VmRSS:\s+(\d+) kB", Path(f"/proc/{server.process.pid}/status").read_text())
    assert found
    return int(found[1])


def send_on(connections: list[socket.socket], piece: bytes) -> None:
    """SENT bytes on each of the connections, as far as the server takes them within a few seconds."""
    deadline = time.monotonic() + 3
    left = {connection: memoryview(piece * (SENT // len(piece))) for connection in connections}
    while left and time.monotonic() < deadline:
        _, writable, _ = select.select([], left, [], 0.2)
        for connection in writable:
            try:
                left[connection] = left[connection][connection.send(left[connection][:500_000]) :]
            except ConnectionError:
                left[connection] = memoryview(b"")
        left = {connection: rest for connection, rest in left.items() if rest}


def assert_modest(server: Server, head: str, piece: bytes) -> None:
    """Many connections that send `piece` after `head` again and again, and never end, take little memory."""
    before = memory_kb(server)
    with ExitStack() as stack:
        connections = [stack.enter_context(connect(server)) for _ in range(UNFINISHED)]
        for connection in connections:
            connection.sendall(head.encode())
        send_on(connections, piece)
        assert memory_kb(server) - before < 40_000
        assert httpx.get(f"{server.url}/ready").status_code == 200


@pytest.mark.parametrize(
    ("length", "piece"),
    [
        ("Content-Length: 60000000\r\n\r\n", b"k" * 1_000_000),
        ("Transfer-Encoding: chunked\r\n\r\n", b"f4240\r\n" + b"k" * 1_000_000 + b"\r\n"),
    ],
)
@pytest.mark.parametrize("path", ["/login", "/ready", "/v1/campaigns"])
def test_unfinished_bodies_take_no_memory(keyed: Server, path: str, length: str, piece: bytes) -> None:
    assert_modest(keyed, f"POST {path} HTTP/1.1\r\n{FORM}{length}", piece)


@pytest.mark.parametrize(
    ("head", "piece"),
    [
        ("GET /", b"k" * 1_000_000),
        (f"GET / HTTP/1.1\r\n{FORM}X-Long: ", b"k" * 1_000_000),
        (f"GET / HTTP/1.1\r\n{FORM}", b"X-Many: 1\r\n" * 90_000),
        (f"POST /login HTTP/1.1\r\n{FORM}Transfer-Encoding: chunked\r\n\r\n0\r\n", b"X-Many: 1\r\n" * 90_000),
    ],
)
def test_headers_without_end_take_no_memory(keyed: Server, head: str, piece: bytes) -> None:
    assert_modest(keyed, head, piece)


def test_a_chunked_login_form_is_refused_once_it_is_too_long(keyed: Server) -> None:
    with connect(keyed) as connection:
        connection.sendall(f"POST /login HTTP/1.1\r\n{FORM}Transfer-Encoding: chunked\r\n\r\n".encode())
        connection.sendall(b"1f41\r\n" + b"k" * 8001 + b"\r\n")
        assert_too_large(read_answer(connection))


def test_forms_of_pages_are_counted_as_they_come_in(http: httpx.Client, shared_server: Server) -> None:
    with connect(shared_server) as connection:
        connection.sendall(f"POST /example HTTP/1.1\r\n{FORM}Content-Length: 60000000\r\n\r\n".encode())
        connection.sendall(b"k" * 100_001)  # and no more
        status, _, body = read_answer(connection)
    assert (status, json.loads(body)["title"]) == (413, "Body too large")
    assert http.get("/health").status_code == 200
