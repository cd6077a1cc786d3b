"""Request ids, the log and the metrics of a real server."""

import json
import os
import re
import time
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.support import preloaded
from tests.support.server import Server, running

SIGMA = "/v1/sigma?a_over_h=0.3&rt_over_h=0.6"


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server whose log holds nothing but what these tests ask."""
    with running(tmp_path_factory.mktemp("logged")) as started:
        yield started


def lines_of(log: Path, request_id: str) -> list[dict[str, Any]]:
    """The lines of one request; they are written within a second."""
    deadline = time.monotonic() + 240
    while time.monotonic() < deadline:
        lines = [json.loads(line) for line in log.read_text().splitlines() if request_id in line]
        if lines:
            return lines
        time.sleep(0.05)
    raise AssertionError(f"no line of {request_id} in {log.read_text()[-2000:]}")


@pytest.mark.parametrize("path", [SIGMA, "/health", "/nothing", "/metrics"])
def test_a_request_id_is_made_returned_and_never_repeated(own: Server, path: str) -> None:
    ids = [httpx.get(own.url + path).headers["x-request-id"] for _ in range(5)]
    assert len(set(ids)) == 5
    assert all(re.fullmatch(r"[0-9a-f]{12}-[0-9a-f]+", request_id) for request_id in ids)


@pytest.mark.parametrize(
    ("path", "status"), [(SIGMA, 200), ("/v1/tables", 200), ("/v1/sigma", 422), ("/no?key=1", 404)]
)
def test_each_request_is_one_line_of_json(own: Server, path: str, status: int) -> None:
    before = time.time()
    request_id = httpx.get(own.url + path).headers["x-request-id"]
    (line,) = lines_of(own.log, request_id)
    assert (line["method"], line["path"], line["status"]) == ("GET", path.split("?")[0], status)
    assert 0 < line["milliseconds"] < 1e4
    assert abs(datetime.fromisoformat(line["time"]).timestamp() - before) < 60
    assert line["key"] is None


def test_a_refusals_line_says_why_and_not_what_came(own: Server) -> None:
    row = {"thickness_mm": 2.5, "sensor_radius_mm": 1.5, "youngs_modulus_mpa": 16, "indenter_radius_mm": 4}
    secret = "us_" + 40 * "a"
    asked = [
        ("POST", "/v1/frf", {**row, "preload_n": -77.25, "d33_pc_per_n": 14}, 422, ["preload_n", "greater than 0"]),
        ("POST", "/v1/frf", {**row, "preload_n": secret, "d33_pc_per_n": 14}, 422, ["preload_n", "number"]),
        ("GET", "/v1/sigma?a_over_h=0.3", None, 422, ["rt_over_h", "is required"]),
        ("GET", "/nowhere", None, 404, ["There is nothing at /nowhere"]),
        ("GET", f"/v1/skins/{secret}/history", None, 404, ["There is no skin"]),
    ]
    for method, path, body, status, said in asked:
        answer = httpx.request(method, own.url + path, json=body)
        (line,) = lines_of(own.log, answer.headers["x-request-id"])
        assert (answer.status_code, line["status"]) == (status, status)
        assert all(part in line["error"] for part in said), line
        assert not any(part in line["error"] for part in (secret, "77.25"))
    (good,) = lines_of(own.log, httpx.get(own.url + SIGMA).headers["x-request-id"])
    assert "error" not in good


def test_the_whole_log_is_json_and_says_where_the_server_listens(own: Server) -> None:
    httpx.get(own.url + SIGMA)
    errors = [line for line in own.log.read_text().splitlines() if not line.startswith(("{", "underskin serves on "))]
    assert errors == []
    assert own.url in own.log.read_text()


def test_the_key_is_named_and_never_written(tmp_path: Path) -> None:
    environment = {"UNDERSKIN_DATA": str(tmp_path / "data")}
    made = preloaded.run("key", "create", "bench-7", environment=os.environ | environment)
    token = made.stdout.split()[-1]
    with running(tmp_path) as started:
        asked = httpx.get(started.url + SIGMA, headers={"Authorization": f"Bearer {token}"})
        assert asked.status_code == 200
        (line,) = lines_of(started.log, asked.headers["x-request-id"])
    assert line["key"] == "bench-7"
    assert token not in started.log.read_text()


def series(url: str) -> dict[str, float]:
    """Prometheus' samples, by name and labels."""
    samples = [line.rsplit(" ", 1) for line in httpx.get(f"{url}/metrics").text.splitlines() if line[0] != "#"]
    return {name: float(value) for name, value in samples}


def test_metrics_count_requests_by_route(own: Server) -> None:
    asked: list[tuple[str, str, str, int, dict[str, float] | None]] = [
        ("GET", SIGMA, "/v1/sigma", 200, None),
        ("GET", f"{SIGMA}&model=half_space", "/v1/sigma", 200, None),
        ("GET", "/v1/sigma", "/v1/sigma", 422, None),
        ("HEAD", SIGMA, "/v1/sigma", 200, None),
        ("HEAD", "/no/such/route", "none", 404, None),
        ("POST", "/v1/frf", "/v1/frf", 422, {}),
        ("POST", "/umbridge/Info", "/umbridge/Info", 405, None),
        ("GET", "/no/such/route", "none", 404, None),
        ("GET", "/no/such/other", "none", 404, None),
    ]
    before = series(own.url)
    for method, path, _, status, body in asked:
        assert httpx.request(method, own.url + path, json=body).status_code == status
    after = series(own.url)
    counted = {
        name: after[name] - before.get(name, 0.0)
        for name in after
        if name.startswith("underskin_request_seconds_count") and "/metrics" not in name
    }
    expected: dict[str, float] = {}
    for method, _, route, status, _ in asked:
        name = f'underskin_request_seconds_count{{method="{method}",route="{route}",status="{status}"}}'
        expected[name] = expected.get(name, 0.0) + 1
    assert {name: count for name, count in counted.items() if count} == expected


KEY = "us_0123456789abcdefABCDEF"  # of a key's shape


@pytest.mark.parametrize("path", ["/v1/skins/" + KEY, "/" + KEY])
def test_a_key_in_a_path_or_a_request_id_does_not_reach_the_log(own: Server, path: str) -> None:
    answer = httpx.get(own.url + path, headers={"X-Request-ID": KEY})
    assert answer.headers["x-request-id"] != KEY
    (line,) = lines_of(own.log, answer.headers["x-request-id"])
    assert line["path"] == path.replace(KEY, "us_…")
    assert KEY not in own.log.read_text()
