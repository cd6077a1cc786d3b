"""Bytes in the progress of import, backup and restore: on a terminal, and of what is really copied."""

import os
import pty
import re
import sqlite3
import subprocess
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import orjson
import pytest

from service.store import backup, campaigns, open_store
from tests.support import preloaded
from tests.support.store_server import Place, Server, campaign
from underskin import Client
from underskin.recordings.campaign import parse

BACKEND = "sqlite"
Told = list[tuple[str, int, int | None]]


def on_a_terminal(place: Place, *arguments: str) -> str:
    """What a command that succeeds shows on a terminal, without the codes that move and colour."""
    ours, its = pty.openpty()
    environment = {**place.environment(), "TERM": "xterm", "COLUMNS": "140"}
    command = [str(preloaded.UNDERSKIN), *arguments]  # anew: a forked one has the streams of its parent
    process = subprocess.Popen(command, env=environment, stdin=its, stdout=its, stderr=its)
    os.close(its)
    shown = b""
    while True:
        try:
            part = os.read(ours, 65536)
        except OSError:  # its end, on Linux
            break
        if not part:
            break
        shown += part
    os.close(ours)
    assert process.wait(240) == 0, shown.decode()
    return re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", shown.decode())


UNITS = {"bytes": 1, "kB": 1e3, "MB": 1e6}


def require_whole(shown: str, step: str, size: int) -> None:
    """A bar ends with all of so many bytes, in the digits that it shows."""
    ends = re.findall(rf"{step}\s.*?([\d.]+)/([\d.]+) (\w+)", shown)
    assert ends, shown
    done, of, unit = ends[-1]
    assert done == of, shown
    assert float(of) * UNITS[unit] == pytest.approx(size, abs=0.051 * UNITS[unit])


def test_import_counts_bytes_sends(server: Server, tmp_path: Path) -> None:
    """An import counts the bytes that it sends."""
    files = [tmp_path / f"{name}.json" for name in ("one", "two")]
    for file in files:
        file.write_bytes(orjson.dumps(campaign(file.stem, lines=400)))
    size = sum(file.stat().st_size for file in files)
    there = ["--url", str(server.http.base_url)]
    shown = on_a_terminal(server.place, "import", *map(str, files), "--skin", "palm", *there)
    require_whole(shown, "importing", size)
    assert shown.count("of skin palm, 6 recordings") == 2
    with Client(str(server.http.base_url)) as client:
        told: list[int] = []
        client.campaigns.post_files(files, skin="palm", progress=told.append)
        assert sum(told) == size


def test_backup_restore_count_bytes_copy(server: Server, tmp_path: Path) -> None:
    """A backup and a restore count the bytes that they copy."""
    server.http.post("/v1/campaigns", json=campaign("kept"))
    file = tmp_path / "kept.backup"
    shown = on_a_terminal(server.place, "backup", str(file))
    require_whole(shown, "reading back", file.stat().st_size)
    assert re.search(r"backing up\s.* [\d.]+/[\d.?]+ (kB|MB)", shown), shown
    shown = on_a_terminal(server.place, "restore", str(file))
    require_whole(shown, "restoring", file.stat().st_size)
    piped = server.place.command("backup", str(file))
    assert (piped.returncode, piped.stderr) == (0, "")


def test_progress_only_rises_and_ends_with_all(place: Place, tmp_path: Path) -> None:
    store = open_store(place.database_url, place.folder)
    for number in range(3):
        with store.writing() as connection:
            campaigns.add(connection, campaigns.NewCampaign(parse(campaign(f"{number}", lines=2000)), None))
    file = tmp_path / "kept"
    told: Told = []
    backup.make(store, file, lambda *words: told.append(words))
    backup.replace_with(store, file, lambda *words: told.append(words))
    store.close()
    for step in ("reading back", "restoring"):
        assert_rising(told, step)
        last = [entry for entry in told if entry[0] == step][-1]
        assert last[1] == last[2]
    assert_rising(told, "backing up")


def assert_rising(told: Sequence[tuple[str, int, int | None]], step: str) -> None:
    done = [entry[1] for entry in told if entry[0] == step]
    assert done == sorted(done)
    assert done[-1] > 0


def test_copy_sqlite_steps_holds_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A copy of sqlite in steps holds one state and never begins anew."""
    monkeypatch.setattr(backup, "STEP_PAGES", 5)
    folder = tmp_path / "data"
    folder.mkdir()
    store = open_store("", folder)

    def add(name: str) -> None:
        with store.writing() as connection:
            campaigns.add(connection, campaigns.NewCampaign(parse(campaign(name, lines=2000)), None))

    add("before")
    told: Told = []

    def write_meanwhile(step: str, done: int, of: int | None) -> None:
        told.append((step, done, of))
        if step == "backing up" and len(told) % 5 == 0:
            add(f"meanwhile {len(told)}")

    file = tmp_path / "kept"
    backup.make(store, file, write_meanwhile)
    store.close()
    copied = [entry for entry in told if entry[0] == "backing up"]
    assert len(copied) > 10
    assert_rising(copied, "backing up")
    assert len({of for _, _, of in copied}) == 1
    with closing(sqlite3.connect(file)) as copy:
        assert copy.execute("SELECT name FROM campaigns").fetchall() == [("before",)]
