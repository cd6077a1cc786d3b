"""A migration killed half way: the store is as it was or as it is to be, and the next start ends the work.

A process of its own is killed by SIGKILL before one of its statements or commits, on its way from the first schema: at
one in thirty of them, or with UNDERSKIN_SOAK=1 at each of them and from every schema.
"""

import multiprocessing
import os
import signal
import sqlite3
import subprocess
from collections.abc import Callable
from contextlib import closing
from itertools import count
from pathlib import Path

import alembic.command  # noqa: F401  # for the processes that are forked here, each of which would import it
import pytest
from sqlalchemy import Engine, event

from bench.figures import Figure
from bench.soak import SOAK, record
from service.store import backup, database, migrate
from tests.service.backends import BACKENDS
from tests.service.store.old_stores.contents import LANDED, take_over
from tests.support.store_server import Place

STEP = 1 if SOAK else 30
OLDER = list(LANDED)[: None if SOAK else 1]


@pytest.fixture(params=BACKENDS)
def new_place(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[[str], Place]:
    """Makes a place with a store of a version in it."""
    cluster = request.getfixturevalue("cluster") if request.param == "postgresql" else None
    numbers = count()

    def make(version: str) -> Place:
        place = Place(tmp_path / str(next(numbers)), "" if cluster is None else cluster.new_database())
        place.folder.mkdir()
        take_over(place, version)
        return place

    return make


@pytest.mark.slow
@pytest.mark.parametrize("version", OLDER)
def test_killed_migration_leaves_old_store_new(new_place: Callable[[str], Place], version: str) -> None:
    """A killed migration leaves the old store or the new one."""
    whole = new_place(version)
    old = content(whole)
    backups = whole.folder / "backups"
    backups.mkdir()
    (backups / f"before-{migrate.VERSIONS[-1]}-20260101T000000.0Z.sqlite3.part").touch()  # of one killed as it copied
    assert migrated(whole, kill_at=0) == 0
    assert not list(backups.glob("*.part*"))
    new = content(whole)
    assert new != old
    left: list[list[str]] = []
    for point in count(1, STEP):
        place = new_place(version)
        if migrated(place, kill_at=point) == 0:
            break
        left.append(content(place))
        assert left[-1] in (old, new), f"between old and new after a kill at point {point}"
        store = database(place.database_url, place.folder)
        for file in (place.folder / "backups").glob("before-*"):
            assert ".part" in file.name or backup.verify(store, file) == version
        store.close()
        assert migrated(place, kill_at=0) == 0, "the next start does not end what was begun"
        assert content(place) == new
    assert left == sorted(left, key=lambda found: found == new), "what was done came undone at a later point"
    assert len(left) >= 40 // STEP, "there were hardly any points to kill it at"
    record(Figure("Migrations killed, each left the old store or the new one", len(left), ""))


def migrated(place: Place, kill_at: int) -> int:
    """How a process ended that migrates a store, killed before its statement or commit `kill_at`; 0: not killed."""
    process = multiprocessing.get_context("fork").Process(target=_migrate, args=(place, kill_at))
    process.start()
    process.join()
    assert process.exitcode in (0, -signal.SIGKILL)
    return process.exitcode


def _migrate(place: Place, kill_at: int) -> None:
    done = count(1)

    def step(*_: object) -> None:
        if next(done) == kill_at:
            os.kill(os.getpid(), signal.SIGKILL)

    event.listen(Engine, "before_cursor_execute", step)
    event.listen(Engine, "commit", step)
    store = database(place.database_url, place.folder)
    migrate.migrate(store, place.folder)
    store.close()


def content(place: Place) -> list[str]:
    """All tables and rows of a store, as SQL."""
    if not place.database_url:
        with closing(sqlite3.connect(place.folder / "underskin.sqlite3")) as store:
            return list(store.iterdump())
    command = ["pg_dump", "--dbname", place.database_url, "--no-owner"]
    dump = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return [line for line in dump.splitlines() if not line.startswith(("--", "\\restrict", "\\unrestrict"))]
