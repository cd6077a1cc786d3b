"""What was answered to requests with an Idempotency-Key, kept in the transaction that kept what they brought."""

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
    """A request that may come again: who sent it, under which key, and the digest of what it carried."""

    sender: str
    idempotency_key: str
    request_sha256: str


class OtherRequest(ValueError):
    """The key was used for a request that carried something else."""


def replayed(connection: Connection, request: KnownRequest) -> Any | None:
    """The answer given before; None where there is none. Raises OtherRequest."""
    row = connection.execute(select(answers.c.request_sha256, answers.c.answer).where(_is(request))).first()
    if row is None:
        return None
    if row.request_sha256 != request.request_sha256:
        raise OtherRequest(f"Idempotency-Key {request.idempotency_key!r} was used for another request.")
    return decompressed(row.answer)


def once(
    connection: Connection, request: KnownRequest | None, act: Callable[[Connection], dict[str, Any]]
) -> tuple[dict[str, Any], bool]:
    """What `act` answers in this transaction, or what it answered to the same request before; True: it was before.

    A second request with the same key waits for the first one's transaction. Raises OtherRequest.
    """
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
