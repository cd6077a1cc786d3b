"""Backup and restore of the whole store in one file, while servers run.

SQLite: a copy by its online backup, an ordinary database file. PostgreSQL: pg_dump's custom format. Each backup is read
back completely before it is accepted: by SQLite's integrity_check, by pg_restore into nothing. Progress callbacks get
the step, the bytes done and the total; None if unknown.
"""

import os
import sqlite3
from collections.abc import Callable
from contextlib import closing
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from service import durable
from service.store import identity, pg_dumps
from service.store.engine import Database
from service.store.errors import StoreError

Progress = Callable[[str, int, int | None], object]
_BACKING_UP, _READING_BACK, _RESTORING = "backing up", "reading back", "restoring"
STEP_PAGES = 1000  # of an SQLite database, copied between two words of progress


def untold(_what: str, _done: int, _of: int | None) -> None:
    """A progress callback that does nothing."""


def path_for(database: Database, folder: Path, occasion: str) -> Path:
    """The path of an automatic backup in the data folder; unique within a second too."""
    suffix = ".sqlite3" if database.is_sqlite else ".pgdump"
    return folder / "backups" / f"{occasion}-{datetime.now(UTC):%Y%m%dT%H%M%S.%fZ}{suffix}"


def remove_parts(folder: Path, occasion: str) -> None:
    """Remove partial backups of killed processes; no backup may be in progress."""
    for part in (folder / "backups").glob(f"{occasion}-*.part*"):
        part.unlink()


def make(database: Database, file: Path, progress: Progress = untold) -> None:
    """Write a verified backup; an existing file is replaced only by a complete one. Raises StoreError, OSError."""
    durable.make_folder(file.parent)
    part = file.with_name(file.name + ".part")
    _remove(part)
    try:
        if database.is_sqlite:
            _copy_sqlite(_sqlite_file(database), part, _BACKING_UP, progress)
            _as_single_file(part)
        else:
            pg_dumps.dump(database, part, partial(progress, _BACKING_UP))
        progress(_READING_BACK, 0, None)
        verify(database, part)
        progress(_READING_BACK, part.stat().st_size, part.stat().st_size)
        with part.open("rb") as written:
            os.fsync(written.fileno())
        durable.replace(part, file)
    finally:
        _remove(part)


def _remove(part: Path) -> None:
    """Remove a partial backup with SQLite's journal files, which would spoil the next one."""
    for suffix in ("", "-journal", "-wal", "-shm"):
        part.with_name(part.name + suffix).unlink(missing_ok=True)


def verify(database: Database, file: Path) -> str:
    """The schema version of a backup, after reading all of it; raises StoreError if it is damaged or not a backup."""
    if not file.is_file():
        raise StoreError(f"{file} is not a file")
    if database.is_sqlite:
        with closing(_open_sqlite(file)) as copy:
            try:
                result = copy.execute("PRAGMA integrity_check").fetchone()[0]
                versions = copy.execute("SELECT version_num FROM alembic_version").fetchall()
            except sqlite3.DatabaseError as error:
                raise StoreError(f"{file} is not a backup of an SQLite store: {error}") from error
        if result != "ok":
            raise StoreError(f"{file} is damaged: {result}")
        rows = [str(number) for (number,) in versions]
    else:
        try:
            rows = pg_dumps.versions(file)
        except StoreError as error:
            raise StoreError(f"{file} is not a backup of a PostgreSQL store, or damaged: {error}") from error
    if not rows:
        raise StoreError(f"{file} is not a backup of a store")
    return rows[0]


def replace_with(database: Database, file: Path, progress: Progress = untold) -> None:
    """Replace the store by a backup in one transaction; running servers see it from their next request on."""
    verify(database, file)
    if database.is_sqlite:
        target = _sqlite_file(database)
        with closing(sqlite3.connect(target, timeout=60)) as store:
            number_before = identity.number_in(store)
            _copy_sqlite(file, target, _RESTORING, progress)
            if number_before and not identity.number_in(store):  # a backup of before stores had one
                identity.put(store, number_before)
    else:
        pg_dumps.replace(database, file, partial(progress, _RESTORING))


def _copy_sqlite(source: Path, target: Path, what: str, progress: Progress) -> None:
    try:
        with closing(_open_sqlite(source)) as origin, closing(sqlite3.connect(target, timeout=60)) as copy:
            page_bytes = origin.execute("PRAGMA page_size").fetchone()[0]

            def on_step(_status: int, remaining: int, pages: int) -> None:
                progress(what, (pages - remaining) * page_bytes, pages * page_bytes)

            # A transaction of the source holds one state of it: its writers do not disturb a copy in steps, which
            # would begin anew with each of their commits. The target is replaced in one transaction of its own.
            origin.execute("BEGIN")
            origin.execute("SELECT count(*) FROM sqlite_master").fetchone()
            origin.backup(copy, pages=STEP_PAGES, progress=on_step)
    except sqlite3.Error as error:
        raise StoreError(f"{source} cannot be copied to {target}: {error}") from error


def _as_single_file(copy: Path) -> None:
    """Without a write-ahead log, so that it can be read from a read-only place."""
    with closing(sqlite3.connect(copy)) as connection:
        connection.execute("PRAGMA journal_mode = DELETE")


def _open_sqlite(file: Path) -> sqlite3.Connection:
    return sqlite3.connect(f"{file.absolute().as_uri()}?mode=ro", uri=True, timeout=60)


def _sqlite_file(database: Database) -> Path:
    assert database.url.database is not None
    return Path(database.url.database)
