"""The files of an SQLite store removed or replaced under a running server: nothing is acknowledged that is lost."""

import json
import shutil
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from service.routes.computed import D33_EXAMPLE as D33
from service.routes.computed import FRF_EXAMPLE as FRF
from tests.service.waiting import until
from tests.support.store_server import Place, Server, campaign, running

DATABASE = "underskin.sqlite3"


@pytest.fixture
def place(tmp_path: Path) -> Place:
    (tmp_path / "data").mkdir()
    return Place(tmp_path / "data")


@pytest.fixture
def server(place: Place) -> Iterator[Server]:
    """With two campaigns."""
    with running(place, UNDERSKIN_DIAGNOSIS_WORKERS="0") as started:
        for name in ("one", "two"):
            assert send(started, name) == 201
        yield started


def send(server: Server, name: str, **headers: str) -> int:
    return server.http.post("/v1/campaigns", json=campaign(name), headers=headers).status_code


def names(server: Server) -> set[str]:
    return {entry["name"] for entry in server.http.get("/v1/campaigns").raise_for_status().json()["campaigns"]}


def assert_closed(server: Server, said: str) -> None:
    """No write is acknowledged, and the server says why."""
    for answer in (
        server.http.post("/v1/campaigns", json=campaign("lost")),
        server.http.post("/v1/campaigns", files={"file": ("lost.json", json.dumps(campaign("lost")))}),
        server.http.post("/v1/skins/import", content=b"x"),
        server.http.delete("/v1/skins/palm/model", params={"reason": "wrong sphere"}),
    ):
        assert answer.status_code == 503, answer.text
        assert answer.headers["content-type"] == "application/problem+json"
        assert answer.headers["retry-after"] == "5"
    ready = server.http.get("/ready")
    assert (ready.status_code, said in ready.json()["detail"]) == (503, True), ready.text
    assert server.http.get("/health").status_code == 200
    assert server.http.get("/v1/sigma?a_over_h=0.3&rt_over_h=0.6").status_code == 200
    assert server.http.post("/v1/frf", json=FRF).status_code == 200
    assert server.http.post("/v1/d33", json=D33).status_code == 200


_ATTEMPTS = 20


def assert_open(server: Server, name: str) -> None:
    """It takes a campaign, and has what it had besides."""
    assert server.http.get("/ready").status_code == 200
    before = names(server)
    assert send(server, name) == 201
    assert names(server) == {name, *before}


def assert_kept(server: Server) -> None:
    """After the power fails the store holds what it held."""
    before = names(server)
    server.kill()
    with running(server.place, UNDERSKIN_DIAGNOSIS_WORKERS="0") as later:
        assert names(later) == before


def test_what_was_in_a_removed_file_can_still_be_saved(server: Server, tmp_path: Path) -> None:
    skin = server.http.get("/v1/campaigns").json()["campaigns"][0]["skin_id"]
    (server.place.folder / DATABASE).unlink()
    assert names(server) == {"one", "two"}
    assert_closed(server, "save what can still be read with `underskin export` before the service ends")
    saving = ("export", skin, str(tmp_path / "saved.h5"), "--url", str(server.http.base_url))
    for _ in range(_ATTEMPTS):  # only a connection that was open before can read it, and another request may have that
        done = server.place.command(*saving)
        if done.returncode == 0:
            break
    assert done.returncode == 0, done.stderr
    elsewhere = Place(tmp_path / "elsewhere")
    elsewhere.folder.mkdir()
    with running(elsewhere, UNDERSKIN_DIAGNOSIS_WORKERS="0") as other:
        content = (tmp_path / "saved.h5").read_bytes()
        assert other.http.post("/v1/skins/import", content=content).status_code == 200
        assert len(names(other)) == 1


def test_a_write_ahead_log_that_lost_its_database_is_not_overwritten(server: Server, tmp_path: Path) -> None:
    assert server.place.command("backup", str(tmp_path / "kept")).returncode == 0
    log = server.place.folder / f"{DATABASE}-wal"
    server.kill()
    (server.place.folder / DATABASE).rename(tmp_path / "aside")
    before = log.read_bytes()
    assert before
    with pytest.raises(AssertionError, match=f"{DATABASE} is missing, and its write-ahead log"), running(server.place):
        pass  # a start that is refused
    assert "is missing, and its write-ahead log" in server.place.command("restore", str(tmp_path / "kept")).stderr
    assert not (server.place.folder / DATABASE).exists()
    assert log.read_bytes() == before
    (tmp_path / "aside").rename(server.place.folder / DATABASE)
    with running(server.place, UNDERSKIN_DIAGNOSIS_WORKERS="0") as later:
        assert names(later) == {"one", "two"}
        assert_open(later, "three")


def test_files_that_are_removed_and_put_back_are_used_again(server: Server, tmp_path: Path) -> None:
    """What is sent meanwhile is not acknowledged, also where it was before."""
    key = {"Idempotency-Key": "monday"}
    assert send(server, "again", **key) == send(server, "again", **key) == 201
    for file in (DATABASE, f"{DATABASE}-wal", f"{DATABASE}-shm"):
        (server.place.folder / file).rename(tmp_path / "aside")
        assert_closed(server, f"{file} was removed while the service runs")
        assert send(server, "again", **key) == 503
        assert not (server.place.folder / file).exists()
        (tmp_path / "aside").rename(server.place.folder / file)
        assert_open(server, f"after {file}")
    assert_kept(server)


