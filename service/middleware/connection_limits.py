"""What a connection may take: bytes of headers, time without progress, and how many there may be at once."""

import logging
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal, Protocol

from prometheus_client import Counter

logger = logging.getLogger("underskin")

Limit = Literal["header_size", "idle_headers", "idle_body", "idle_answer", "connections"]

SPARE = 32  # connections beyond the limit, on which `/health` is answered still
_FILES = 96  # descriptors of the process that are for files, the store and other processes
_FEWEST = 8
_LOG_EVERY_S = 10.0
_LEAST_BODY_BYTES = 10_000  # that a body brings in the time after which a connection is idle, unless it ends
_BODY_WAIT_S = 1.0  # without data, after which a body gives way to a new connection

_reached = Counter(
    "underskin_limits_reached", "Connections that reached a limit (docs/settings.md), by limit", ["limit"]
)


class Connection(Protocol):
    """What is known of a connection here."""

    def waits_for_client_s(self) -> float | None:
        """Seconds since the client sent something, while it is the client's turn; None while it is the server's."""

    def sends_body(self) -> bool:
        """Whether a body is under way."""

    def give_way(self) -> None:
        """Close it, since others need its place."""


@dataclass(eq=False)
class ConnectionLimits:
    """The limits of a server; each one that is reached is counted, and logged at most every ten seconds."""

    head_bytes: int
    idle_s: float
    connections: int
    watched: bool = False  # whether connections are looked at every now and then
    _logged: dict[Limit, tuple[float, int]] = field(default_factory=dict)

    def within(self, descriptors: int) -> "ConnectionLimits":
        """The same with no more connections than a process of so many descriptors can have."""
        most = max(_FEWEST, descriptors - _FILES - SPARE)
        return ConnectionLimits(self.head_bytes, self.idle_s, min(self.connections, most))

    def is_body_too_slow(self, received: int) -> bool:
        """Whether so many bytes of a body are too few for the time after which a connection is idle."""
        return received < _LEAST_BODY_BYTES

    def make_room(self, connections: Iterable[Connection], *, urgently: bool) -> bool:
        """Close the connection that has kept the server waiting for the longest, if any, and say so: one without a
        request before one whose body has stopped, `urgently` for however short a time."""
        waiting = [(one, wait) for one in connections if (wait := one.waits_for_client_s()) is not None]
        idle = [(one, wait) for one, wait in waiting if urgently or wait > _BODY_WAIT_S or not one.sends_body()]
        if not idle:
            return False
        longest, _ = max(idle, key=lambda entry: (not entry[0].sends_body(), entry[1]))
        longest.give_way()
        return True

    def reached(self, limit: Limit, what: str) -> None:
        """Count a connection that reached a limit; `what` is logged, with how many were not."""
        _reached.labels(limit).inc()
        now = time.monotonic()
        last, more = self._logged.get(limit, (-_LOG_EVERY_S, 0))
        if now - last < _LOG_EVERY_S:
            self._logged[limit] = last, more + 1
            return
        self._logged[limit] = now, 0
        logger.warning("%s", what, extra={"fields": {"limit": limit, "more_since_last_line": more}})
