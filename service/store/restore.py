"""Restore: a backup in place of the store, after a backup of what was there."""

import sqlite3
from contextlib import closing
from pathlib import Path

from service.store import backup, key_requirement
from service.store.engine import Database
from service.store.errors import StoreError
from service.store.migrate import migrate, require_known, version


def restore(store: Database, file: Path, before: Path) -> None:
    """Replace the store by the backup `file`, brought up to date; what was there is in `before`.

    Where keys were needed they still are, whatever the backup says.

    Raises StoreError, with the store as it was.
    """
    backup.verify(store, file)
    require_known(_version(store, file))
    store.make()
    with store.without_writers():  # what is acknowledged after the backup would be lost
        needed = keys_needed(store)
        if version(store) is not None:
            backup.make(store, before)
        backup.replace_with(store, file)
    migrate(store, before.parent.parent)
    if needed:
        store.write(key_requirement.require)


def keys_needed(store: Database) -> bool:
    """Whether the store, of any version, says that requests need a key."""
    with store.reading() as connection:
        return key_requirement.is_known(connection) and key_requirement.is_needed(connection)


def _version(store: Database, file: Path) -> str:
    """The version of a backup's schema."""
    if store.is_sqlite:
        with closing(sqlite3.connect(f"{file.absolute().as_uri()}?mode=ro", uri=True)) as copy:
            return str(copy.execute("SELECT version_num FROM alembic_version").fetchone()[0])
    dumped = backup.run("pg_restore", "--data-only", "--table=alembic_version", "--file=-", str(file)).splitlines()
    rows = [dumped[number + 1] for number, line in enumerate(dumped) if line.startswith("COPY ")]
    if not rows:
        raise StoreError(f"{file} does not say its schema")
    return rows[0]
