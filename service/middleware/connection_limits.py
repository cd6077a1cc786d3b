"""Limits of a connection: bytes of headers, time without progress, and how many there may be at once."""

import logging
import resource
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal, Protocol

from prometheus_client import Counter

logger = logging.getLogger("underskin")

Limit = Literal["header_size", "idle_headers", "idle_body", "idle_answer", "connections", "pipelining"]

SPARE = 32  # connections beyond the limit, on which `/health` is answered still
_FILES = 64  # descriptors of the process that are for other files, the store and other processes
_PER_CONNECTION = 2
_FEWEST = 8
_LOG_EVERY_S = 10.0
_LEAST_BODY_BYTES = 10_000  # that a body brings in the time after which a connection is idle, unless it ends
_SERVED_WAIT_S = 1.0  # without data, after which a body or an answer gives way to a new connection

_reached = Counter(
    "underskin_limits_reached", "Connections that reached a limit (docs/settings.md), by limit", ["limit"]
)


class Connection(Protocol):
    """The properties of a connection that the limits use."""

    def waits_for_client_s(self) -> float | None:
        """Seconds since the client sent something, while the server waits for it; None while the client waits."""

    def is_served(self) -> bool:
        """Whether a body or an answer is being transferred."""

    def give_way(self) -> None:
        """Close it to free its place."""


@dataclass(eq=False)
class ConnectionLimits:
    """The limits of a server; each one that is reached is counted, and logged at most every ten seconds."""

    head_bytes: int
    idle_s: float
    connections: int
    watched: bool = False  # whether the progress of connections is checked
    _logged: dict[Limit, tuple[float, int]] = field(default_factory=dict)

    def within_descriptors(self) -> "ConnectionLimits":
        """The same with no more connections than the process has file descriptors for: two each, because uploads are
        written to a file. Raises the process's soft limit if necessary and allowed."""
        needed = _FILES + _PER_CONNECTION * (self.connections + SPARE)
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        allowed, most = (needed if limit == resource.RLIM_INFINITY else limit for limit in (soft, hard))
        if allowed < needed:
            allowed = min(needed, most)
            resource.setrlimit(resource.RLIMIT_NOFILE, (allowed, hard))
        connections = max(_FEWEST, (allowed - _FILES) // _PER_CONNECTION - SPARE)
        return ConnectionLimits(self.head_bytes, self.idle_s, min(self.connections, connections))

    def is_body_too_slow(self, received: int) -> bool:
        """Whether so many bytes of a body are too few for the time after which a connection is idle."""
        return received < _LEAST_BODY_BYTES

    def make_room(self, connections: Iterable[Connection], places: int, *, urgently: bool) -> bool:
        """Close so many of the connections that have kept the server waiting longest, and return whether there were
        as many: first idle or answered ones, then those whose body or answer has stalled; `urgently`: however short
        the wait."""
        waiting = [
            (connection.is_served(), -wait, connection)
            for connection in connections
            if (wait := connection.waits_for_client_s()) is not None
        ]
        waiting.sort(key=lambda candidate: candidate[:2])
        idle = [connection for served, wait, connection in waiting if urgently or not served or -wait > _SERVED_WAIT_S]
        for connection in idle[:places]:
            connection.give_way()
        return len(idle) >= places

    def reached(self, limit: Limit, what: str) -> None:
        """Count a connection that reached a limit; `what` is logged with the number of those not logged."""
        _reached.labels(limit).inc()
        now = time.monotonic()
        last, more = self._logged.get(limit, (-_LOG_EVERY_S, 0))
        if now - last < _LOG_EVERY_S:
            self._logged[limit] = last, more + 1
            return
        self._logged[limit] = now, 0
        logger.warning("%s", what, extra={"fields": {"limit": limit, "more_since_last_line": more}})
