"""Bodies over the limit, and senders that lie about them or give up: refused or dropped, and the server goes on."""

import json
import time
from collections.abc import Iterator

import httpx
import pytest

from tests.service.connections import BODIES, HEAD, assert_too_large, connect, read_answer
from tests.service.requests import SIGMA, problem_of
from tests.support.server import Server, running

LIMIT = 50_000  # bytes


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server that takes bodies of up to LIMIT bytes."""
    with running(tmp_path_factory.mktemp("limits"), {"UNDERSKIN_MAX_BODY_MB": str(LIMIT / 1e6)}) as started:
        yield started


@pytest.fixture
def client(small: Server) -> Iterator[httpx.Client]:
    """A client of it; whatever a test did, the server must be well afterwards."""
    with httpx.Client(base_url=small.url, timeout=300) as opened:
        yield opened
        assert opened.post("/v1/sigma", json=SIGMA).status_code == 200


def padded(path: str, size: int) -> bytes:
    """A body that `path` accepts, filled up with blanks."""
    return json.dumps(BODIES[path]).encode().ljust(size)


@pytest.mark.parametrize("chunked", [False, True])
@pytest.mark.parametrize("path", BODIES)
def test_the_limit_is_where_the_setting_says(client: httpx.Client, path: str, chunked: bool) -> None:
    def post(size: int) -> httpx.Response:
        body = padded(path, size)
        pieces = (body[start : start + 7000] for start in range(0, size, 7000))
        return client.post(path, content=pieces if chunked else body, headers={"Content-Type": "application/json"})

    assert post(LIMIT).status_code == 200
    problem = problem_of(post(LIMIT + 1), 413)
    assert "0.05 MB (UNDERSKIN_MAX_BODY_MB)" in problem.get("detail", problem.get("message", ""))


@pytest.mark.usefixtures("client")
def test_a_declared_length_is_refused_before_anything_is_sent(small: Server) -> None:
    for length in (LIMIT + 1, 2**64 - 1):
        with connect(small) as connection:
            head = f"POST /v1/sigma HTTP/1.1\r\n{HEAD}Content-Length: {length}\r\nExpect: 100-continue\r\n\r\n"
            connection.sendall(head.encode())
            assert_too_large(read_answer(connection))


@pytest.mark.usefixtures("client")
def test_the_connection_serves_on_after_a_refused_body(small: Server) -> None:
    length = LIMIT + 1
    with connect(small) as connection:
        head = f"POST /v1/sigma HTTP/1.1\r\n{HEAD}Content-Length: {length}\r\n\r\n"
        connection.sendall(head.encode() + b" " * length)
        assert_too_large(read_answer(connection))
        connection.sendall(f"GET /health HTTP/1.1\r\n{HEAD}\r\n".encode())
        assert read_answer(connection)[0] == 200


@pytest.mark.usefixtures("client")
def test_what_exceeds_a_length_that_is_too_small_is_not_taken_for_body(small: Server) -> None:
    body = padded("/v1/sigma", LIMIT + 1)
    with connect(small) as connection:
        head = f"POST /v1/sigma HTTP/1.1\r\n{HEAD}Content-Length: 20\r\n\r\n"
        connection.sendall(head.encode() + body[:20])
        status, headers, answer = read_answer(connection)
        assert (status, headers["content-type"]) == (400, "application/problem+json")
        assert "not JSON" in json.loads(answer)["detail"]
        connection.sendall(body[20:])  # where a request should begin
        status, headers, _ = read_answer(connection)
        assert (status, headers["connection"]) == (400, "close")
        assert connection.recv(1) == b""


@pytest.mark.parametrize(
    "lengths",
    ["Content-Length: 20\r\nTransfer-Encoding: chunked\r\n", "Content-Length: 20\r\nContent-Length: 90000\r\n"],
)
@pytest.mark.usefixtures("client")
def test_contradictory_lengths_end_the_connection(small: Server, lengths: str) -> None:
    with connect(small) as connection:
        connection.sendall(f"POST /v1/sigma HTTP/1.1\r\n{HEAD}{lengths}\r\n".encode())
        status, headers, _ = read_answer(connection)
        assert (status, headers["connection"]) == (400, "close")
        assert connection.recv(1) == b""


@pytest.mark.parametrize("path", BODIES)
@pytest.mark.usefixtures("client")
def test_a_sender_who_gives_up_is_logged_without_a_traceback(small: Server, path: str) -> None:
    request_id = f"gone{path.replace('/', '-')}"
    with connect(small) as connection:
        head = f"POST {path} HTTP/1.1\r\n{HEAD}X-Request-ID: {request_id}\r\nContent-Length: 1000\r\n\r\n"
        connection.sendall(head.encode() + b"{")
    deadline = time.monotonic() + 240
    lines: list[str] = []
    while not lines and time.monotonic() < deadline:
        time.sleep(0.05)
        lines = [line for line in small.log.read_text().splitlines() if request_id in line]
    (line,) = lines
    assert (json.loads(line)["status"], json.loads(line)["level"]) == (499, "info")
    assert "Traceback" not in small.log.read_text()
