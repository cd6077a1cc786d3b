"""The files that exports are: made few at a time, sent whole, and gone afterwards."""

import asyncio
import time
from pathlib import Path
from typing import Any

import pytest

from service.routes import exports
from service.store import skins
from tests.service.in_process import in_process
from tests.support.store_server import Server, campaign

BACKEND = "sqlite"


@pytest.mark.parametrize("asked", ["bytes=999999999-", "bytes=5-9", "lines=1-2", "bytes=-5, 7-8"])
def test_they_are_sent_whole_and_leave_nothing_behind(server: Server, asked: str) -> None:
    """That of the next request has other bytes: parts of two are no file."""
    sent = server.http.post("/v1/campaigns?skin=palm", json=campaign("monday")).json()
    for path in ("/v1/skins/palm/export", f"/v1/campaigns/{sent['id']}/document?format=hdf5"):
        answer = server.http.get(path, headers={"Range": asked})
        assert (answer.status_code, answer.headers["Accept-Ranges"]) == (200, "none")
        assert answer.content.startswith(b"\x89HDF")
    await_gone(server.place.folder / "uploads")


def test_one_that_nobody_waits_for_is_removed(server: Server) -> None:
    server.http.post("/v1/campaigns?skin=palm", json=campaign("monday", lines=20_000))
    for _ in range(3):
        with server.http.stream("GET", "/v1/skins/palm/export") as answer:
            next(answer.iter_bytes(1000))
    await_gone(server.place.folder / "uploads")


def await_gone(uploads: Path) -> None:
    """A file is removed a moment after its answer was sent."""
    deadline = time.monotonic() + 240
    while left := [file for file in uploads.rglob("*") if file.is_file() and file.name != ".lock"]:
        assert time.monotonic() < deadline, left
        time.sleep(0.05)


def test_few_made_once_readers_answered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Few are made at once and readers are answered meanwhile.

    Each holds a connection of the store as long as it takes.
    """
    under_way, most = 0, 0

    def slow(_: Any, root: str, file: Path) -> None:
        nonlocal under_way, most
        under_way += 1
        most = max(most, under_way)
        time.sleep(0.1)
        file.write_text(root)
        under_way -= 1

    monkeypatch.setattr(exports, "export", slow)
    with in_process(tmp_path) as service:
        service.store.write(skins.require, "palm")

        async def ask() -> None:
            async with service.client() as client:
                made = [asyncio.create_task(client.get("/v1/skins/palm/export")) for _ in range(20)]
                await asyncio.sleep(0.2)
                assert (await client.get("/v1/campaigns")).status_code == 200
                assert not made[-1].done()
                assert {(await one).text for one in made} == {"palm"}

        asyncio.run(ask())
    assert most == 2
