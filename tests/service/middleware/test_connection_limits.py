"""Clients that are slow, silent or many: disconnected or kept out, counted and logged, and `/health` answers."""

import json
import os
import re
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import httpx
import pytest

from service.auth.keys import KeyStore
from tests.service.connections import HEAD, connect, read_answer
from tests.service.waiting import until
from tests.support.memory import family_mb
from tests.support.server import Server, free_port, running

IDLE_S = 1.0
HANGS_S = 240.0  # longer than a connection that is given up stays on the busiest machine
CONNECTIONS = 20
BODY = f"POST /v1/sigma HTTP/1.1\r\n{HEAD}Content-Length: 60000\r\n\r\n"
DESCRIPTORS = 256
LIMITS = {
    "UNDERSKIN_IDLE_SECONDS": str(IDLE_S),
    "UNDERSKIN_MAX_CONNECTIONS": str(CONNECTIONS),
    "UNDERSKIN_MAX_HEADER_KB": "8",
    "UNDERSKIN_DIAGNOSIS_WORKERS": "0",
}


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One with limits that a test can reach."""
    with running(tmp_path_factory.mktemp("connections"), LIMITS) as started:
        yield started


@pytest.fixture(scope="module")
def locked(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One that asks for a key, with the same limits, but that gives slow clients longer than a test takes."""
    folder = tmp_path_factory.mktemp("locked")
    (folder / "token").write_text(KeyStore(folder / "data").create("shaker", "write"))
    with running(folder, LIMITS | {"UNDERSKIN_IDLE_SECONDS": "60"}) as started:
        yield started


def is_well(server: Server) -> bool:
    """Whether `/health` answers, on a connection of its own."""
    return httpx.get(f"{server.url}/health", timeout=240).status_code == 200


def counted(server: Server, limit: str) -> float:
    """How often a limit was reached, by the metrics."""
    token = server.log.parent / "token"
    headers = {"Authorization": f"Bearer {token.read_text()}"} if token.exists() else {}
    metrics = httpx.get(f"{server.url}/metrics", headers=headers).raise_for_status().text
    found = re.search(rf'underskin_limits_reached_total{{limit="{limit}"}} (\S+)', metrics)
    return float(found[1]) if found else 0.0


@contextmanager
def reaching(server: Server, limit: str) -> Iterator[None]:
    """A block in which a limit is reached: the metrics count it, and the log has a line of it."""
    before = counted(server, limit)
    yield
    assert counted(server, limit) > before
    lines = [json.loads(line) for line in server.log.read_text().splitlines() if line.startswith("{")]
    said = [line["message"] for line in lines if line.get("limit") == limit]
    assert said
    assert all("UNDERSKIN_" in line or limit == "pipelining" for line in said)


def undisturbed(attempt: Callable[[], object]) -> None:
    """Make attempts until one is right: in others the machine may have kept this test longer than a client may take."""
    for left in reversed(range(20)):
        begun = time.monotonic()
        try:
            attempt()
        except (AssertionError, OSError, pytest.fail.Exception):
            if left == 0 or time.monotonic() - begun < IDLE_S:
                raise
        else:
            return


def seconds_until_closed(connection: socket.socket, drip: bytes = b"", every_s: float = 0.1) -> float:
    """How long the server keeps a connection on which `drip` is sent again and again."""
    start = time.monotonic()
    connection.settimeout(every_s)
    while time.monotonic() - start < HANGS_S:
        try:
            if not connection.recv(1000):
                break
        except TimeoutError:
            with suppress(ConnectionError):
                connection.sendall(drip)
        except ConnectionError:
            break
    return time.monotonic() - start


@pytest.mark.parametrize(("begun", "drip"), [("", ""), (f"GET /health HTTP/1.1\r\n{HEAD}", "X-Slow: 1\r\n")])
def test_headers_that_do_not_end_are_given_up(server: Server, begun: str, drip: str) -> None:
    with reaching(server, "idle_headers"), connect(server) as connection:
        connection.sendall(begun.encode())
        assert IDLE_S - 0.3 < seconds_until_closed(connection, drip.encode()) < HANGS_S
    assert is_well(server)


@pytest.mark.parametrize(("path", "drip"), [("/v1/sigma", b""), ("/v1/campaigns", b" "), ("/login", b" ")])
def test_a_body_that_trickles_is_given_up(server: Server, path: str, drip: bytes) -> None:
    with reaching(server, "idle_body"), connect(server) as connection:
        connection.sendall(BODY.replace("/v1/sigma", path).replace("60000", "6000").encode() + b"{")
        assert IDLE_S - 0.3 < seconds_until_closed(connection, drip) < HANGS_S
    assert is_well(server)


