"""While nothing can be written, figures are computed and told all the same; what was to be kept is refused."""

import os
import subprocess
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import httpx
import pytest
from sqlalchemy import func, select

from service.store import open_store
from service.store.tables import adopted_inversions, inversions, sensor_d33
from tests.support.store_server import Place, Server, campaign, running

BACKEND = "sqlite"
CAMPAIGNS = 2  # for so many pages wait
QUICKLY_S = 18.0  # a write waits for 20 s


def answered(server: Server, path: str) -> httpx.Response:
    """The answer, which must come before a write would have given up; on a busy machine one of some does."""
    for _ in range(10):
        began = time.monotonic()
        answer = server.http.get(path, timeout=240)
        assert answer.status_code == 200, answer.text
        if time.monotonic() - began < QUICKLY_S:
            return answer
    raise AssertionError(f"{path} waits for what cannot be written")


def forget_d33(place: Place) -> None:
    """As where a campaign came with an earlier underskin, or without time to compute it."""
    with closing(open_store(place.database_url, place.folder)) as store, store.writing() as connection:
        for table in (inversions, sensor_d33, adopted_inversions):
            connection.execute(table.delete())


def kept_d33(place: Place) -> int:
    with closing(open_store(place.database_url, place.folder)) as store, store.reading() as connection:
        return int(connection.execute(select(func.count()).select_from(inversions)).scalar_one())


def test_d33_that_is_not_kept_is_told_during_a_restore(server: Server) -> None:
    arrivals = [server.http.post("/v1/campaigns?skin=palm", json=campaign(f"run {n}")) for n in range(CAMPAIGNS)]
    paths = [f"/v1/campaigns/{arrivals[0].json()['id']}/d33", "/v1/skins/palm/history", "/skins/palm/history.csv"]
    before = {path: answered(server, path).text for path in paths}
    forget_d33(server.place)
    with closing(open_store(server.place.database_url, server.place.folder)) as store, store.without_writers():
        assert {path: answered(server, path).text for path in paths} == before
        answered(server, "/skins/palm")
    assert kept_d33(server.place) == 0
    assert server.http.post("/v1/campaigns?skin=palm", json=campaign("after it")).status_code == 201
    answered(server, "/v1/skins/palm/history")
    assert kept_d33(server.place) == CAMPAIGNS + 1


@contextmanager
def read_only(folder: Path) -> Iterator[None]:
    """As on a disk that the system has mounted read-only after an error."""
    if os.geteuid() != 0 or subprocess.run(["mount", "--bind", folder, folder], capture_output=True).returncode != 0:
        pytest.skip("mounting takes root")
    try:
        subprocess.run(["mount", "-o", "remount,bind,ro", folder], check=True)
        yield
    finally:
        subprocess.run(["umount", "--lazy", folder], check=True)


def test_a_disk_that_is_read_only_refuses_and_what_is_kept_is_told(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    folder.mkdir()
    with running(Place(folder)) as server:
        sent = server.http.post("/v1/campaigns?skin=palm", json=campaign("one")).json()
        paths = [f"/v1/campaigns/{sent['id']}/d33", "/v1/skins/palm/history"]
        before = {path: answered(server, path).text for path in paths}
        forget_d33(server.place)
        with read_only(folder):
            assert {path: answered(server, path).text for path in paths} == before
            for refused in (
                server.http.post("/v1/campaigns?skin=palm", json=campaign("two")),
                server.http.post(f"/v1/campaigns/{sent['id']}/withdraw", json={"reason": "wrong sphere"}),
            ):
                assert (refused.status_code, "Read-only file system" in refused.json()["detail"]) == (507, True)
                assert refused.headers["content-type"] == "application/problem+json"
            assert answered(server, "/v1/campaigns").json()["campaigns"][0]["state"] == "current"
        assert server.http.post("/v1/campaigns?skin=palm", json=campaign("two")).status_code == 201
