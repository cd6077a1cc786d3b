"""A request under an Idempotency-Key: the same request is answered the same and done once."""

import hashlib
from collections.abc import Callable
from typing import Annotated, Any

from fastapi import Depends, Header, Request
from sqlalchemy import Connection

from service.dependencies import Store, sender
from service.store import answers

IdempotencyKey = Annotated[
    str | None,
    Header(
        min_length=1,
        max_length=255,
        description="A text of your own: the same request under the same key is answered the same and done once.",
    ),
]


class Idempotency:
    """The request as a repetition of it would be recognised."""

    def __init__(self, request: Request, store: Store, idempotency_key: IdempotencyKey = None) -> None:
        self.sender = sender(request)
        self._store, self._path, self._key = store, request.url.path, idempotency_key

    def answer(self, body: Any, act: Callable[[Connection], dict[str, Any]]) -> dict[str, Any]:
        """What `act` answers in a transaction of its own, or what it answered before; `body` is the request's."""
        digest = hashlib.sha256(repr([self._path, body]).encode()).hexdigest()
        request = None if self._key is None else answers.KnownRequest(self.sender or "", self._key, digest)
        return self._store.write(answers.once, request, act)[0]


Idempotent = Annotated[Idempotency, Depends()]
