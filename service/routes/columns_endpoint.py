"""Endpoints that take and answer columns as JSON, CSV or .npz, and what OpenAPI says of them; bodies of JSON."""

import asyncio
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Annotated, Any, TypeVar

import numpy as np
from fastapi import APIRouter, Header, Query, Request, Response

from service import heavy_answers
from service.dependencies import StoreToRead, Table
from service.ingest.reading import READING_SLOTS
from service.routes.columns_body import CSV, NPZ, XLSM, XLSX, is_workbook, json_document, parse
from service.schemas.columns import AnswerInColumns, Columns, ColumnsRequest
from service.store import Database
from underskin.surrogate.sigma_table import SigmaTable

Accept = Annotated[
    str,
    Header(
        description="`text/csv` returns the columns as CSV and `application/x-npz` as NumPy's .npz, both with NaN; "
        "otherwise JSON with null."
    ),
]
Sheet = Annotated[
    str | None,
    Query(min_length=1, max_length=200, description="Of a workbook with several sheets: which of them, by its name."),
]
_BINARY = {"schema": {"type": "string", "format": "binary"}}
# Formats of an answer in columns besides JSON, for OpenAPI.
OTHER_ANSWERS: dict[str, Any] = {CSV: {}, NPZ: _BINARY}

NOTES = "Underskin-Notes"
_MOST_NOTES, _LONGEST_NOTE = 10, 120
_NOTES_DESCRIPTION = (
    "Of a CSV or workbook, what was read otherwise than its headings say, such as a diameter that was halved, and what "
    "was left out: a JSON list of sentences. Without it, nothing was."
)
_HEADERS = {NOTES: {"description": _NOTES_DESCRIPTION, "schema": {"type": "string"}}}

# A body up to this size is answered on the event loop (a few ms at most); a larger one in a thread, a few at a time.
_INLINE_BYTES = 1024

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
        request: Request, table: Table, store: StoreToRead, accept: Accept = "application/json", sheet: Sheet = None
    ) -> Response:
        """In columns: a list has an entry a row, a single number holds for all rows. Accept chooses CSV or .npz. A
        sheet of a workbook is read as the CSV that it would be saved as."""
        body = await request.body()
        content_type = request.headers.get("content-type", "")
        most_bytes = request.app.state.access.max_body_bytes

        def work() -> Response:
            with np.errstate(all="ignore"):  # an overflow is answered as out of the domain
                sent, names_sent = parse(kind, body, content_type, most_bytes, sheet)
                columns = answer(table, store, sent)
                if preferred(accept) == CSV:  # CSV rows are returned to their source, with their labels
                    columns = replace(columns, names={**names_sent.labels, **columns.names})
                answered = respond(columns, accept)
                if names_sent.notes:
                    answered.headers[NOTES] = json.dumps(_few(names_sent.notes))
                return answered

        if is_workbook(content_type):
            async with READING_SLOTS:
                return await asyncio.to_thread(work)
        # An adopted model is in the store, the solved contact is tabulated once, and compiled code is loaded once.
        is_short = len(body) <= _INLINE_BYTES and b"adopted" not in body and b"solved" not in body
        if is_short and "underskin.surrogate.spline_kernel" in sys.modules:
            return work()
        return await heavy_answers.in_turn(work)

    others: dict[str, Any] = {CSV: {"schema": {"type": "string"}, "example": _as_csv(example)}}
    others |= dict.fromkeys((NPZ, XLSX, XLSM), _BINARY)
    router.post(
        path,
        operation_id=f"{path[1:]}_columns",
        tags=[path[1:]],
        summary=summary,
        responses={200: {"model": answer_kind, "content": OTHER_ANSWERS, "headers": _HEADERS}},
        openapi_extra=described_body(kind.__name__, example, **others),
    )(endpoint)


def _few(notes: Sequence[str]) -> list[str]:
    """As many notes as a header has room for, and how many more there are."""
    shown = [note[:_LONGEST_NOTE] for note in notes[:_MOST_NOTES]]
    return [*shown, f"and {len(notes) - _MOST_NOTES} more"] if len(notes) > _MOST_NOTES else shown


async def answer_json(request: Request, answer: Callable[[Any], Response]) -> Response:
    """What is answered to the document in a JSON body, beside the event loop."""
    body = await request.body()

    def work() -> Response:
        with np.errstate(all="ignore"):  # an overflow is answered as out of the domain
            return answer(json_document(body, request.headers.get("content-type", "")))

    return await heavy_answers.in_turn(work)


def described_body(component: str, example: dict[str, Any], **others: dict[str, Any]) -> dict[str, Any]:
    """OpenAPI's description of a JSON body that a route reads itself, by its schema's name; `others`: by media type."""
    schema = {"$ref": f"#/components/schemas/{component}"}
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


def preferred(accept: str) -> str:
    """The media type that an Accept header prefers: JSON, unless it gives another at least as much weight."""
    weights = dict.fromkeys((*OTHER_ANSWERS, "application/json", "application/*", "*/*"), 0.0)
    for part in accept.split(","):
        media_type, *parameters = (piece.strip() for piece in part.lower().split(";"))
        weight = next((value[2:] for value in parameters if value.startswith("q=")), "1")
        if media_type in weights:
            weights[media_type] = float(weight) if weight.replace(".", "", 1).isdecimal() else 0.0
    other = max(OTHER_ANSWERS, key=weights.__getitem__)
    return other if 0 < weights[other] == max(weights.values()) else "application/json"


def respond(answer: Columns, accept: str, *, one: bool = False) -> Response:
    """The answer in the form that the client asked for; beside CSV, model, contact and table travel as headers."""
    form = preferred(accept)
    if form == NPZ:
        return Response(answer.npz(), media_type=NPZ)
    if form != CSV:
        return Response(answer.json_of_one() if one else answer.json(), media_type="application/json")
    table = {} if answer.table_sha256 is None else {"Underskin-Table-SHA256": answer.table_sha256}
    contact = {"Underskin-Contact": answer.shared["contact"]} if "contact" in answer.shared else {}
    return Response(answer.csv(), media_type=CSV, headers={"Underskin-Model": answer.model, **contact, **table})
