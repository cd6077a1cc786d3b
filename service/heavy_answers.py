"""Answers that take long to compute: a few at a time; the others wait without occupying a thread."""

import asyncio
import functools
from collections.abc import Awaitable, Callable
from typing import ParamSpec, TypeVar

_AT_ONCE = asyncio.Semaphore(4)

_Answer = TypeVar("_Answer")
_Parameters = ParamSpec("_Parameters")


async def in_turn(work: Callable[[], _Answer]) -> _Answer:
    """The result of `work`, computed in a thread outside the event loop."""
    async with _AT_ONCE:
        return await asyncio.to_thread(work)


def computed_in_turn(endpoint: Callable[_Parameters, _Answer]) -> Callable[_Parameters, Awaitable[_Answer]]:
    """An endpoint that answers the same `in_turn`; `inspect.unwrap` gives the endpoint back."""

    @functools.wraps(endpoint)
    async def answer(*arguments: _Parameters.args, **values: _Parameters.kwargs) -> _Answer:
        return await in_turn(functools.partial(endpoint, *arguments, **values))

    return answer