def test_a_body_that_goes_on_is_taken_however_long_it_takes(server: Server) -> None:
    def attempt() -> None:
        body = json.dumps({"a_over_h": 0.3, "rt_over_h": 0.6}).encode().ljust(60_000)
        with connect(server) as connection:
            connection.sendall(BODY.encode())
            for start in range(0, len(body), 5000):  # 60 kB over 3.6 s, three times the limit
                time.sleep(0.3)
                connection.sendall(body[start : start + 5000])
            assert read_answer(connection)[0] == 200

    undisturbed(attempt)


def test_who_does_not_take_the_answer_is_disconnected(server: Server) -> None:
    body = json.dumps({"a_over_h": [0.3] * 200_000, "rt_over_h": 0.6}).encode()
    with reaching(server, "idle_answer"), connect(server) as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        connection.sendall(f"POST /v1/sigma HTTP/1.1\r\n{HEAD}Content-Length: {len(body)}\r\n\r\n".encode() + body)
        before = counted(server, "idle_answer")
        until(lambda: counted(server, "idle_answer") != before)


def test_a_request_that_takes_the_server_long_is_not_given_up(tmp_path: Path) -> None:
    """The time counts while it is the client's turn alone."""
    with running(tmp_path, {"UNDERSKIN_IDLE_SECONDS": "1"}) as server:
        numbers = ", ".join(["0.30000000000000004"] * 1_000_000)
        body = f'{{"a_over_h": [{numbers}], "rt_over_h": 0.6}}'.encode()
        answer = httpx.post(
            f"{server.url}/v1/sigma", content=body, headers={"Content-Type": "application/json"}, timeout=240
        )
    assert len(answer.raise_for_status().json()["sigma"]) == 1_000_000


