"""The schema at start: created, or updated after a verified backup; a newer schema is rejected. Also restores
backups."""

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import Connection, inspect, text

from service.store import backup, key_requirement
from service.store.engine import Database
from service.store.errors import StoreError
from service.store.tables import metadata

SCRIPTS = Path(__file__).parent / "migrations"
VERSIONS = sorted(file.name[:4] for file in (SCRIPTS / "versions").glob("[0-9]*.py"))  # oldest first
_LOCK = 7236411  # any number, the same for all servers of a database


def migrate(database: Database, folder: Path) -> None:
    """Update the schema to the newest version, also of a store yet to be created. Raises StoreError if that cannot
    be done safely."""
    database.make()
    if version(database) == VERSIONS[-1]:
        return
    with _one_at_a_time(database, folder):
        before = version(database)
        if before is None:
            database.write(_begin)
        elif before != VERSIONS[-1]:
            require_known(before)
            occasion = f"before-{VERSIONS[-1]}"
            backup.remove_parts(folder, occasion)
            backup.make(database, backup.path_for(database, folder, occasion))
            _upgrade(database)


def _begin(connection: Connection) -> None:
    """Create the newest tables, and note their version as Alembic does."""
    metadata.create_all(connection, checkfirst=False)  # what is there already is not of this store
    connection.execute(
        text("CREATE TABLE IF NOT EXISTS alembic_version (version_num VARCHAR(32) NOT NULL PRIMARY KEY)")
    )
    connection.execute(text("INSERT INTO alembic_version VALUES (:newest)"), {"newest": VERSIONS[-1]})


def version(database: Database) -> str | None:
    """The version of the schema; None where there is none yet."""
    return database.read(version_of)


def version_of(connection: Connection) -> str | None:
    """As `version`, on a connection."""
    if not inspect(connection).has_table("alembic_version"):
        return None
    number = connection.execute(text("SELECT version_num FROM alembic_version")).scalar()
    return None if number is None else str(number)


def require_known(number: str) -> None:
    """Rejects the schema of a newer underskin."""
    if number not in VERSIONS:
        raise StoreError(
            f"the store has schema {number}, which this underskin does not know (newest: {VERSIONS[-1]}): "
            "it was written by a newer one. Run that one, or restore a backup made before it."
        )


def _upgrade(database: Database) -> None:
    # Imported here: a start that finds the schema up to date needs no Alembic.
    from alembic import command
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(SCRIPTS))
    config.set_main_option("path_separator", "os")
    with database.writing() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, VERSIONS[-1])


@contextmanager
def _one_at_a_time(database: Database, folder: Path) -> Iterator[None]:
    """Servers that start together migrate once."""
    if database.is_sqlite:
        with (folder / "migration.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield
    else:
        with database.pg_lock(_LOCK):
            yield


def restore(store: Database, file: Path, before: Path, progress: backup.Progress = backup.untold) -> None:
    """Replace the store by the backup `file`, updated to the newest schema; the earlier data are in `before`.
    Required keys stay required, whatever the backup says.

    Raises StoreError, with the store unchanged.
    """
    require_known(backup.verify(store, file))
    store.make()
    with store.without_writers():  # writes acknowledged after the backup would be lost
        needed = store.read(key_requirement.is_needed)
        if version(store) is not None:
            backup.make(store, before, progress)
        backup.replace_with(store, file, progress)
    migrate(store, before.parent.parent)
    if needed:
        store.write(key_requirement.require)
