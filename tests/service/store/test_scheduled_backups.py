"""Backups on a schedule by a real server: made, read back, rotated, restored; and what the doctor says of it all."""

import json
import os
import re
import shutil
import sqlite3
import time
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from service.usecases.scheduled_backups import OWNER, kept
from tests.service.backends import BACKENDS
from tests.support import postgres
from tests.support.diagnosed import sent
from tests.support.store_server import Place, Server, campaign, running

BACKEND = "sqlite"
_NONE = {"UNDERSKIN_DIAGNOSIS_WORKERS": "0"}
_SECOND = str(1 / 3600)  # in hours


def scheduled(folder: Path, **settings: str) -> dict[str, str]:
    return {**_NONE, "UNDERSKIN_BACKUP_TO": str(folder), **settings}


def wait_for(folder: Path, count: int) -> list[Path]:
    """Until there are so many backups, or more."""
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        found = [entry.path for entry in kept(folder)] if folder.is_dir() else []
        if len(found) >= count:
            return found
        time.sleep(0.05)
    raise AssertionError(f"{found} instead of {count} backups")


def doctor(place: Place, **settings: str) -> tuple[int, dict[str, dict[str, Any]]]:
    """Exit status, and the worst finding of each check."""
    done = place.command("doctor", "--json", **settings)
    assert done.stdout, done.stderr
    levels = ("ok", "warning", "critical")
    findings: dict[str, dict[str, Any]] = {}
    for entry in json.loads(done.stdout):
        worst = findings.get(entry["check"])
        if worst is None or levels.index(entry["level"]) > levels.index(worst["level"]):
            findings[entry["check"]] = entry
    return done.returncode, findings


def metric(server: Server, name: str) -> float:
    found = re.search(rf"^{name} (\S+)$", server.http.get("/metrics").text, flags=re.MULTILINE)
    assert found is not None
    return float(found[1])


@pytest.mark.parametrize("place", BACKENDS, indirect=True)
def test_a_backup_is_made_at_the_start_and_can_be_restored(place: Place, tmp_path: Path) -> None:
    folder = tmp_path / "backups"
    with running(place, **_NONE) as server:
        first = sent(server, campaign("kept"))
    with running(place, **scheduled(folder)) as server:
        (file,) = wait_for(folder, 1)
        assert file.stat().st_mode & 0o077 == 0
        later = sent(server, campaign("later"))
        time.sleep(1.1)
        assert metric(server, "underskin_backup_age_seconds") < 60
        assert metric(server, "underskin_backup_bytes") == file.stat().st_size
        assert "Last backup" in server.http.get("/").text
    with running(place, **scheduled(folder)):  # the one that is there is young enough
        time.sleep(1.0)
        assert [entry.path for entry in kept(folder)] == [file]
    restored = place.command("restore", str(file))
    assert restored.returncode == 0, restored.stderr
    with running(place, **_NONE) as server:
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
        deadline = time.monotonic() + 60
        while first.exists():
            assert time.monotonic() < deadline, "the oldest backup stays"
            time.sleep(0.05)
        assert 1 <= len(kept(folder)) <= 3
    assert all(other.read_text() == "mine" for other in others)
    assert not list(folder.glob("*.part*"))


def test_a_backup_that_fails_is_counted_logged_and_made_later(place: Place, tmp_path: Path) -> None:
    folder = tmp_path / "not-a-folder"
    folder.write_text("a file")
    log = place.folder.parent / f"{place.folder.name}.log"
    with running(place, **scheduled(folder, UNDERSKIN_BACKUP_EVERY=_SECOND)) as server:
        deadline = time.monotonic() + 60
        while "no scheduled backup could be made" not in log.read_text():
            assert time.monotonic() < deadline
            time.sleep(0.05)
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
    _, found = doctor(place, UNDERSKIN_BACKUP_TO=str(folder), **_NONE)
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


