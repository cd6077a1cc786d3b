"""Answers to requests with an Idempotency-Key, stored in the transaction of the request itself."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from sqlalchemy import ColumnElement, Connection, select

from service.store.codec import compressed, decompressed
from service.store.engine import upsert
from service.store.tables import answers
from service.store.times import now


@dataclass(frozen=True)
class KnownRequest:
    """A repeatable request: its sender, its key, and the digest of its content."""

    sender: str
    idempotency_key: str
    request_sha256: str


class OtherRequest(ValueError):
    """The key was used for a request with other content."""


def replayed(connection: Connection, request: KnownRequest) -> Any | None:
    """The earlier answer; None if there is none. Raises OtherRequest."""
    row = connection.execute(select(answers.c.request_sha256, answers.c.answer).where(_is(request))).first()
    if row is None:
        return None
    if row.request_sha256 != request.request_sha256:
        raise OtherRequest(f"Idempotency-Key {request.idempotency_key!r} was used for another request.")
    return decompressed(row.answer)


def once(
    connection: Connection, request: KnownRequest | None, act: Callable[[Connection], dict[str, Any]]
) -> tuple[dict[str, Any], bool]:
    """The answer of `act` in this transaction, or the earlier answer to the same request, and whether it is the earlier
    one. A second request with the same key waits for the first one's transaction. Raises OtherRequest."""
    if request is None:
        return act(connection), False
    claimed = upsert(connection, answers).on_conflict_do_nothing().returning(answers.c.idempotency_key)
    if connection.execute(claimed, {**asdict(request), "answer": b"", "answered_at": now()}).first() is None:
        return dict(replayed(connection, request) or {}), True
    answer = act(connection)
    connection.execute(answers.update().where(_is(request)).values(answer=compressed(answer)))
    return answer, False


def _is(request: KnownRequest) -> ColumnElement[bool]:
    return (answers.c.sender == request.sender) & (answers.c.idempotency_key == request.idempotency_key)
