"""Backup and restore while the server runs; migrations after a backup; a newer schema."""

import sqlite3
import subprocess
import threading
import time
from contextlib import closing
from pathlib import Path

import pytest

from service.store import Database, backup, campaigns, open_store
from service.store.migrate import restore
from tests.service.backends import BACKENDS
from tests.support.store_server import Place, Server, campaign, running
from underskin.recordings.campaign import parse

BACKEND = "sqlite"
on_both = pytest.mark.parametrize("server", BACKENDS, indirect=True)


def names(server: Server) -> set[str]:
    return {entry["name"] for entry in server.http.get("/v1/campaigns?limit=200&state=all").json()["campaigns"]}


def send(server: Server, name: str) -> None:
    assert server.http.post("/v1/campaigns", json=campaign(name)).status_code == 201


@on_both
def test_a_backup_brings_back_what_was_there(server: Server, tmp_path: Path) -> None:
    file = tmp_path / "kept.backup"
    send(server, "before")
    done = server.place.command("backup", str(file))
    assert done.returncode == 0, done.stderr
    send(server, "after")
    done = server.place.command("restore", str(file))
    assert done.returncode == 0, done.stderr
    assert names(server) == {"before"}
    send(server, "later")
    assert names(server) == {"before", "later"}
    (undo,) = (server.place.folder / "backups").iterdir()
    assert server.place.command("restore", str(undo)).returncode == 0
    assert names(server) == {"before", "after"}


def test_service_writes_owners_alone_nothing(server: Server, tmp_path: Path) -> None:
    """What the service writes is its owners alone and nothing lies beside a backup."""
    file = tmp_path / "shared" / "kept.backup"
    file.parent.mkdir()
    for suffix in (".part", ".part-journal"):  # of a backup that was killed
        file.with_name(file.name + suffix).write_bytes(b"half")
    send(server, "kept")
    assert server.place.command("backup", str(file)).returncode == 0
    assert [entry.name for entry in file.parent.iterdir()] == [file.name]
    ours = [file, *(entry for entry in server.place.folder.rglob("*") if entry.is_file())]
    assert {entry.name: entry.stat().st_mode & 0o077 for entry in ours if entry.stat().st_mode & 0o077} == {}


