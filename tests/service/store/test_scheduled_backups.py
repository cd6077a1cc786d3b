"""Backups on a schedule by a real server: made, read back, rotated, restored."""

import re
import sqlite3
import time
from contextlib import closing
from pathlib import Path

import pytest

from service.usecases.scheduled_backups import stored_backups
from tests.service.store.scheduled import NO_WORKERS, doctor, scheduled, wait_for
from tests.service.waiting import until
from tests.support.diagnosed import sent
from tests.support.store_server import Place, Server, campaign, running

BACKEND = "sqlite"
_SECOND = str(1 / 3600)  # in hours


def metric(server: Server, name: str) -> float:
    found = re.search(rf"^{name} (\S+)$", server.http.get("/metrics").text, flags=re.MULTILINE)
    assert found is not None
    return float(found[1])


def test_a_backup_is_made_at_the_start_and_can_be_restored(place: Place, tmp_path: Path) -> None:
    folder = tmp_path / "backups"
    with running(place, **NO_WORKERS) as server:
        first = sent(server, campaign("kept"))
    with running(place, **scheduled(folder)) as server:
        (file,) = wait_for(folder, 1)
        assert file.stat().st_mode & 0o077 == 0
        later = sent(server, campaign("later"))
        until(lambda: metric(server, "underskin_backup_bytes") == file.stat().st_size)
        assert metric(server, "underskin_backup_age_seconds") < 60
        assert "Last backup" in server.http.get("/").text
    with running(place, **scheduled(folder)):  # the one that is there is young enough
        time.sleep(1.0)
        assert [entry.path for entry in stored_backups(folder)] == [file]
    restored = place.command("restore", str(file))
    assert restored.returncode == 0, restored.stderr
    with running(place, **NO_WORKERS) as server:
        assert server.http.get(f"/v1/campaigns/{first}").status_code == 200
        assert server.http.get(f"/v1/campaigns/{later}").status_code == 404


def test_old_ones_are_deleted_and_files_of_others_are_not(place: Place, tmp_path: Path) -> None:
    folder = tmp_path / "backups"
    folder.mkdir()
    names = ("notes.txt", "x.sqlite3", "20200101T000000Z.keep.sqlite3", "20209901T000000Z.sqlite3")
    others = [folder / "before-restore-1.sqlite3", *(folder / f"underskin-{name}" for name in names)]
    for other in others:
        other.write_text("mine")
    with running(place, **scheduled(folder, UNDERSKIN_BACKUP_EVERY=_SECOND, UNDERSKIN_BACKUP_KEEP="2")):
        (first, *_) = wait_for(folder, 1)
        until(lambda: not first.exists(), "the oldest backup stays")
        assert 1 <= len(stored_backups(folder)) <= 3
    assert all(other.read_text() == "mine" for other in others)
    assert not list(folder.glob("*.part*"))


def test_a_folder_whose_disk_is_not_mounted_any_more_gets_no_other_in_its_place(place: Place, tmp_path: Path) -> None:
    folder, away = tmp_path / "backups", tmp_path / "away"
    log = place.folder.parent / f"{place.folder.name}.log"
    with running(place, **scheduled(folder, UNDERSKIN_BACKUP_EVERY=_SECOND)) as server:
        wait_for(folder, 1)
        folder.rename(away)
        until(lambda: "is its disk mounted?" in log.read_text())
        assert metric(server, "underskin_backup_failures_total") >= 1
        folder.mkdir()  # the empty folder below the mount
        time.sleep(1.0)
        assert not list(folder.iterdir())
    with running(place, **scheduled(folder, UNDERSKIN_BACKUP_EVERY=_SECOND)) as server:  # nor after a restart
        until(lambda: metric(server, "underskin_backup_failures_total") >= 1)
        assert not list(folder.iterdir())
        folder.rmdir()
        before = len(stored_backups(away))
        away.rename(folder)
        wait_for(folder, before + 1)


def test_a_backup_that_fails_is_counted_logged_and_made_later(place: Place, tmp_path: Path) -> None:
    folder = tmp_path / "not-a-folder"
    folder.write_text("a file")
    log = place.folder.parent / f"{place.folder.name}.log"
    with running(place, **scheduled(folder, UNDERSKIN_BACKUP_EVERY=_SECOND)) as server:
        until(lambda: "no scheduled backup could be made" in log.read_text())
        assert metric(server, "underskin_backup_failures_total") >= 1
        assert "overdue" in server.http.get("/").text
        folder.unlink()
        wait_for(folder, 1)


