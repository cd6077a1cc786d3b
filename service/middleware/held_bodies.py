"""Memory of the bodies of requests under way: short ones, and of the others no more than so much in all."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from service.problems import RETRY_LATER, Refusal

_SHORT_BYTES = 1_000_000  # of each body that are not counted


class HeldBodies:
    """Bytes of all bodies that are held; those of uploads go to the disk and are none."""

    def __init__(self, most_bytes: int) -> None:
        """None yet."""
        self._most_bytes = most_bytes
        self._bytes = 0

    @contextmanager
    def one(self) -> Iterator[Callable[[int], None]]:
        """One of them while its request is under way: to be told how many bytes it has by now. That raises Refusal 503
        where there is no room for them.
        """
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
