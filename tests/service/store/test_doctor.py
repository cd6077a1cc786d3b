"""What `underskin doctor` says of a server that is well, and of what keeps one from its work."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from service.settings import Settings
from service.usecases.checkup import Level, examine
from tests.service.store.scheduled import NO_WORKERS, doctor, scheduled, wait_for
from tests.support.diagnosed import sent
from tests.support.store_server import Place, campaign, running

BACKEND = "sqlite"


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
    with running(place, **NO_WORKERS) as server:
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
        server.process.wait(240)
    file = folder / "underskin.sqlite3"
    content = bytearray(file.read_bytes())
    content[8192 : len(content) // 2] = os.urandom(len(content) // 2 - 8192)
    file.write_bytes(content)
    for damage in (content, bytearray(5000)):
        file.write_bytes(damage)
        status, found = doctor(place, UNDERSKIN_BACKUP_TO=str(backups), **NO_WORKERS)
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
    settings = {"UNDERSKIN_BACKUP_TO": str(backups), "UNDERSKIN_BACKUP_KEEP": "2", **NO_WORKERS}
    _, found = doctor(place, **settings)
    assert "underskin.sqlite3" in found["data folder"]["found"]
    assert file.name in found["backups"]["found"]
    file.chmod(0o600)
    _, found = doctor(place, **settings)
    assert "4 are kept" in found["backups"]["found"]
    _, found = doctor(place, UNDERSKIN_HOSTS="skin.example.org", **NO_WORKERS)
    assert (found["keys"]["level"], place.command("serve", UNDERSKIN_HOSTS="skin.example.org").returncode) == (
        "critical",
        2,
    )
    wrong = place.command("doctor", UNDERSKIN_BACKUP_EVERY="often")
    assert (wrong.returncode, "UNDERSKIN_BACKUP_EVERY" in wrong.stderr) == (2, True)


def test_the_doctor_tells_a_store_that_is_gone_from_one_that_never_was(tmp_path: Path) -> None:
    place, backups = Place(tmp_path / "data"), tmp_path / "backups"
    place.folder.mkdir(0o700)
    settings = scheduled(backups)
    _, new = doctor(place, **NO_WORKERS)
    assert new["store"]["level"] == "warning"
    with running(place, **settings) as server:
        sent(server, campaign("kept"))
        wait_for(backups, 1)
        (place.folder / "underskin.sqlite3").rename(tmp_path / "away")
        _, without_backups = doctor(place, **NO_WORKERS)
    shutil.rmtree(place.folder)
    place.folder.mkdir(0o700)  # as where its disk is not mounted
    _, empty = doctor(place, **settings)
    for found in (without_backups, empty):
        assert (found["store"]["level"], "put underskin.sqlite3 back" in found["store"]["advice"]) == ("critical", True)


def test_what_cannot_be_entered_is_a_finding_of_each_check(tmp_path: Path) -> None:
    """As a data folder of another user, or a disk that does not answer."""
    data, backups = tmp_path / "data", tmp_path / "backups"
    with running(Place(data), **scheduled(backups)):
        wait_for(backups, 1)
    settings = Settings(data=data, backup_to=backups, diagnosis_workers=0)
    assert Level.CRITICAL not in {one.level for one in examine(settings)}
    with nobody(data, backups):
        found = {one.check: one for one in examine(settings)}
    for check in ("data folder", "store", "backups", "keys"):
        assert found[check].level is Level.CRITICAL, check
        assert "ermission denied" in found[check].found or "cannot be written to" in found[check].found
        assert found[check].advice


@contextmanager
def nobody(*folders: Path) -> Iterator[None]:
    """Folders that nobody may enter; root, who may enter all, is another user meanwhile."""
    root = os.geteuid() == 0
    for folder in folders:
        folder.chmod(0)
    if root:
        os.seteuid(65534)
    try:
        yield
    finally:
        if root:
            os.seteuid(0)
        for folder in folders:
            folder.chmod(0o700)


@pytest.mark.parametrize("command", [["backup", "b.pgdump"], ["restore", "b.pgdump"], ["key", "sessions"]])
def test_a_database_that_is_not_there_is_one_line(tmp_path: Path, command: list[str]) -> None:
    (tmp_path / "data").mkdir(0o700)
    (tmp_path / "b.pgdump").write_bytes(b"PGDMP")
    place = Place(tmp_path / "data", "postgresql://nobody@127.0.0.1:1/nowhere")
    ended = place.command(command[0], *(str(tmp_path / word) if "." in word else word for word in command[1:]))
    assert (ended.returncode, ended.stdout, ended.stderr.count("\n")) == (2, "", 1), ended.stderr
    _, found = doctor(place, **NO_WORKERS)
    assert found["store"]["level"] == "critical"
