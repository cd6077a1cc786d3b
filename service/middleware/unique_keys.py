"""Checks of JSON bodies that FastAPI reads: an object with a repeated key is rejected, because parsers would
silently take the last, and a long body is parsed outside the event loop."""

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

import orjson
from fastapi import Request, Response
from fastapi.routing import APIRoute
from starlette.concurrency import run_in_threadpool

from service.middleware.long_json import LONG_BYTES, NotJson, as_lists, document_of
from service.problems import Refusal, given_twice, require_few_fields
from underskin.recordings.readers.json_file import repeated_key

_long = asyncio.Semaphore(2)  # long bodies that are parsed at once


def require_unique_keys(body: bytes) -> None:
    """Raises Refusal (422) that names the key, its line and its column; `body` must be valid JSON."""
    if repeated := repeated_key(body):
        raise given_twice(*repeated)


class _JsonRequest(Request):
    async def json(self) -> Any:
        body = await self.body()
        if len(body) > LONG_BYTES:
            async with _long:
                return await run_in_threadpool(_long_document, body)
        document = orjson.loads(body)  # refuses NaN, and halves of surrogate pairs
        require_unique_keys(body)
        require_few_fields(document)
        return document


def _long_document(body: bytes) -> Any:
    try:
        document = document_of(body)
    except NotJson as error:
        raise Refusal(400, f"The body is not JSON: {error}.") from None
    require_few_fields(document)
    return as_lists(document)


class JsonRoute(APIRoute):
    """A route whose body FastAPI reads."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Have the body read by way of the check."""
        answer = super().get_route_handler()

        async def checked(request: Request) -> Response:
            return await answer(_JsonRequest(request.scope, request.receive))

        return checked
