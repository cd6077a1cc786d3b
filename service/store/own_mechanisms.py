"""The files of the lab's own mechanisms in the store, so that its backups contain them."""

from collections.abc import Mapping

from sqlalchemy import Connection, delete, insert, inspect, select

from service.store.tables import own_mechanisms


def replace(connection: Connection, files: Mapping[str, bytes]) -> None:
    """Store these files, by name, instead of the earlier ones; a store of an older schema stores none."""
    if not inspect(connection).has_table(own_mechanisms.name) or found(connection) == files:
        return
    connection.execute(delete(own_mechanisms))
    if files:
        rows = [{"file": name, "content": content} for name, content in files.items()]
        connection.execute(insert(own_mechanisms), rows)


def found(connection: Connection) -> dict[str, bytes]:
    """The stored files by name."""
    return {row.file: row.content for row in connection.execute(select(own_mechanisms))}
