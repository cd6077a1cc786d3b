"""The files of the lab's own mechanisms in the store, so that its backups hold them."""

from collections.abc import Mapping

from sqlalchemy import Connection, delete, insert, inspect, select

from service.store.tables import own_mechanisms


def replace(connection: Connection, files: Mapping[str, bytes]) -> None:
    """Keep these, by name, and no others; a store of an older schema keeps none."""
    if not inspect(connection).has_table(own_mechanisms.name) or found(connection) == files:
        return
    connection.execute(delete(own_mechanisms))
    if files:
        rows = [{"file": name, "content": content} for name, content in files.items()]
        connection.execute(insert(own_mechanisms), rows)


def found(connection: Connection) -> dict[str, bytes]:
    """Those kept, by name."""
    return {row.file: row.content for row in connection.execute(select(own_mechanisms))}
