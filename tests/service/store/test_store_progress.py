"""Bytes in the progress of import, backup and restore: on a terminal, and of what is really copied."""

import sqlite3
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import pytest

from service.store import backup, campaigns, open_store
from tests.support.store_server import Place, campaign
from underskin.recordings.campaign import parse

BACKEND = "sqlite"
Told = list[tuple[str, int, int | None]]


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
