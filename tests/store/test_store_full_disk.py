"""A full disk: 507, nothing acknowledged that is not kept, and what is kept can be read."""

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import orjson
import pytest

from tests.store.server import Place, campaign, running

SIZE = "6m"


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A folder with little room."""
    folder = tmp_path / "small"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={SIZE}", "tmpfs", str(folder)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True).returncode != 0:
        pytest.skip("mounting a small disk takes root")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def test_a_full_disk_refuses_and_keeps_what_it_acknowledged(small_disk: Path) -> None:
    place = Place(small_disk)
    acknowledged: dict[str, str] = {}
    with running(place) as server:
        statuses = []
        for number in range(200):
            name = f"run {number}"
            answer = server.http.post("/v1/campaigns", json=campaign(name, sensors=20, lines=100))
            statuses.append(answer.status_code)
            if answer.status_code == 201:
                acknowledged[answer.json()["id"]] = name
            if statuses[-3:] == [507] * 3:
                break
        assert statuses[-3:] == [507] * 3
        assert statuses[0] == 201
        assert answer.headers["content-type"] == "application/problem+json"
        _same(server, acknowledged)
        assert server.http.get("/v1/sigma?a_over_h=0.3&rt_over_h=0.6").status_code == 200
        assert server.http.get("/v1/skins").status_code == 200
        d33 = server.http.get(f"/v1/campaigns/{next(iter(acknowledged))}/d33?band_low_hz=10&band_high_hz=100")
        assert d33.status_code == 200
        server.kill()
    with running(place) as server:
        _same(server, acknowledged)


def test_an_upload_that_does_not_fit_is_refused_as_it_streams(small_disk: Path) -> None:
    with running(Place(small_disk)) as server:
        document = orjson.dumps(campaign("one")) + b" " * 20_000_000
        answer = server.http.post("/v1/campaigns", files={"file": ("big.json", document)})
        assert answer.status_code == 507
        assert server.http.post("/v1/campaigns", json=campaign("small")).status_code == 201


def _same(server: object, acknowledged: dict[str, str]) -> None:
    from tests.store.server import Server

    assert isinstance(server, Server)
    page = server.http.get("/v1/campaigns?limit=200&state=all").json()["campaigns"]
    assert {entry["id"]: entry["name"] for entry in page} == acknowledged
    for campaign_id, name in acknowledged.items():
        sent = campaign(name, sensors=20, lines=100)
        sent["skin"]["d33_pc_per_n"] = None
        assert server.http.get(f"/v1/campaigns/{campaign_id}/document").json() == sent