def test_what_a_wrong_clock_dated_ahead_makes_none_superfluous(place: Place, tmp_path: Path) -> None:
    folder = tmp_path / "backups"
    folder.mkdir()
    ahead = folder / "underskin-20990101T000000Z.sqlite3"
    ahead.touch(0o600)
    with running(place, **scheduled(folder)):
        (_, made) = wait_for(folder, 2)
    assert made.stat().st_size > 0
    _, found = doctor(place, UNDERSKIN_BACKUP_TO=str(folder), **NO_WORKERS)
    assert found["backups"]["level"] == "warning"
    assert "ahead" in found["backups"]["found"]


def test_no_old_one_is_deleted_while_the_newest_is_far_smaller(tmp_path: Path) -> None:
    folder, data = tmp_path / "backups", tmp_path / "data"
    folder.mkdir()
    data.mkdir()
    full = folder / "underskin-20200101T000000Z.sqlite3"
    full.write_bytes(bytes(50_000_000))
    with running(Place(data), **scheduled(folder, UNDERSKIN_BACKUP_EVERY=_SECOND, UNDERSKIN_BACKUP_KEEP="1")):
        wait_for(folder, 3)
    assert full.exists()
    assert "no old ones are deleted" in (tmp_path / "data.log").read_text()


@pytest.mark.soak
def test_a_store_that_is_busy_for_long_ends_no_schedule(tmp_path: Path) -> None:
    folder, data = tmp_path / "backups", tmp_path / "data"
    data.mkdir()
    with running(Place(data), **scheduled(folder, UNDERSKIN_BACKUP_EVERY=_SECOND)):
        wait_for(folder, 1)
        with closing(sqlite3.connect(data / "underskin.sqlite3", isolation_level=None)) as other:
            other.execute("BEGIN EXCLUSIVE")
            until(lambda: "no scheduled backup could be made" in (tmp_path / "data.log").read_text())
            other.execute("ROLLBACK")
        count = len(stored_backups(folder))
        wait_for(folder, count + 1)


@pytest.mark.slow
def test_two_servers_make_one_backup_between_them(place: Place, tmp_path: Path) -> None:
    folder = tmp_path / "backups"
    with running(place, **scheduled(folder)), running(place, **scheduled(folder)):
        wait_for(folder, 1)
        time.sleep(2.0)
        assert len(stored_backups(folder)) == 1


def test_a_folder_of_another_store_is_left_alone_and_the_doctor_says_so(place: Place, tmp_path: Path) -> None:
    folder, other = tmp_path / "backups", Place(tmp_path / "other")
    other.folder.mkdir()
    with running(place, **scheduled(folder)):
        theirs = wait_for(folder, 1)
    often = {"UNDERSKIN_BACKUP_EVERY": _SECOND, "UNDERSKIN_BACKUP_KEEP": "1"}
    with running(other, **scheduled(folder, **often)) as server:
        until(lambda: metric(server, "underskin_backup_failures_total") >= 1)
        assert "overdue" in server.http.get("/").text
    assert [entry.path for entry in stored_backups(folder)] == theirs
    assert "holds the backups of another store" in (tmp_path / "other.log").read_text()
    status, found = doctor(other, UNDERSKIN_BACKUP_TO=str(folder), **NO_WORKERS)
    assert (status, found["backups"]["level"]) == (2, "critical")
    assert "holds the backups of another store" in found["backups"]["found"]
    assert "delete" in found["backups"]["advice"]
    _, own = doctor(place, UNDERSKIN_BACKUP_TO=str(folder), **NO_WORKERS)
    assert own["backups"]["level"] == "ok"


def test_a_store_restored_from_a_backup_of_before_it_had_a_schedule_goes_on_with_its_own(tmp_path: Path) -> None:
    folder, place, old = tmp_path / "backups", Place(tmp_path / "data"), tmp_path / "old.sqlite3"
    place.folder.mkdir()
    with running(place, **NO_WORKERS):
        assert place.command("backup", str(old)).returncode == 0
    with running(place, **scheduled(folder)):
        wait_for(folder, 1)
        restored = place.command("restore", str(old))
        assert restored.returncode == 0, restored.stderr
    with running(place, **scheduled(folder, UNDERSKIN_BACKUP_EVERY=_SECOND)):
        wait_for(folder, 2)
