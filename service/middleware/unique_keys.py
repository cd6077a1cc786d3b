"""JSON bodies in which an object has a key twice are refused: the parsers would take the last and say nothing."""

from collections.abc import Callable, Coroutine
from typing import Any

from fastapi import Request, Response
from fastapi.routing import APIRoute

from service.problems import given_twice
from underskin.recordings.readers.repeated_keys import repeated_key


def require_unique_keys(body: bytes) -> None:
    """Raises Refusal (422) that names the key, its line and its column; `body` must be valid JSON."""
    if repeated := repeated_key(body):
        raise given_twice(*repeated)


class _JsonRequest(Request):
    async def json(self) -> Any:
        document = await super().json()
        require_unique_keys(await self.body())
        return document


class JsonRoute(APIRoute):
    """A route whose body FastAPI reads."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Have the body read by way of the check."""
        answer = super().get_route_handler()

        async def checked(request: Request) -> Response:
            return await answer(_JsonRequest(request.scope, request.receive))

        return checked