@pytest.mark.slow
def test_a_store_that_is_busy_for_long_ends_no_schedule(tmp_path: Path) -> None:
    folder, data = tmp_path / "backups", tmp_path / "data"
    data.mkdir()
    with running(Place(data), **scheduled(folder, UNDERSKIN_BACKUP_EVERY=_SECOND)):
        wait_for(folder, 1)
        with closing(sqlite3.connect(data / "underskin.sqlite3", isolation_level=None)) as other:
            other.execute("BEGIN EXCLUSIVE")
            deadline = time.monotonic() + 90
            while "no scheduled backup could be made" not in (tmp_path / "data.log").read_text():
                assert time.monotonic() < deadline
                time.sleep(0.2)
            other.execute("ROLLBACK")
        count = len(kept(folder))
        wait_for(folder, count + 1)


@pytest.mark.slow
def test_two_servers_make_one_backup_between_them(place: Place, tmp_path: Path) -> None:
    folder = tmp_path / "backups"
    with running(place, **scheduled(folder)), running(place, **scheduled(folder)):
        wait_for(folder, 1)
        time.sleep(2.0)
        assert len(kept(folder)) == 1


def test_a_folder_of_another_store_is_left_alone_and_the_doctor_says_so(place: Place, tmp_path: Path) -> None:
    folder, other = tmp_path / "backups", Place(tmp_path / "other")
    other.folder.mkdir()
    with running(place, **scheduled(folder)):
        theirs = wait_for(folder, 1)
    often = {"UNDERSKIN_BACKUP_EVERY": _SECOND, "UNDERSKIN_BACKUP_KEEP": "1"}
    with running(other, **scheduled(folder, **often)) as server:
        deadline = time.monotonic() + 60
        while metric(server, "underskin_backup_failures_total") < 1:
            assert time.monotonic() < deadline
            time.sleep(0.05)
        assert "overdue" in server.http.get("/").text
    assert [entry.path for entry in kept(folder)] == theirs
    assert "holds the backups of another store" in (tmp_path / "other.log").read_text()
    status, found = doctor(other, UNDERSKIN_BACKUP_TO=str(folder), **_NONE)
    assert (status, found["backups"]["level"]) == (2, "critical")
    assert "holds the backups of another store" in found["backups"]["found"]
    assert "delete" in found["backups"]["advice"]
    _, own = doctor(place, UNDERSKIN_BACKUP_TO=str(folder), **_NONE)
    assert own["backups"]["level"] == "ok"


def test_a_store_restored_from_a_backup_of_before_it_had_a_schedule_goes_on_with_its_own(tmp_path: Path) -> None:
    folder, place, old = tmp_path / "backups", Place(tmp_path / "data"), tmp_path / "old.sqlite3"
    place.folder.mkdir()
    with running(place, **_NONE):
        assert place.command("backup", str(old)).returncode == 0
    with running(place, **scheduled(folder)):
        wait_for(folder, 1)
        restored = place.command("restore", str(old))
        assert restored.returncode == 0, restored.stderr
    with running(place, **scheduled(folder, UNDERSKIN_BACKUP_EVERY=_SECOND)):
        wait_for(folder, 2)


def test_an_empty_note_of_whose_folder_it_is_ends_no_schedule(place: Place, tmp_path: Path) -> None:
    """What an older version left where the disk was full, or the power failed."""
    folder = tmp_path / "backups"
    folder.mkdir()
    (folder / OWNER).touch()
    with running(place, **scheduled(folder)):
        wait_for(folder, 1)
    assert (folder / OWNER).read_text()


def test_metrics_wait_for_no_database(tmp_path: Path) -> None:
    if not postgres.available():
        pytest.skip("PostgreSQL (Debian's package postgresql) is not installed")
    folder, backups = tmp_path / "data", tmp_path / "backups"
    folder.mkdir()
    with postgres.running() as cluster:
        place = Place(folder, cluster.new_database())
        with running(place, **scheduled(backups)) as server:
            (file,) = wait_for(backups, 1)
            deadline = time.monotonic() + 60
            while metric(server, "underskin_backup_bytes") == 0:
                assert time.monotonic() < deadline
                time.sleep(0.05)
            cluster.stop()
            assert server.http.get("/health").status_code == 200
            assert metric(server, "underskin_backup_bytes") == file.stat().st_size
            status, found = doctor(place, UNDERSKIN_BACKUP_TO=str(backups), **_NONE)
    assert status == 2
    assert "does not answer" in found["store"]["found"]
    assert (found["store"]["level"], found["backups"]["level"]) == ("critical", "warning")