def test_a_copy_in_the_place_of_a_file_or_folder_is_not_written(server: Server, tmp_path: Path) -> None:
    folder = server.place.folder
    for file in (DATABASE, f"{DATABASE}-wal"):
        there = folder / file
        there.rename(tmp_path / "aside")
        shutil.copy(tmp_path / "aside", there)
        before = there.read_bytes()
        assert_closed(server, f"{file} was replaced by another file while the service runs")
        assert there.read_bytes() == before
        assert {"one", "two"} <= names(server)
        (tmp_path / "aside").replace(there)
        assert_open(server, f"after {file}")
    folder.rename(tmp_path / "aside")
    shutil.copytree(tmp_path / "aside", tmp_path / "copy")
    folder.symlink_to(tmp_path / "copy")
    assert_closed(server, f"{DATABASE} was replaced by another file while the service runs")
    folder.unlink()  # the link
    (tmp_path / "aside").rename(folder)
    assert_open(server, "after a link")
    assert_kept(server)


def test_a_data_folder_is_moved_away_and_back(server: Server, tmp_path: Path) -> None:
    """Nothing is made in an empty folder in its place, as where a disk is not mounted any more."""
    folder = server.place.folder
    folder.rename(tmp_path / "aside")
    assert_closed(server, str(folder))
    assert not folder.exists()
    folder.mkdir()
    assert_closed(server, f"{DATABASE} was removed while the service runs")
    skin = server.http.get("/v1/campaigns").json()["campaigns"][0]["skin_id"]
    assert server.http.get(f"/v1/skins/{skin}/export").status_code == 503
    assert list(folder.iterdir()) == []
    folder.rmdir()
    (tmp_path / "aside").rename(folder)
    assert_open(server, "three")
    assert_kept(server)


def test_a_backup_restored_where_the_file_was_removed_is_used_after_a_restart(server: Server, tmp_path: Path) -> None:
    assert server.place.command("backup", str(tmp_path / "kept")).returncode == 0
    for file in server.place.folder.glob(f"{DATABASE}*"):
        file.unlink()
    done = server.place.command("restore", str(tmp_path / "kept"))
    assert done.returncode == 0, done.stderr
    assert_closed(server, f"{DATABASE} was replaced by another file while the service runs")
    server.kill()
    with running(server.place, UNDERSKIN_DIAGNOSIS_WORKERS="0") as later:
        assert names(later) == {"one", "two"}
        assert_open(later, "three")


def test_what_is_acknowledged_while_the_file_comes_and_goes_is_there(server: Server, tmp_path: Path) -> None:
    acknowledged: set[str] = set()
    refused: list[int] = []
    ending = threading.Event()

    def stream(sender: int) -> None:
        number = 0
        while not ending.is_set():
            name = f"{sender}-{number}"
            status = send(server, name)
            if status == 201:
                acknowledged.add(name)
            else:
                refused.append(status)
            number += 1

    senders = [threading.Thread(target=stream, args=(sender,)) for sender in range(3)]
    for sender in senders:
        sender.start()
    there = server.place.folder / DATABASE
    for _ in range(8):
        time.sleep(0.15)
        there.rename(tmp_path / "aside")
        time.sleep(0.05)
        (tmp_path / "aside").rename(there)
    ending.set()
    for thread in senders:
        thread.join()
    assert acknowledged
    assert set(refused) <= {503}
    server.kill()
    with running(server.place, UNDERSKIN_DIAGNOSIS_WORKERS="0") as later:
        kept: set[str] = set()
        cursor: str | None = ""
        while cursor is not None:
            page = later.http.get("/v1/campaigns?limit=200", params={"cursor": cursor} if cursor else {}).json()
            kept |= {entry["name"] for entry in page["campaigns"]}
            cursor = page["next"]
    assert acknowledged <= kept


def test_diagnoses_wait_for_the_file_and_the_log_says_so_once(place: Place, tmp_path: Path) -> None:
    log = place.folder.parent / f"{place.folder.name}.log"
    watchers = ("no diagnosis can be claimed", "which sessions were ended cannot", "whether keys are needed cannot")
    with running(place, UNDERSKIN_DIAGNOSIS_WORKERS="1") as server:
        answer = server.http.post("/v1/campaigns", json=campaign("one", lines=5))
        (place.folder / DATABASE).rename(tmp_path / "aside")
        until(lambda: all(told in log.read_text() for told in watchers))
        time.sleep(2.5)  # another look at the queue
        (tmp_path / "aside").rename(place.folder / DATABASE)
        started = server.http.post(f"/v1/campaigns/{answer.json()['id']}/diagnosis")
        assert started.status_code == 202, started.text
        until(lambda: server.http.get(f"/v1/diagnoses/{started.json()['id']}").json()["state"] != "queued")
    text = log.read_text()
    assert [text.count(told) for told in watchers] == [1, 1, 1]
    assert 1 <= text.count("the store answers again") <= len(watchers)  # of each once, unless the server ends before
    assert "Traceback" not in text
