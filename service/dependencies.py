"""What routes are given, as annotated types."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Annotated, Any, TypeVar

import numpy as np
from fastapi import Depends, Path, Request, Response
from fastapi.security import SecurityScopes

from service.auth.access_control import SAFE
from service.auth.keys import Key
from service.problems import Refusal
from service.schemas.columns import ColumnsRequest, parse
from service.schemas.columns_answer import Accept, Columns, respond
from service.store import Database
from underskin.surrogate.sigma_table import SigmaTable


def _table(request: Request) -> SigmaTable:
    table: SigmaTable = request.app.state.table
    return table


Table = Annotated[SigmaTable, Depends(_table)]


def _store_to_read(request: Request) -> Database:
    store: Database = request.app.state.store
    return store


# For routes that keep nothing, whatever their method.
StoreToRead = Annotated[Database, Depends(_store_to_read)]


def _store(request: Request, store: StoreToRead) -> Database:
    """The store; for requests that may change it, only where it keeps what it is told: otherwise StoreMoved."""
    if request.method not in SAFE:
        store.require_in_place()
    return store


Store = Annotated[Database, Depends(_store)]

CampaignId = Annotated[str, Path(description="Id of a campaign, as it was answered when it was sent.")]
SkinId = Annotated[str, Path(description="Id of a skin.")]


def authorised(scopes: SecurityScopes, request: Request) -> None:
    """Refuses a key of too narrow a scope; that there is a key, where one is needed, was checked before."""
    key: Key | None = request.scope["key"]
    if key is not None and "write" in scopes.scopes and key.scope != "write":
        raise Refusal(
            403,
            f"Key {key.name!r} has scope read; this needs one of scope write: underskin key create NAME --scope write",
        )


# A body up to this size is answered on the event loop (a few ms at most); a larger one in a thread, a few at a time.
_INLINE_BYTES = 1024
_threads = asyncio.Semaphore(4)

_Kind = TypeVar("_Kind", bound=ColumnsRequest)


def columns_route(
    kind: type[_Kind], answer: Callable[[SigmaTable, _Kind], Columns]
) -> Callable[..., Awaitable[Response]]:
    """An endpoint that reads a request in columns, answers it and writes it as the client accepts it."""

    async def endpoint(request: Request, table: Table, accept: Accept = "application/json") -> Response:
        """In columns: a list has an entry a row, a single number holds for all rows. Accept: text/csv gives CSV."""
        body = await request.body()
        content_type = request.headers.get("content-type", "")

        def work() -> Response:
            with np.errstate(all="ignore"):  # what overflows is answered as out of the domain
                return respond(answer(table, parse(kind, body, content_type)), accept)

        if len(body) <= _INLINE_BYTES and b"adopted" not in body:  # that model is in the store
            return work()
        return await in_thread(work)

    return endpoint


async def in_thread(work: Callable[[], Response]) -> Response:
    """What `work` answers, which may take long: a few at a time, beside the event loop."""
    async with _threads:
        return await asyncio.to_thread(work)


def columns_body(kind: type[ColumnsRequest], examples: dict[str, Any]) -> dict[str, Any]:
    """OpenAPI's description of a body in columns."""
    schema = kind.model_json_schema()
    return {
        "requestBody": {
            "required": True,
            "content": {
                "application/json": {"schema": schema, "example": examples},
                "text/csv": {"schema": {"type": "string"}, "example": _as_csv(examples)},
            },
        }
    }


def _as_csv(examples: dict[str, Any]) -> str:
    """The same columns as CSV, single numbers repeated in every row."""
    count = max((len(value) for value in examples.values() if isinstance(value, list)), default=1)
    columns = [value if isinstance(value, list) else [value] * count for value in examples.values()]
    lines = [examples, *zip(*columns, strict=True)]
    return "".join(",".join(map(str, line)) + "\r\n" for line in lines)
