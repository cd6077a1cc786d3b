"""What was answered to requests with an Idempotency-Key, kept in the transaction that kept what they brought."""

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


def claim(connection: Connection, request: KnownRequest) -> bool:
    """Take the key for this transaction; False where another request has it, which by then has ended.

    A second request with the same key waits here for the first one's transaction.
    """
    claimed = upsert(connection, answers).on_conflict_do_nothing().returning(answers.c.idempotency_key)
    return connection.execute(claimed, {**asdict(request), "answer": b"", "answered_at": now()}).first() is not None


def keep(connection: Connection, request: KnownRequest, answer: Any) -> None:
    """Fill in the answer of a claimed key."""
    connection.execute(answers.update().where(_is(request)).values(answer=compressed(answer)))


def _is(request: KnownRequest) -> ColumnElement[bool]:
    return (answers.c.sender == request.sender) & (answers.c.idempotency_key == request.idempotency_key)
