"""Answers that take long to compute: a few at a time, the others wait in turn without a thread."""

import asyncio
from collections.abc import Callable
from typing import TypeVar

_AT_ONCE = asyncio.Semaphore(4)

_Answer = TypeVar("_Answer")


async def in_turn(work: Callable[[], _Answer]) -> _Answer:
    """What `work` answers, in a thread beside the event loop."""
    async with _AT_ONCE:
        return await asyncio.to_thread(work)
