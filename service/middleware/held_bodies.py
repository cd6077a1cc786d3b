"""Memory for the bodies of current requests: short ones are free, the others share a total limit."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from service.problems import RETRY_LATER, Refusal

_SHORT_BYTES = 1_000_000  # of each body that are not counted


class HeldBodies:
    """Total bytes of the bodies held in memory; uploads go to disk and do not count."""

    def __init__(self, most_bytes: int) -> None:
        """None yet."""
        self._most_bytes = most_bytes
        self._bytes = 0

    @contextmanager
    def one(self) -> Iterator[Callable[[int], None]]:
        """Context of one request: a function to be called with the number of bytes received so far. It raises
        Refusal 503 if there is no room for them."""
        counted = 0

        def hold(size: int) -> None:
            nonlocal counted
            self._bytes -= counted
            counted = max(0, size - _SHORT_BYTES)
            self._bytes += counted
            if counted and self._bytes > self._most_bytes:
                raise Refusal(503, "Other large bodies are under way; try again in a while.", headers=RETRY_LATER)

        try:
            yield hold
        finally:
            self._bytes -= counted
