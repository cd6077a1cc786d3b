"""What no honest client sends: answered as any other mistake, briefly, and never as a failure of the server."""

from typing import Any

import httpx
import pytest

from tests.service.connections import HEAD, connect, read_answer
from tests.service.requests import SIGMA, problem_of
from tests.support.server import Server

ONE_SIGMA = "/v1/sigma?a_over_h=0.3&rt_over_h=0.6"


def post(http: httpx.Client, path: str, body: str | bytes) -> httpx.Response:
    """The answer to a body that json.dumps would not write."""
    return http.post(path, content=body, headers={"Content-Type": "application/json"})


@pytest.mark.parametrize("weight", ["²", "-1", "1e-3", "½", ".", "1.1.1", "", "٣"])
def test_an_odd_weight_in_accept_is_none(http: httpx.Client, weight: str) -> None:
    odd = http.get(ONE_SIGMA, headers=[(b"Accept", f"text/csv;q={weight}".encode())])
    assert (odd.status_code, odd.headers["content-type"]) == (200, "application/json")


@pytest.mark.parametrize(
    "wrong",
    [
        {"a_over_h": "0.3" * 100_000},
        {"a_over_h": {"value": [0.3] * 100_000}},
        {"a_over_h": [[0.3] * 100_000]},
        {"model": "layer" * 100_000},
        {"unknown": [0.3] * 100_000},
    ],
)
def test_a_refused_value_is_shown_in_few_words(http: httpx.Client, wrong: dict[str, Any]) -> None:
    answer = http.post("/v1/sigma", json={**SIGMA, **wrong})
    (error,) = problem_of(answer, 422)["errors"]
    assert error["field"] in wrong
    assert len(answer.content) < 1000


@pytest.mark.parametrize(
    "body",
    [
        "[" * 100_000,
        '{"a_over_h":' + "[" * 100_000,
        '{"a_over_h": 0.3, "rt_over_h": 0.6} {"a_over_h": 0.3}',
        b'{"a_over_h": 0.3, "rt_over_h": 0.6, "model": "\xff"}',
        "\ufeff{}",
        "",
    ],
)
@pytest.mark.parametrize("path", ["/v1/sigma", "/umbridge/Evaluate", "/umbridge/Gradient"])
def test_what_is_not_json_is_refused(http: httpx.Client, path: str, body: str | bytes) -> None:
    problem_of(post(http, path, body), 400)


@pytest.mark.parametrize(
    "path",
    [
        *(
            "/v1/sigma",
            "/v1/frf",
            "/umbridge/Evaluate",
            "/umbridge/Gradient",
            "/v1/skins/a/join",
            "/v1/skins/a/diagnosis",
        ),
        *("/v1/campaigns/a/withdraw", "/v1/campaigns/a/exclusions", "/v1/fleets/diagnosis", "/v1/mechanisms"),
    ],
)
@pytest.mark.parametrize("place", ['{"\\ud800": 1}', '{"name": "\\ud800"}', '{"model": "\\ud800", "input": "\\ud800"}'])
def test_half_a_character_is_refused(http: httpx.Client, path: str, place: str) -> None:
    answer = post(http, path, place)
    assert answer.status_code in (400, 422)
    problem_of(answer, answer.status_code)


@pytest.mark.parametrize("path", ["/%FF", "/a%0Ab", "/v1/sigma%00", "/..%2F..%2Fetc/passwd", "/" + "x" * 5000])
def test_an_odd_path_is_not_found(http: httpx.Client, path: str) -> None:
    problem_of(http.get(path), 404)


@pytest.mark.parametrize(
    "request_line", ["GET /\xff HTTP/1.1", "BREW /v1/sigma HTTP/1.1", "hello", "GET /health HTTP/9"]
)
def test_not_http_ends_connection(http: httpx.Client, shared_server: Server, request_line: str) -> None:
    """What is not http ends its connection only."""
    with connect(shared_server) as connection:
        connection.sendall(f"{request_line}\r\n{HEAD}\r\n".encode("latin-1"))
        status, headers, _ = read_answer(connection)
        assert (status, headers["connection"]) == (400, "close")
        assert connection.recv(1) == b""
    assert http.get("/health").status_code == 200


def test_an_upgrade_is_not_taken(http: httpx.Client) -> None:
    asked = {
        "Connection": "Upgrade",
        "Upgrade": "websocket",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "eA==",
    }
    assert http.get(ONE_SIGMA, headers=asked).status_code == 200
    assert http.get("/", headers=asked).status_code == 200


def test_nothing_odd_was_a_failure_of_the_server(shared_server: Server, http: httpx.Client) -> None:
    assert http.get("/health").status_code == 200
    assert 'status="500"' not in http.get("/metrics").text
    assert "Traceback" not in shared_server.log.read_text()


@pytest.mark.parametrize("path", ["/health", ONE_SIGMA])
def test_two_host_headers_are_refused(shared_server: Server, path: str) -> None:
    """A proxy may have looked at the other one."""
    with connect(shared_server) as connection:
        connection.sendall(f"GET {path} HTTP/1.1\r\n{HEAD}Host: skin.example.org\r\n\r\n".encode())
        status, *_ = read_answer(connection)
    assert status == 400