@pytest.mark.parametrize(
    "request_of",
    [
        lambda length: f"GET /health HTTP/1.1\r\n{HEAD}X-Long: {'k' * length}",
        lambda length: f"GET /health HTTP/1.1\r\n{HEAD}X-Long: {'k' * length}\r\n\r\n",
        lambda length: f"GET /health HTTP/1.1\r\n{HEAD}" + "X-Long: k\r\n" * (length // 10) + "\r\n",
        lambda length: f"GET /health?{'k' * length} HTTP/1.1\r\n{HEAD}\r\n",
    ],
    ids=["without an end", "at once", "many", "query"],
)
def test_the_length_of_headers_is_a_setting(server: Server, request_of: Callable[[int], str]) -> None:
    with reaching(server, "header_size"), connect(server) as connection:
        connection.sendall(request_of(9000).encode())
        assert read_answer(connection)[0] == 400
    assert httpx.get(f"{server.url}/health", headers={"X-Long": "k" * 7000}).status_code == 200


def opened(server: Server, count: int, begun: str, stack: ExitStack) -> Sequence[socket.socket]:
    """So many connections on which something was sent."""
    connections = [stack.enter_context(connect(server)) for _ in range(count)]
    for connection in connections:
        with suppress(ConnectionError):
            connection.sendall(begun.encode())
    return connections


def test_requests_sent_ahead_are_answered_in_their_order(server: Server) -> None:
    """A hundred, and a last one whose body comes later."""

    def attempt() -> None:
        body = json.dumps({"a_over_h": 0.3, "rt_over_h": 0.6}).encode().ljust(60_000)
        with connect(server) as connection:
            connection.sendall(f"GET /v1/nothing HTTP/1.1\r\n{HEAD}\r\n".encode())
            for _ in range(49):
                connection.sendall(f"GET /health HTTP/1.1\r\n{HEAD}\r\nGET /ready HTTP/1.1\r\n{HEAD}\r\n".encode())
            connection.sendall(BODY.encode() + body[:100])
            answers = [read_answer(connection) for _ in range(99)]
            connection.sendall(body[100:])
            last = read_answer(connection)
        assert [status for status, _, _ in answers] == [404] + 98 * [200]
        assert [b"table" in text for _, _, text in answers[1:]] == 49 * [False, True]
        assert last[0] == 200
        assert "sigma" in json.loads(last[2])

    undisturbed(attempt)


def test_a_client_far_ahead_of_its_answers_is_disconnected(server: Server) -> None:
    """However much it sends and however little it reads, the memory stays and others are answered."""
    request = f"GET /v1/tables HTTP/1.1\r\n{HEAD}\r\n".encode()
    before = family_mb(server.process.pid)
    with reaching(server, "pipelining"), ExitStack() as stack:
        for _ in range(5):
            connection = stack.enter_context(connect(server))
            connection.settimeout(2)
            with suppress(ConnectionError, TimeoutError):
                for _ in range(40):
                    connection.sendall(2000 * request)
            assert is_well(server)
    assert family_mb(server.process.pid) < before + 40


REFUSED = BODY.replace("60000", "6000000")  # without a key
UNREAD = 9 * f"GET /static/plotly.min.js HTTP/1.1\r\n{HEAD}\r\n"


@pytest.mark.parametrize("begun", [REFUSED, UNREAD], ids=["refused", "unread"])
def test_who_was_refused_or_does_not_read_gives_way(locked: Server, begun: str) -> None:
    """Though the refused body goes on, and though other requests wait behind the answer that is not read."""
    with ExitStack() as stack:
        connections = [one for _ in range(4) for one in opened(locked, CONNECTIONS, begun, stack)]
        deadline = time.monotonic() + 240
        while httpx.get(f"{locked.url}/v1/tables", timeout=240).status_code != 401:
            assert time.monotonic() < deadline
            for connection in connections if begun is REFUSED else []:
                with suppress(ConnectionError):
                    connection.sendall(b" " * 500)
            assert is_well(locked)


def test_a_body_that_goes_on_after_its_answer_is_given_up(server: Server) -> None:
    with reaching(server, "idle_body"), connect(server) as connection:
        connection.sendall(BODY.replace("60000", "6000000").replace("/v1/sigma", "/v1/nothing").encode() + b"{")
        assert read_answer(connection)[0] == 404
        assert IDLE_S - 0.3 < seconds_until_closed(connection, 3000 * b" ") < HANGS_S


@pytest.mark.parametrize("begun", ["", "GET /health HTTP/1.1\r\n", BODY], ids=["silent", "headers", "bodies"])
def test_health_answers_however_many_connections_wait(server: Server, begun: str) -> None:
    with reaching(server, "connections"), ExitStack() as stack:
        for _ in range(5):
            opened(server, CONNECTIONS, begun, stack)
            assert is_well(server)


def test_beyond_the_limit_the_rest_is_told_to_come_again(server: Server) -> None:
    """While all connections send their bodies, none gives way."""

    def attempt() -> None:
        with ExitStack() as stack:
            connections = opened(server, CONNECTIONS, BODY, stack)
            for connection in connections:
                connection.sendall(b" " * 1000)
            with connect(server) as late:
                late.sendall(f"GET /v1/tables HTTP/1.1\r\n{HEAD}\r\n".encode())
                status, headers, _ = read_answer(late)
            with connect(server) as late:
                late.sendall(f"GET /health HTTP/1.1\r\n{HEAD}\r\n".encode())
                healthy, _, _ = read_answer(late)
            body = json.dumps({"a_over_h": 0.3, "rt_over_h": 0.6}).encode().ljust(59_000)
            connections[0].sendall(body)
            answered, _, _ = read_answer(connections[0])
        assert (status, headers["connection"], int(headers["retry-after"]) > 0, healthy, answered) == (
            503,
            "close",
            True,
            200,
            200,
        )

    undisturbed(attempt)


def test_health_answers_with_more_connections_than_descriptors(tmp_path: Path) -> None:
    """The setting is beyond what the process may have open."""
    port = free_port()
    command = [str(Path(sys.executable).with_name("underskin")), "serve", "--port", str(port)]
    few = ["sh", "-c", f'ulimit -n {DESCRIPTORS}; exec "$0" "$@"', *command]
    environment = os.environ | {"UNDERSKIN_DATA": str(tmp_path), "UNDERSKIN_DIAGNOSIS_WORKERS": "0"}
    log = tmp_path / "server.log"
    with log.open("wb") as errors, subprocess.Popen(few, env=environment, stdout=errors, stderr=errors) as process:
        try:
            url = f"http://127.0.0.1:{port}"
            deadline = time.monotonic() + 240
            while "serves on" not in log.read_text():
                assert process.poll() is None, log.read_text()
                assert time.monotonic() < deadline
                time.sleep(0.05)
            with ExitStack() as stack:
                for _ in range(13):
                    for _ in range(20):
                        stack.enter_context(socket.create_connection(("127.0.0.1", port), timeout=300))
                    assert httpx.get(f"{url}/health", timeout=300).status_code == 200
                assert httpx.get(f"{url}/v1/tables", timeout=300).status_code == 200
            assert '"limit":"connections"' in log.read_text()
        finally:
            process.terminate()
