"""Endpoints that take columns as JSON or CSV and answer in them, and what OpenAPI says of them; bodies of JSON."""

import asyncio
from collections.abc import Callable
from typing import Annotated, Any, TypeVar

import numpy as np
from fastapi import APIRouter, Header, Request, Response
from pydantic_core import from_json

from service.dependencies import StoreToRead, Table
from service.middleware.unique_keys import require_unique_keys
from service.problems import Refusal, validated
from service.schemas.columns import AnswerInColumns, Columns, ColumnsRequest
from service.store import Database
from underskin.errors import ErrorCode, InvalidInput, wrong_type
from underskin.prediction.columns import CsvError, from_csv
from underskin.surrogate.sigma_table import SigmaTable

Accept = Annotated[str, Header(description="`text/csv` returns the columns as CSV with NaN; otherwise JSON with null.")]

# A body up to this size is answered on the event loop (a few ms at most); a larger one in a thread, a few at a time.
_INLINE_BYTES = 1024
_threads = asyncio.Semaphore(4)

_Kind = TypeVar("_Kind", bound=ColumnsRequest)


def add_columns_route(
    router: APIRouter,
    path: str,
    summary: str,
    kind: type[_Kind],
    example: dict[str, Any],
    answer: Callable[[SigmaTable, Database, _Kind], Columns],
    answer_kind: type[AnswerInColumns],
) -> None:
    """An endpoint that reads a request in columns, answers it and writes it as the client accepts it."""

    async def endpoint(
        request: Request, table: Table, store: StoreToRead, accept: Accept = "application/json"
    ) -> Response:
        """In columns: a list has an entry a row, a single number holds for all rows. Accept: text/csv gives CSV."""
        body = await request.body()
        content_type = request.headers.get("content-type", "")

        def work() -> Response:
            with np.errstate(all="ignore"):  # what overflows is answered as out of the domain
                return respond(answer(table, store, parse(kind, body, content_type)), accept)

        if len(body) <= _INLINE_BYTES and b"adopted" not in body:  # that model is in the store
            return work()
        return await _in_thread(work)

    csv_body = {"schema": {"type": "string"}, "example": _as_csv(example)}
    router.post(
        path,
        operation_id=f"{path[1:]}_columns",
        tags=[path[1:]],
        summary=summary,
        responses={200: {"model": answer_kind, "content": {"text/csv": {}}}},
        openapi_extra=described_body(kind.model_json_schema(), example, **{"text/csv": csv_body}),
    )(endpoint)


async def answer_json(request: Request, answer: Callable[[Any], Response]) -> Response:
    """What is answered to the document in a JSON body, beside the event loop."""
    body = await request.body()

    def work() -> Response:
        with np.errstate(all="ignore"):  # what overflows is answered as out of the domain
            return answer(json_document(body, request.headers.get("content-type", "")))

    return await _in_thread(work)


async def _in_thread(work: Callable[[], Response]) -> Response:
    """What `work` answers, which may take long: a few at a time, beside the event loop."""
    async with _threads:
        return await asyncio.to_thread(work)


def described_body(schema: dict[str, Any], example: dict[str, Any], **others: dict[str, Any]) -> dict[str, Any]:
    """OpenAPI's description of a JSON body that a route reads itself; `others`: by media type."""
    return {
        "requestBody": {
            "required": True,
            "content": {"application/json": {"schema": schema, "example": example}, **others},
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


def parse(kind: type[_Kind], body: bytes, content_type: str) -> _Kind:
    """The request in `body`; raises Refusal 400 (unreadable), 415 (another type) or 422 (a field is wrong)."""
    fields = (
        _from_csv(kind, body)
        if _media_type(content_type) == "text/csv"
        else json_document(body, content_type, " or text/csv")
    )
    return validated(kind, fields)


def json_document(body: bytes, content_type: str, also: str = "") -> Any:
    """What a JSON body holds; raises Refusal 400 (unreadable), 422 (a key comes twice) or 415 (another type).

    `also` says what else is read.
    """
    media_type = _media_type(content_type)
    if media_type not in ("", "application/json"):
        raise Refusal(415, f"Content-Type {media_type!r} cannot be read; send application/json{also}.")
    try:
        document = from_json(body)  # reads NaN too, so that it is refused by field and row
    except ValueError as error:
        raise Refusal(400, f"The body is not JSON: {error}.") from None
    require_unique_keys(body)
    return document


def _media_type(content_type: str) -> str:
    return content_type.split(";", 1)[0].strip().lower()


def _from_csv(kind: type[ColumnsRequest], body: bytes) -> dict[str, Any]:
    try:
        columns = from_csv(body.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise Refusal(400, f"The body is not CSV in UTF-8: {error}.") from None
    except CsvError as error:
        raise Refusal(400, f"The CSV of the body {error}.") from None
    return {name: _cells(kind, name, cells) for name, cells in columns.items()}


def _cells(kind: type[ColumnsRequest], name: str, cells: list[str]) -> Any:
    if name in kind.json_only:
        raise wrong_type(name, cells[0], "cannot be sent as CSV; send application/json")
    if name in kind.constants:
        return _constant(name, cells)
    numbers = []
    for row, cell in enumerate(cells):
        try:
            numbers.append(float(cell))
        except ValueError:
            raise wrong_type(name, cell, index=row) from None
    return numbers


def _constant(name: str, cells: list[str]) -> str | bool:
    for row, cell in enumerate(cells):
        if cell != cells[0]:
            raise InvalidInput(
                name, cell, f"must be the same in every row ({cells[0]!r})", row, code=ErrorCode.CONFLICTING
            )
    return {"true": True, "false": False}.get(cells[0].lower(), cells[0])
