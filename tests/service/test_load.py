"""200 requests a second, sent when they are due whether or not the earlier ones are answered: none may fail."""

import asyncio
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from bench.figures import Figure
from bench.soak import SOAK, record
from tests.support.server import Server, running
from underskin import load_table

TABLE = load_table()
RATE = 200  # requests a second
SOAK_S = 600
SKIN: dict[str, Any] = {
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16,
    "sensor_radius_mm": 1.5,
    "indenter_radius_mm": 4,
    "preload_n": [0.5, 1, 3],
}


def mixed(client: httpx.AsyncClient) -> list[httpx.Request]:
    """One request of each kind."""
    point = {"a_over_h": 1.7, "rt_over_h": 0.6, "load_parameter": 0.01}
    return [
        client.build_request("GET", "/v1/sigma", params=point),
        client.build_request("POST", "/v1/sigma", json=point | {"a_over_h": [1.7, 0.3, 9]}),
        client.build_request("POST", "/v1/frf", json=SKIN | {"d33_pc_per_n": 14}),
        client.build_request("POST", "/v1/d33", json=SKIN | {"frf_pc_per_n": 7.4, "frf_uncertainty_pc_per_n": 0.1}),
        client.build_request("POST", "/umbridge/Evaluate", json={"name": "sigma", "input": [list(point.values())]}),
    ]


@dataclass
class Load:
    """What went wrong, how long each request took [s], and by how much the last one was sent too late [s]."""

    wrong: list[str] = field(default_factory=list)
    took: list[float] = field(default_factory=list)
    late: float = 0.0


async def load(url: str, seconds: int) -> Load:
    """Send RATE requests a second, and compare each answer."""
    seen = Load()

    async def ask(client: httpx.AsyncClient, request: httpx.Request, expected: bytes) -> None:
        begun = time.monotonic()
        try:
            answer = await client.send(request)
        except httpx.HTTPError as error:
            seen.wrong.append(f"{request.url}: {error!r}")
            return
        seen.took.append(time.monotonic() - begun)
        if answer.status_code != 200 or answer.content != expected:
            seen.wrong.append(f"{request.url}: {answer.status_code} {answer.text[:200]}")

    limits = httpx.Limits(max_connections=50, max_keepalive_connections=50)
    async with httpx.AsyncClient(base_url=url, timeout=300, limits=limits) as client:
        requests = mixed(client)
        expected = [(await client.send(request)).raise_for_status().content for request in requests]
        sigma = float(TABLE.sigma(1.7, 0.6, 0.01).sigma)
        assert all(f"{sigma:.12f}"[:-2].encode() in expected[kind] for kind in (0, 1, 4))
        async with asyncio.TaskGroup() as group:
            start = time.monotonic()
            for number in range(RATE * seconds):
                await asyncio.sleep(max(0.0, start + number / RATE - time.monotonic()))
                kind = number % len(requests)
                group.create_task(ask(client, requests[kind], expected[kind]))
            seen.late = time.monotonic() - start - seconds
    return seen


def counted(server: Server) -> float:
    """How many requests the server says that it answered with 200."""
    lines = httpx.get(f"{server.url}/metrics").text.splitlines()
    totals = [line for line in lines if line.startswith("underskin_request_seconds_count") and 'status="200"' in line]
    return sum(float(line.rsplit(" ", 1)[1]) for line in totals if "/v1/" in line or "/umbridge/" in line)


def test_no_request_fails_under_load(tmp_path: Path) -> None:
    with running(tmp_path) as server:
        seen = asyncio.run(load(server.url, 1))
        assert not seen.wrong, seen.wrong[:5]
        assert counted(server) == RATE + 5


@pytest.mark.soak
@pytest.mark.alone
@pytest.mark.skipif(not SOAK, reason="ten minutes of load; make soak")
def test_ten_minutes_of_200_requests_a_second(tmp_path: Path) -> None:
    with running(tmp_path) as server:
        seen = asyncio.run(load(server.url, SOAK_S))
        assert seen.late < 1, "this machine is too busy to send 200 requests a second"
        assert not seen.wrong, seen.wrong[:5]
        assert counted(server) == RATE * SOAK_S + 5
    slowest_percent = 1e3 * float(np.percentile(seen.took, 99))
    assert slowest_percent <= 300
    record(Figure("200 requests/s for ten minutes: answered by 99 %", slowest_percent, "ms", 300, "lower"))
    record(Figure("200 requests/s for ten minutes: errors", len(seen.wrong), "", 0, "lower"))
