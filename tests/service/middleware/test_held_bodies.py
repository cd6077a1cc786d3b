"""Large bodies that many send at once take no more memory than eight may have; short ones pass all the same."""

import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack

import httpx
import pytest

from tests.service.connections import HEAD, connect, read_answer
from tests.service.requests import SIGMA
from tests.service.waiting import until
from tests.support.process_memory import memory_bytes
from tests.support.server import Server, running

MB = 1_000_000
LIMIT_MB = 8
SENDERS = 24  # of 7 MB each, 6 MB of them counted: ten have room


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One with small limits, for all tests here."""
    settings = {"UNDERSKIN_MAX_BODY_MB": str(LIMIT_MB), "UNDERSKIN_DIAGNOSIS_WORKERS": "0"}
    with running(tmp_path_factory.mktemp("held"), settings) as started:
        yield started


def begun(server: Server, megabytes: int) -> socket.socket:
    """A connection with a body of so many megabytes, of which the last byte is still to come."""
    connection = connect(server)
    connection.sendall(f"POST /v1/sigma HTTP/1.1\r\n{HEAD}Content-Length: {megabytes * MB + 1}\r\n\r\n".encode())
    connection.sendall(b" " * (megabytes * MB))
    return connection


def test_bodies_at_once_take_bounded_memory(server: Server) -> None:
    before = memory_bytes(server.process.pid)
    with ExitStack() as stack:
        connections = [stack.enter_context(begun(server, 7)) for _ in range(SENDERS)]
        time.sleep(0.5)
        assert memory_bytes(server.process.pid) - before < 2 * 8 * LIMIT_MB * MB
        short = httpx.post(f"{server.url}/v1/sigma", json=SIGMA, timeout=300)
        assert short.status_code == 200
        answers = []
        for connection in connections:
            connection.sendall(b" ")
            answers.append(read_answer(connection))
    statuses = [status for status, _, _ in answers]
    assert statuses.count(503) == SENDERS - 10
    assert statuses.count(400) == 10  # spaces are no JSON
    assert all(headers["retry-after"] for status, headers, _ in answers if status == 503)


@pytest.mark.soak
def test_room_is_free_again_once_they_are_answered(server: Server) -> None:
    for _ in range(11):
        with begun(server, 7) as connection:
            connection.sendall(b" ")
            assert read_answer(connection)[0] == 400
    for _ in range(11):
        begun(server, 7).close()  # the client leaves

    def has_room() -> bool:
        with begun(server, 7) as connection:
            connection.sendall(b" ")
            return read_answer(connection)[0] == 400

    until(has_room, "there is no room again")
