"""HTTP/1.1 by uvicorn, with limits on the use of memory, time and connections by clients without a key: endless
headers and trailers, pipelined requests, clients that stop sending or reading, and many connections."""

import resource
import time
from collections.abc import Iterable, Sized
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

from prometheus_client import Counter
from starlette.types import ASGIApp, Receive, Scope, Send
from uvicorn.protocols.http.flow_control import FlowControl
from uvicorn.protocols.http.httptools_impl import STATUS_LINE, HttpToolsProtocol

from service.log import logger

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
OVERLOADED = "overloaded"  # in the scope of a request that came on a connection beyond the limit
_MOST_AHEAD = 100  # requests that wait for the answers before theirs
_CHECKS = 8  # of progress, in the time after which a connection is idle
_SELDOMEST_CHECK_S = 1.0


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


class _RefusedError(Exception):
    """A request that is not parsed further; the client has been answered."""


class _Flow(FlowControl):
    """Stops reading while pipelined requests wait for earlier answers."""

    def __init__(self, transport: Any, waiting: Sized) -> None:
        super().__init__(transport)
        self._waiting = waiting

    def resume_reading(self) -> None:
        if not self._waiting:
            super().resume_reading()


class LimitedHttpProtocol(HttpToolsProtocol):
    """One connection; `limits` are set by `limited`."""

    limits: ConnectionLimits

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._head_bytes = 0  # since the last part of a body, or the end of the headers
        self._in_head = True  # from the first byte of a request, or the connection, to the end of the headers
        self._in_body = False
        self._body_bytes = 0  # since `_progress`
        self._progress = self._heard = self.loop.time()
        self._unsent = 0
        self._answered: float | None = None  # time of a request whose body is still coming

    def connection_made(self, transport: Any) -> None:
        """Beyond the limit idle connections are closed, or only `/health` is answered."""
        super().connection_made(transport)
        self.flow = _Flow(transport, self.pipeline)
        if len(self.connections) > self.limits.connections:
            self._find_room()
        if not self.limits.watched:
            self.limits.watched = True
            self._check_all()

    def data_received(self, data: bytes) -> None:
        """What the client sent next."""
        self._heard = self.loop.time()
        if not self._in_head and not self._in_body:
            self._in_head, self._progress = True, self._heard
        self._head_bytes += len(data)
        super().data_received(data)
        if self._head_bytes > self.limits.head_bytes:
            self._refuse_head()

    def on_headers_complete(self) -> None:
        """A body, or the next request, follows."""
        if len(self.url) + sum(len(name) + len(value) + 4 for name, value in self.headers) > self.limits.head_bytes:
            self._refuse_head()
            raise _RefusedError
        if len(self.pipeline) >= _MOST_AHEAD:
            self.limits.reached("pipelining", f"a client sent more than {_MOST_AHEAD} requests ahead: disconnected")
            raise _RefusedError
        self._head_bytes = 0
        self._answered = None
        self._in_head, self._in_body = False, True
        self._progress, self._body_bytes = self._heard, 0
        super().on_headers_complete()

    def on_body(self, body: bytes) -> None:
        """Part of a body; the application counts it."""
        self._head_bytes = 0
        self._body_bytes += len(body)
        super().on_body(body)

    def on_message_complete(self) -> None:
        """It is the server's turn."""
        self._in_body = False
        super().on_message_complete()

    def on_response_complete(self) -> None:
        """The next request's turn, or the client's."""
        if self._in_body and not self.pipeline:
            self._answered = self._progress = self.loop.time()
        super().on_response_complete()

    def send_400_response(self, msg: str) -> None:
        """Reject the request; silently if an answer would interfere with another one."""
        if self.transport.is_closing():
            return
        if self.pipeline or (self.cycle is not None and self.cycle.response_started and not self._is_answered()):
            self.transport.close()
        else:
            super().send_400_response(msg)

    def _refuse_head(self) -> None:
        if not self.transport.is_closing():
            kb = self.limits.head_bytes // 1000
            self.limits.reached("header_size", f"a request's headers exceed {kb} kB (UNDERSKIN_MAX_HEADER_KB)")
            self.send_400_response(f"The request line and headers exceed {kb} kB.")

    def waits_for_client_s(self) -> float | None:
        """As `Connection`."""
        if self.transport.is_closing():
            return None
        now = self.loop.time()
        if self._answered is not None:
            return now - self._answered
        if self.transport.get_write_buffer_size():
            return now - self._progress
        return None if self._is_turn_of_server() else now - self._heard

    def is_served(self) -> bool:
        """As `Connection`."""
        return self._answered is None and (self._in_body or self.transport.get_write_buffer_size() > 0)

    def give_way(self) -> None:
        """As `Connection`."""
        if self.transport.get_write_buffer_size():
            self.transport.abort()
        else:
            self.transport.close()

    def _is_turn_of_server(self) -> bool:
        """Whether a request is being answered, or the server currently does not read more of its body."""
        if self.cycle is None or self._is_answered():
            return False
        return not self._in_body or self.flow.read_paused or self.cycle.waiting_for_100_continue

    def _is_answered(self) -> bool:
        """Whether the last request is."""
        return self.cycle is not None and bool(self.cycle.response_complete)

    def _other_connections(self) -> list["LimitedHttpProtocol"]:
        """The other connections that are open."""
        ours = [protocol for protocol in self.connections if isinstance(protocol, LimitedHttpProtocol)]
        return [protocol for protocol in ours if protocol is not self and not protocol.transport.is_closing()]

    def _find_room(self) -> None:
        """Free a place for this connection, which is one too many unless others are closing."""
        open_protocols, most = self._other_connections(), self.limits.connections
        if len(open_protocols) < most:
            return
        message = f"{most} connections are open (UNDERSKIN_MAX_CONNECTIONS): new ones take the place of idle ones"
        self.limits.reached("connections", message)
        if self.limits.make_room(open_protocols, len(open_protocols) - most + 1, urgently=False):
            return
        still_open = self._other_connections()
        if len(still_open) < most + SPARE or self.limits.make_room(still_open, 1, urgently=True):
            self.app = _overloaded(self.app)
        else:
            self.transport.abort()

    def _check_all(self) -> None:
        for protocol in list(self.connections):
            if isinstance(protocol, LimitedHttpProtocol):
                protocol.check_progress()
        self.loop.call_later(min(_SELDOMEST_CHECK_S, self.limits.idle_s / _CHECKS), self._check_all)

    def check_progress(self) -> None:
        """End the connection where the client has made no progress for too long."""
        now = self.loop.time()
        unsent = self.transport.get_write_buffer_size()
        if unsent != self._unsent or (not unsent and self._is_turn_of_server()):
            self._unsent, self._progress = unsent, now
        if now - self._progress <= self.limits.idle_s:
            return
        if unsent:  # also where it is closing, which waits for that
            self._end("idle_answer", "takes no part of its answer")
        elif self.transport.is_closing():
            return
        elif self._in_head:
            self._end("idle_headers", "does not end its headers")
        elif self._in_body:
            if self._answered is not None:
                self._end("idle_body", "goes on with a body whose request was answered")
            elif self.limits.is_body_too_slow(self._body_bytes):
                self._end("idle_body", "sends next to nothing of its body")
            else:
                self._progress, self._body_bytes = now, 0

    def _end(self, limit: Limit, what: str) -> None:
        self.limits.reached(
            limit, f"a client {what} for {self.limits.idle_s:g} s (UNDERSKIN_IDLE_SECONDS): disconnected"
        )
        if limit == "idle_answer" or (self.cycle is not None and self.cycle.response_started):
            self.transport.abort()
            return
        if self._in_body or self._head_bytes:  # no answer to a client that has sent nothing
            self.transport.write(b"".join((STATUS_LINE[408], b"connection: close\r\ncontent-length: 0\r\n\r\n")))
        self.transport.close()


def limited(limits: ConnectionLimits) -> type[LimitedHttpProtocol]:
    """The protocol of a server with these limits."""
    return type("LimitedHttpProtocol", (LimitedHttpProtocol,), {"limits": limits})


def _overloaded(app: ASGIApp) -> ASGIApp:
    async def marked(scope: Scope, receive: Receive, send: Send) -> None:
        scope[OVERLOADED] = True
        await app(scope, receive, send)

    return marked