def test_the_doctor_finds_nothing_wrong_with_a_server_that_is_well(place: Place, tmp_path: Path) -> None:
    folder = tmp_path / "backups"
    place.folder.chmod(0o700)
    with running(place, **scheduled(folder)) as server:
        sent(server, campaign("kept"))
        wait_for(folder, 1)
        status, found = doctor(place, UNDERSKIN_BACKUP_TO=str(folder))
    assert {entry["level"] for name, entry in found.items() if not name.startswith("disk")} == {"ok"}, found
    assert status <= 1  # the disk of a test machine may be nearly full
    assert found["store"]["found"].startswith("1 campaigns")
    assert "trial diagnosis ended" in found["workers"]["found"]


def test_the_doctor_tells_what_is_wrong_and_what_to_do(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    folder.mkdir()
    place = Place(folder)
    with running(place, **_NONE) as server:
        sent(server, campaign("kept"))
        assert place.command("key", "create", "lab").returncode == 0
    (folder / "keys.json").unlink()
    folder.chmod(0o755)
    backups = tmp_path / "backups"
    backups.mkdir()
    (backups / "underskin-20200101T000000Z.sqlite3").write_bytes(b"")
    tables = tmp_path / "tables"
    tables.mkdir()
    status, found = doctor(place, UNDERSKIN_BACKUP_TO=str(backups), UNDERSKIN_TABLES=str(tables))
    assert status == 2
    assert {name: entry["level"] for name, entry in found.items() if entry["level"] != "ok" and "disk" not in name} == {
        "data folder": "warning", "tables": "critical", "backups": "critical", "keys": "critical",
        "workers": "critical",
    }  # fmt: skip
    assert all(entry["advice"] for entry in found.values() if entry["level"] != "ok")


def test_the_doctor_sees_a_damaged_store(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    folder.mkdir()
    place, backups = Place(folder), tmp_path / "backups"
    with running(place, **scheduled(backups)) as server:
        wait_for(backups, 1)
        for number in range(4):
            sent(server, campaign(f"kept {number}", lines=200))
        server.process.terminate()
        server.process.wait(30)
    file = folder / "underskin.sqlite3"
    content = bytearray(file.read_bytes())
    content[8192 : len(content) // 2] = os.urandom(len(content) // 2 - 8192)
    file.write_bytes(content)
    for damage in (content, bytearray(5000)):
        file.write_bytes(damage)
        status, found = doctor(place, UNDERSKIN_BACKUP_TO=str(backups), **_NONE)
        assert status == 2
        assert found["store"]["level"] == "critical"
        assert "backups" in found


def test_the_doctor_sees_what_others_may_open_and_what_no_server_starts_with(tmp_path: Path) -> None:
    place, backups = Place(tmp_path / "data"), tmp_path / "backups"
    place.folder.mkdir(0o700)
    with running(place, **scheduled(backups)):
        (file,) = wait_for(backups, 1)
    for number in range(3):
        shutil.copy(file, backups / f"underskin-2026010{number + 1}T000000Z.sqlite3")
    file.chmod(0o640)
    (place.folder / "underskin.sqlite3").chmod(0o640)
    settings = {"UNDERSKIN_BACKUP_TO": str(backups), "UNDERSKIN_BACKUP_KEEP": "2", **_NONE}
    _, found = doctor(place, **settings)
    assert "underskin.sqlite3" in found["data folder"]["found"]
    assert file.name in found["backups"]["found"]
    file.chmod(0o600)
    _, found = doctor(place, **settings)
    assert "4 are kept" in found["backups"]["found"]
    _, found = doctor(place, UNDERSKIN_HOSTS="skin.example.org", **_NONE)
    assert (found["keys"]["level"], place.command("serve", UNDERSKIN_HOSTS="skin.example.org").returncode) == (
        "critical",
        1,
    )
    wrong = place.command("doctor", UNDERSKIN_BACKUP_EVERY="often")
    assert (wrong.returncode, "UNDERSKIN_BACKUP_EVERY" in wrong.stderr) == (2, True)
