"""A disk that hangs under uploads keeps them waiting, and nobody else."""

import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import httpx
import orjson
import pytest

from bench.soak import SOAK
from tests.service.pages.forms import BROWSING, token_of
from tests.service.waiting import until
from tests.support.hanging.disk import CALLS, HangingDisk
from tests.support.store_server import Place, Server, campaign, running

MANY = 140  # more than there are threads that answer requests
FEW = 12  # more than there are threads for uploads
PADDED_BYTES = 600_000  # two files of more are written before the second has come
OTHERS = ("/health", "/ready", "/v1/sigma?a_over_h=0.3&rt_over_h=0.6", "/v1/campaigns", "/upload")


@pytest.fixture(scope="module")
def disk(tmp_path_factory: pytest.TempPathFactory) -> HangingDisk:
    folder = tmp_path_factory.mktemp("hanging")
    return HangingDisk(folder / "data" / "uploads", folder)


@pytest.fixture(scope="module")
def hanging_server(disk: HangingDisk, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    folder = tmp_path_factory.getbasetemp() / "hanging0" / "data"
    with running(Place(folder), **disk.environment) as server:
        yield server


def send_by_page(server: Server, number: int) -> int:
    """As a browser does, in a session of its own."""
    files = [("file", (name, orjson.dumps(campaign(name)) + b" " * PADDED_BYTES)) for name in ("a.json", "b.json")]
    with httpx.Client(base_url=server.http.base_url, headers=BROWSING, timeout=300) as browser:
        form = {"form_token": token_of(browser.get("/upload").text), "skin": f"by page {number}"}
        return browser.post("/upload", data=form, files=files).status_code


def send(server: Server, number: int) -> int:
    return httpx.post(
        f"{server.http.base_url}/v1/campaigns", json=campaign(f"sent {number}", sensors=1, lines=3), timeout=300
    ).status_code


@pytest.mark.parametrize("call", CALLS if SOAK else ["writing"])
def test_answered_disk_uploads_hangs(hanging_server: Server, disk: HangingDisk, call: str) -> None:
    """Others are answered while the disk of uploads hangs."""
    count = MANY if call == "writing" else FEW
    with ThreadPoolExecutor(FEW + count) as pool:
        with disk.hanging(call):
            by_page = [pool.submit(send_by_page, hanging_server, number) for number in range(FEW)]
            sent = [pool.submit(send, hanging_server, number) for number in range(count)]
            until(disk.waiting, "nothing hangs")
            time.sleep(1.0)
            for path in OTHERS:
                assert hanging_server.http.get(path, timeout=240).status_code == 200, path
        assert {one.result() for one in by_page} == {303}
        assert {one.result() for one in sent} == {201}


def test_the_headers_of_an_export_are_answered_without_making_it(hanging_server: Server, disk: HangingDisk) -> None:
    http = hanging_server.http
    sent = http.post("/v1/campaigns?skin=exported", json=campaign("exported")).json()
    for path in ("/v1/skins/exported/export", f"/v1/campaigns/{sent['id']}/document?format=hdf5"):
        whole = http.get(path)
        with disk.hanging("making a file"):
            head = http.head(path, timeout=240)
            assert not disk.waiting()
        assert (head.status_code, head.content) == (200, b"")
        for name in ("Content-Type", "Content-Disposition"):
            assert head.headers[name] == whole.headers[name]
        assert "Content-Length" not in head.headers
    assert http.head("/v1/skins/unknown/export").status_code == 404
