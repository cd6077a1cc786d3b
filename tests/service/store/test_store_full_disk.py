"""A full disk: 507, nothing acknowledged that is not kept, and what is kept can be read."""

import os
import resource
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import httpx
import orjson
import pytest

from service.auth.keys import KeyStore
from tests.service.pages.forms import BROWSING, token_of
from tests.support import postgres
from tests.support.store_server import Place, Server, campaign, running


@pytest.fixture
def small_disk() -> Iterator[Path]:
    """A folder with room for 4 MB."""
    folder = Path(tempfile.mkdtemp(prefix="underskin-small-"))
    mount = ["mount", "-t", "tmpfs", "-o", "size=4m", "tmpfs", str(folder)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True).returncode != 0:
        folder.rmdir()
        pytest.skip("mounting a small disk takes root")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)
        folder.rmdir()


@pytest.fixture(params=["sqlite", "postgresql"])
def cramped(request: pytest.FixtureRequest, small_disk: Path, tmp_path: Path) -> Iterator[Place]:
    """A store with little room: its data folder, or its database's tablespace."""
    if request.param == "sqlite":
        yield Place(small_disk)
        return
    cluster: postgres.Cluster = request.getfixturevalue("cluster")
    shutil.chown(small_disk, postgres.USER, postgres.USER)
    (tmp_path / "data").mkdir()
    url = cluster.new_database(tablespace=small_disk)
    yield Place(tmp_path / "data", url)
    cluster.drop(url)


def test_a_full_disk_refuses_and_keeps_what_it_acknowledged(cramped: Place, small_disk: Path) -> None:
    acknowledged: dict[str, dict[str, Any]] = {}
    with running(cramped) as server:
        statuses: list[int] = []
        while statuses[-3:] != [507] * 3:
            assert len(statuses) < 300, "the disk does not fill"
            document = campaign(f"run {len(statuses)}", sensors=20, lines=100)
            answer = server.http.post("/v1/campaigns", json=document)
            statuses.append(answer.status_code)
            assert answer.status_code in (201, 507), answer.text
            if answer.status_code == 201:
                acknowledged[answer.json()["id"]] = document
                leave_room(small_disk, 500_000)
        assert statuses[0] == 201
        assert answer.headers["content-type"] == "application/problem+json"
        one = next(iter(acknowledged))
        reads = ["/v1/sigma?a_over_h=0.3&rt_over_h=0.6", "/v1/skins", f"/v1/campaigns/{one}/d33", "/ready"]
        reads.append(f"/v1/campaigns/{one}/d33?band_low_hz=10&band_high_hz=100")
        assert {path: server.http.get(path).status_code for path in reads} == dict.fromkeys(reads, 200)
        server.kill()
    with running(cramped) as server:
        require_kept(server, acknowledged)


def test_an_upload_that_does_not_fit_is_refused_as_it_streams(small_disk: Path) -> None:
    with running(Place(small_disk)) as server:
        document = orjson.dumps(campaign("one")) + b" " * 10_000_000
        answer = server.http.post("/v1/campaigns", files={"file": ("big.json", document)})
        assert answer.status_code == 507
        assert server.http.post("/v1/campaigns", json=campaign("small")).status_code == 201


def test_who_has_a_key_can_log_in_to_read(small_disk: Path) -> None:
    key = KeyStore(small_disk).create("lab", "read")
    with running(Place(small_disk), key=key) as server:
        with (small_disk / "filling").open("wb", buffering=0) as file:
            for size in (1_000_000, 1000, 1):
                with suppress(OSError):
                    while file.write(size * b"x") == size:
                        pass
        url = str(server.http.base_url)
        with httpx.Client(base_url=url, headers={"Origin": url, **BROWSING}, timeout=300) as browser:
            form = token_of(browser.get("/login").text)
            assert browser.post("/login", data={"key": key, "form_token": form}).status_code == 303
            assert browser.get("/").status_code == 200
    assert "a login cannot be noted" in (small_disk.parent / f"{small_disk.name}.log").read_text()


def require_kept(server: Server, acknowledged: dict[str, dict[str, Any]]) -> None:
    """The store holds these campaigns, whole, and no other."""
    page = server.http.get("/v1/campaigns?limit=200&state=all").json()["campaigns"]
    assert {entry["id"]: entry["name"] for entry in page} == {key: sent["name"] for key, sent in acknowledged.items()}
    for campaign_id, sent in acknowledged.items():
        sent["skin"]["d33_pc_per_n"] = None
        assert server.http.get(f"/v1/campaigns/{campaign_id}/document").json() == sent


def test_a_full_disk_of_temporary_files_is_told(small_disk: Path, tmp_path: Path) -> None:
    """Long bodies are parsed apart, from files there."""
    long = {"name": "unknown", "input": [[0.3] * 300_000]}
    (tmp_path / "data").mkdir()
    with running(Place(tmp_path / "data"), TMPDIR=str(small_disk), UNDERSKIN_DIAGNOSIS_WORKERS="0") as server:
        read = server.http.post("/umbridge/Evaluate", json=long)
        assert read.status_code == 400
        fill(small_disk)
        assert server.http.post("/umbridge/Evaluate", json=long).status_code == 507
        (small_disk / "filling").unlink()
        assert server.http.post("/umbridge/Evaluate", json=long).text == read.text


def leave_room(disk: Path, size: int) -> None:
    """Fill it up to so many bytes, once."""
    filling, free = disk / "filling", shutil.disk_usage(disk).free
    if not filling.exists() and free > size:
        filling.write_bytes(bytes(free - size))


def fill(disk: Path) -> None:
    with suppress(OSError), (disk / "filling").open("wb", buffering=0) as file:
        while True:
            file.write(bytes(4096))


def test_files_that_may_not_grow_are_told(tmp_path: Path) -> None:
    """A limit on the size of files (EFBIG) is answered as a disk that takes nothing, for uploads and for the store."""
    (tmp_path / "data").mkdir()
    with running(Place(tmp_path / "data"), UNDERSKIN_DIAGNOSIS_WORKERS="0") as server:
        assert server.http.post("/v1/campaigns", json=campaign("small")).status_code == 201
        for most in (1_000_000, 4096):
            resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (most, resource.RLIM_INFINITY))
            large = orjson.dumps(campaign("large", sensors=20, lines=100)) + b" " * 2_000_000
            answer = server.http.post("/v1/campaigns", content=large, headers={"Content-Type": "application/json"})
            assert (answer.status_code, "takes nothing" in answer.text) == (507, True)
        refused = server.http.post("/v1/campaigns", json=campaign("other"))
        assert (refused.status_code, "takes nothing" in refused.text) == (507, True)
        assert server.http.get("/").status_code == 200
