"""Sessions of browsers: noted at the login, listed, ended; rows of expired ones are deleted at the next login."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

from sqlalchemy import Connection, delete, insert, inspect, select, update

from service.store.errors import Missing
from service.store.tables import AnyRow, sessions
from service.store.times import now


@dataclass(frozen=True)
class NewSession:
    """A login: the id is public and opens nothing; the times are as the store writes them."""

    id: str
    key_name: str
    key_sha256: str
    address: str
    browser: str
    expires_at: str


def has_table(connection: Connection) -> bool:
    """Whether the store's schema has sessions; an older one gets them with the next start."""
    return inspect(connection).has_table(sessions.name)


def add(connection: Connection, session: NewSession) -> None:
    """Note a login."""
    moment = now()
    connection.execute(delete(sessions).where(sessions.c.expires_at < moment))
    connection.execute(insert(sessions), {**asdict(session), "started_at": moment})


def listed(connection: Connection, key_sha256: str | None = None) -> Sequence[AnyRow]:
    """Those that have neither expired nor ended, the latest first; of one key, by its digest, or of all."""
    query = select(sessions).where(sessions.c.ended_at.is_(None), sessions.c.expires_at >= now())
    if key_sha256 is not None:
        query = query.where(sessions.c.key_sha256 == key_sha256)
    return connection.execute(query.order_by(sessions.c.started_at.desc())).all()


def ended(connection: Connection) -> frozenset[str]:
    """Ids of those that were ended, as long as they would not have expired."""
    query = select(sessions.c.id).where(sessions.c.ended_at.is_not(None), sessions.c.expires_at >= now())
    return frozenset(connection.execute(query).scalars())


def end(connection: Connection, session_id: str, key_sha256: str | None = None) -> None:
    """End a session, where a key is given one of that key; raises Missing where no such session is open."""
    this = (sessions.c.id == session_id) & sessions.c.ended_at.is_(None)
    if key_sha256 is not None:
        this &= sessions.c.key_sha256 == key_sha256
    if not connection.execute(update(sessions).where(this).values(ended_at=now())).rowcount:
        raise Missing(f"There is no open session {session_id!r}.")