def test_backup_holds_mechanisms_labs(place: Place, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A backup holds the mechanisms of the labs own."""
    monkeypatch.delenv("UNDERSKIN_MECHANISMS", raising=False)
    folder, file = place.folder / "mechanisms", tmp_path / "kept.backup"  # where a server has it by itself
    folder.mkdir()
    whole = Path("examples/mechanisms/warm_film.yaml").read_text()
    contents = {f"{name}.yaml": whole.replace("warm_film", name) for name in ("gone", "changed", "renamed", "same")}
    for name, content in contents.items():
        (folder / name).write_text(content)
    open_store(place.database_url, place.folder).close()
    done = place.command("backup", str(file))
    assert done.returncode == 0, done.stderr
    (folder / "gone.yaml").unlink()
    (folder / "changed.yaml").write_text(contents["changed.yaml"] + "# another\n")
    (folder / "renamed.yaml").rename(folder / "other_name.yaml")
    done = place.command("restore", str(file))
    assert done.returncode == 0, done.stderr
    assert {entry.name: entry.read_text() for entry in folder.glob("*.yaml")} == contents
    assert "put back: gone.yaml" in done.stdout
    assert "set aside in discarded: changed.yaml, renamed.yaml" in done.stdout
    assert any("# another" in entry.read_text() for entry in (folder / "discarded").iterdir())


def test_a_backup_moves_to_another_machine(server: Server, tmp_path: Path) -> None:
    if server.place.database_url:
        return  # the other machine would be another database: the next line's restore is the same
    send(server, "moved")
    assert server.place.command("backup", str(tmp_path / "b")).returncode == 0
    other = Place(tmp_path / "other")
    assert other.command("restore", str(tmp_path / "b")).returncode == 0
    with running(other) as there:
        assert names(there) == {"moved"}


@pytest.mark.parametrize("place", BACKENDS, indirect=True)
def test_acknowledged_during_restore_store(place: Place, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is acknowledged during a restore is in the store or in its backup."""
    store = open_store(place.database_url, place.folder)
    file, undo = (tmp_path / f"{name}" for name in ("file", "undo"))
    undo = place.folder / "backups" / undo.name
    backup.make(store, file)
    make = backup.make

    def write() -> None:
        with store.writing() as connection:
            campaigns.add(connection, campaigns.NewCampaign(parse(campaign("meanwhile")), None))

    writer = threading.Thread(target=write)

    def make_and_be_written(database: Database, target: Path, progress: backup.Progress) -> None:
        make(database, target, progress)
        writer.start()
        writer.join(2)  # time for a write that does not wait

    monkeypatch.setattr(backup, "make", make_and_be_written)
    restore(store, file, undo)
    writer.join()
    with store.reading() as connection:
        assert [row.name for row in campaigns.listed(connection, campaigns.CampaignFilters(), None, 9)] == ["meanwhile"]
    store.close()


@pytest.mark.parametrize("place", BACKENDS, indirect=True)
def test_readers_answered_restore_goes(place: Place, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Readers are answered while a restore goes on."""
    monkeypatch.setattr(backup, "STEP_PAGES", 1)  # a small store is copied in several steps, too
    file = tmp_path / "backup"
    with running(place, UNDERSKIN_DIAGNOSIS_WORKERS="0") as server:
        kept = server.http.post("/v1/campaigns", json=campaign("before")).json()["id"]
        assert place.command("backup", str(file)).returncode == 0
        later = server.http.post("/v1/campaigns", json=campaign("after")).json()["id"]
        seen: list[list[int]] = []

        def read(what: str, *_: object) -> None:
            if what == "restoring" and not seen:
                time.sleep(0.5)  # whatever has been begun is under way
                seen.append([server.http.get(f"/v1/campaigns/{one}", timeout=240).status_code for one in (kept, later)])

        with closing(open_store(place.database_url, place.folder)) as store, store.without_writers():
            backup.replace_with(store, file, read)
        assert seen[0] == [200, 200]
        assert [server.http.get(f"/v1/campaigns/{one}").status_code for one in (kept, later)] == [200, 404]
        assert server.http.post("/v1/campaigns", json=campaign("after it")).status_code == 201


def test_a_backup_of_sqlite_is_one_file_that_is_only_read(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    store = open_store("", tmp_path / "data")
    file = tmp_path / "alone" / "kept"
    backup.make(store, file)
    backup.verify(store, file)
    restore(store, file, tmp_path / "data" / "backups" / "undo")
    store.close()
    assert file.read_bytes()[18:20] == b"\x01\x01"  # SQLite's header: no write-ahead log
    assert [path.name for path in file.parent.iterdir()] == ["kept"]
    with closing(sqlite3.connect(tmp_path / "data" / "underskin.sqlite3")) as connection:
        assert connection.execute("PRAGMA journal_mode").fetchone() == ("wal",)


@on_both
def test_what_is_no_backup_is_refused_and_changes_nothing(server: Server, tmp_path: Path) -> None:
    send(server, "kept")
    good = tmp_path / "good"
    assert server.place.command("backup", str(good)).returncode == 0
    cut = tmp_path / "cut"
    cut.write_bytes(good.read_bytes()[: good.stat().st_size // 2])
    foreign = tmp_path / "foreign"
    foreign.write_text("not a backup")
    for file in (cut, foreign, tmp_path / "absent"):
        done = server.place.command("restore", str(file))
        assert (done.returncode, str(file) in done.stderr) == (2, True), done.stderr
    assert names(server) == {"kept"}


def test_a_newer_schema_refuses_to_start(place: Place) -> None:
    with running(place) as server:
        send(server, "kept")
    _execute(place, "UPDATE alembic_version SET version_num = '9999'")
    done = place.command("serve", "--port", "0")
    assert done.returncode != 0
    assert "9999" in done.stderr
    assert "newer" in done.stderr


def _execute(place: Place, statement: str) -> None:
    if place.database_url:
        subprocess.run(["psql", place.database_url, "--command", statement], check=True, capture_output=True)
    else:
        with closing(sqlite3.connect(place.folder / "underskin.sqlite3")) as connection:
            connection.execute(statement)
            connection.commit()
