"""JSON bodies: an object with a repeated key is rejected, because parsers would silently take the last; long ones are
parsed in a separate process, because parsing in this one would block all other requests."""

import asyncio
import sys
import tempfile
from collections.abc import Callable, Coroutine
from typing import Any, BinaryIO

import numpy as np
import orjson
from fastapi import Request, Response
from fastapi.routing import APIRoute
from starlette.concurrency import run_in_threadpool

from service.problems import Refusal, given_twice, require_few_fields
from underskin.errors import FileError
from underskin.recordings.readers.json_file import repeated_key
from underskin.recordings.readers.parsing_limits import ParsingLimits
from underskin.recordings.readers.sandbox import call_apart

LONG_BYTES = 1_000_000  # beyond which a body is parsed apart: up to here it takes some hundredths of a second
_MOST_NUMBERS = 2_000_000  # in one list of a body: its answer takes many times the memory of a column
_READER = "underskin.recordings.readers.long_json:read"
_MOST_PLAIN_BYTES = 12_000_000  # besides long lists of numbers: this part goes through this process's parser
_MEMORY_TIMES, _LEAST_MEMORY_BYTES = 5, 150_000_000  # of the parsing process; the body itself is held here
_long = asyncio.Semaphore(2)  # long bodies that are parsed at once


class NotJson(Exception):
    """Says where a document is no JSON, and why."""


def document_of(body: bytes) -> Any:
    """The content of a JSON body, long lists of numbers as arrays; raises as `read`, and 413 for a list that is too
    long."""
    with tempfile.TemporaryFile() as stream:
        stream.write(body)
        stream.flush()
        return read(stream, _MOST_NUMBERS)


def read(stream: BinaryIO, most_numbers: int = sys.maxsize) -> Any:
    """The content of an open JSON file, long lists of numbers as arrays; each may have `most_numbers`.

    Raises NotJson, Refusal 422 for a repeated key, and 413 if it takes too much memory or time.
    """
    size = stream.seek(0, 2)
    memory_bytes = max(_LEAST_MEMORY_BYTES, _MEMORY_TIMES * size)
    limits = ParsingLimits(memory_bytes, ParsingLimits.from_environment().seconds)
    try:
        most = str(_MOST_PLAIN_BYTES), str(most_numbers)
        value = call_apart(_READER, stream, "body", *most, what="JSON", limits=limits)
    except FileError as error:
        raise _too_large(f"cannot be read: {error.reason}") from None
    if "plain" in value:
        raise _too_large(
            f"has {value['plain'] / 1e6:.1f} MB besides long lists of numbers; {_MOST_PLAIN_BYTES / 1e6:g} MB may be"
        )
    if "numbers" in value:
        raise _too_large(f"has a list of {value['numbers']:,} numbers; {most_numbers:,} may be in one")
    if "invalid" in value:
        line, column, wrong = value["invalid"]
        raise NotJson(f"line {line}, column {column}: {wrong}")
    if "repeated" in value:
        raise given_twice(*value["repeated"])
    return value["document"]


def as_lists(value: Any) -> Any:
    """The same with lists in place of arrays."""
    if isinstance(value, dict):
        return {name: as_lists(item) for name, item in value.items()}
    if isinstance(value, list):
        return [as_lists(item) for item in value]
    return value.tolist() if isinstance(value, np.ndarray) else value


def _too_large(reason: str) -> Refusal:
    return Refusal(413, f"The body {reason}; send less at once.", title="Body too large")


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
