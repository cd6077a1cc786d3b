"""Whether requests need a key: stored from the first key on, and lifted only by `underskin key open`."""

from sqlalchemy import Connection, inspect, select

from service.store.engine import upsert
from service.store.tables import AnyRow, key_requirement
from service.store.times import now

_ONLY = 1  # the number of the only row


def has_table(connection: Connection) -> bool:
    """Whether the store's schema has the requirement; an older one gets it with the next start."""
    return inspect(connection).has_table(key_requirement.name)


def find(connection: Connection) -> AnyRow | None:
    """`needed_since`, and `lifted_at` where it is lifted; None where no key was ever made."""
    return connection.execute(select(key_requirement)).first()


def is_needed(connection: Connection) -> bool:
    """Whether keys are needed, as far as the store knows, of whatever version it is."""
    row = find(connection) if has_table(connection) else None
    return row is not None and row.lifted_at is None


def require(connection: Connection) -> None:
    """Note that keys are needed, from now on unless it was noted before."""
    if not is_needed(connection):
        _replace(connection, lifted=False)


def lift(connection: Connection) -> None:
    """Note that keys are not needed any more."""
    _replace(connection, lifted=True)


def _replace(connection: Connection, *, lifted: bool) -> None:
    """Write the only row, whether or not another transaction writes it at the same time."""
    time = now()
    row = {"number": _ONLY, "needed_since": time, "lifted_at": time if lifted else None}
    written = upsert(connection, key_requirement).values(row)
    connection.execute(written.on_conflict_do_update(index_elements=["number"], set_=row))
