"""Endpoints that answer in columns, as JSON or CSV, and what OpenAPI says of them."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Annotated, Any, TypeVar

import numpy as np
from fastapi import Header, Request, Response

from service.dependencies import Table
from service.routes.columns_body import parse
from service.schemas.columns import ColumnsRequest
from service.schemas.columns_answer import Columns
from underskin.surrogate.sigma_table import SigmaTable

Accept = Annotated[str, Header(description="`text/csv` returns the columns as CSV with NaN; otherwise JSON with null.")]

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


def wants_csv(accept: str) -> bool:
    """Whether an Accept header prefers text/csv to JSON."""
    weights = {"text/csv": 0.0, "application/json": 0.0, "application/*": 0.0, "*/*": 0.0}
    for part in accept.split(","):
        media_type, *parameters = (piece.strip() for piece in part.lower().split(";"))
        weight = next((value[2:] for value in parameters if value.startswith("q=")), "1")
        if media_type in weights:
            weights[media_type] = float(weight) if weight.replace(".", "", 1).isdecimal() else 0.0
    csv_weight = weights.pop("text/csv")
    return csv_weight > 0 and csv_weight >= max(weights.values())


def respond(answer: Columns, accept: str, *, one: bool = False) -> Response:
    """The answer in the form that the client asked for; beside CSV, model and table travel as headers."""
    if not wants_csv(accept):
        return Response(answer.json_of_one() if one else answer.json(), media_type="application/json")
    table = {} if answer.table_sha256 is None else {"Underskin-Table-SHA256": answer.table_sha256}
    return Response(answer.csv(), media_type="text/csv", headers={"Underskin-Model": answer.model, **table})
