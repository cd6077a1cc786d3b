"""The identity of a store, so that two stores do not mistake each other's backups for their own.

For SQLite a number in the database file (its user version, which SQLite does not use), which travels with the file and
its backups; for PostgreSQL the cluster and the database, the same for all servers that share it.
"""

import secrets
import sqlite3

from sqlalchemy import Connection, text

_MOST = 2**31 - 1  # of SQLite's user version
_OF_POSTGRESQL = """SELECT (SELECT system_identifier FROM pg_control_system()), oid FROM pg_database
WHERE datname = current_database()"""


def find(connection: Connection) -> str | None:
    """The store's identity; None where it has none yet."""
    if connection.dialect.name == "sqlite":
        number = connection.execute(text("PRAGMA user_version")).scalar_one()
        return f"sqlite-{number:08x}" if number else None
    cluster, database = connection.execute(text(_OF_POSTGRESQL)).one()
    return f"postgresql-{cluster}-{database}"


def ensure(connection: Connection) -> str:
    """The store's identity, from now on."""
    identity_row = find(connection)
    if identity_row is not None:
        return identity_row
    connection.execute(text(f"PRAGMA user_version = {1 + secrets.randbelow(_MOST)}"))
    return ensure(connection)


def number_in(store: sqlite3.Connection) -> int:
    """The number of an SQLite store; 0 where it has none."""
    return int(store.execute("PRAGMA user_version").fetchone()[0])


def put(store: sqlite3.Connection, number: int) -> None:
    """Give an SQLite store a number."""
    store.execute(f"PRAGMA user_version = {number}")
