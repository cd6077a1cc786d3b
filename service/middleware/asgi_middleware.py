"""The outermost layer, plain ASGI: access control, request id, body limit, metrics and log of every request.

It also answers the two requests that clients send one by one in great number before FastAPI's layers, which would take
longer than the answer. Such a hot route handles only the plain case; everything else goes to the API route of the same
path, which defines what is valid and the errors.
"""

import itertools
import os
import re
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager

from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.auth.access_control import OPEN, AccessControl, goes_to_disk
from service.log import KEY, logger
from service.middleware.error_handlers import ProblemPage, problem_response
from service.middleware.http_protocol import OVERLOADED
from service.middleware.request_log import Answered, record
from service.problems import RETRY_LATER, Refusal, unexpected

_SHORT_BYTES = 1_000_000  # of each body that are not counted
WITHOUT_CONTENT = "without_content"  # in the scope of a request (HEAD) of whose answer only the headers are sent
_NUMBERS = frozenset({int, float})
_LONGEST_HELD = 8  # bodies as large as they may be that are held at once
_MOST_HOT_BYTES = 10_000  # of a body that a hot route looks at, on the event loop
_SANE_ID = re.compile(rb"[A-Za-z0-9._-]{1,64}")

# Answers a query string (GET) or a body (POST) with JSON, or with None to leave it to the API.
HotRoute = Callable[[bytes], bytes | None]


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


def are_numbers(values: Iterable[object]) -> bool:
    """Whether all are JSON numbers; everything else is left to the API."""
    return _NUMBERS.issuperset(map(type, values))


class AsgiMiddleware:
    """The layer in front of the API; one per process."""

    def __init__(
        self, api: ASGIApp, access: AccessControl, hot: Mapping[tuple[str, str], HotRoute], problem_page: ProblemPage
    ) -> None:
        """`hot` is by method and path; `problem_page` shows an error to who looks at pages."""
        self._api = api
        self._access = access
        self._problem_page = problem_page
        self._hot = hot
        self._held = HeldBodies(_LONGEST_HELD * access.max_body_bytes)
        self._prefix = os.urandom(6).hex()
        self._numbers = itertools.count()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request."""
        if scope["type"] != "http":
            await self._api(scope, receive, send)
            return
        start = time.perf_counter()
        headers: dict[bytes, bytes] = dict(scope["headers"])
        request_id = self._request_id(headers.get(b"x-request-id"))
        scope["request_id"] = request_id
        scope["key"] = None
        scope["why"] = None
        exchange = _Exchange(send, request_id)
        try:
            await self._answer(scope, headers, receive, exchange)
        except Refusal as refusal:
            scope["why"] = refusal.in_log()
            await problem_response(scope, refusal, self._problem_page)(scope, receive, exchange.send)
        except ClientDisconnect:
            exchange.status = 499
            scope["why"] = "the client left"
        except Exception:
            logger.exception("request failed", extra={"fields": {"request_id": request_id}})
            if not exchange.status:
                await problem_response(scope, unexpected(), self._problem_page)(scope, receive, exchange.send)
        seconds = time.perf_counter() - start
        method, path, key, why = scope["method"], scope["path"], scope["key"], scope["why"]
        route = path if exchange.hot else getattr(scope.get("route"), "path", "none")
        record(Answered(time.time(), request_id, method, route, path, exchange.status, seconds, key, why))

    def _request_id(self, sent: bytes | None) -> str:
        if sent is not None and _SANE_ID.fullmatch(sent) and not KEY.search(sent.decode()):
            return sent.decode()
        return f"{self._prefix}-{next(self._numbers):x}"

    async def _answer(
        self, scope: Scope, headers: Mapping[bytes, bytes], receive: Receive, exchange: "_Exchange"
    ) -> None:
        """Check access, then a hot route or the API."""
        method, path = scope["method"], scope["path"]
        if scope.get(OVERLOADED) and path not in OPEN:
            busy = "Too many connections are open (UNDERSKIN_MAX_CONNECTIONS); try again in a while."
            raise Refusal(503, busy, headers={**RETRY_LATER, "Connection": "close"})
        if [name for name, _ in scope["headers"]].count(b"host") > 1:  # a proxy may have checked the other one
            raise Refusal(400, "The request has several Host headers; it must have one.")
        scope["key"] = self._access.check(method, path, headers, scope["query_string"])
        with self._held.one() as hold:
            await self._answer_body(scope, headers, self._limited(receive, path, headers, hold), exchange)

    async def _answer_body(
        self, scope: Scope, headers: Mapping[bytes, bytes], receive: Receive, exchange: "_Exchange"
    ) -> None:
        method = scope["method"]
        hot = self._hot.get((method, scope["path"]))
        if method == "HEAD":
            # A copy: by `scope` the server knows that it sends no body.
            as_get = {**scope, "method": "GET", WITHOUT_CONTENT: True}
            await self._api(as_get, receive, exchange.send)
            scope["route"] = as_get.get("route")
            return
        if hot is None or not _plain(method, headers):
            await self._api(scope, receive, exchange.send)
            return
        if method == "POST":
            message = await receive()
            sent = message.get("body", b"")
            is_short = not message.get("more_body", False) and len(sent) <= _MOST_HOT_BYTES
            receive = _replay(message, receive)
        else:
            sent, is_short = scope["query_string"], True
        content = hot(sent) if is_short else None
        if content is None:
            await self._api(scope, receive, exchange.send)
        else:
            await exchange.answer(content)

    def _limited(
        self, receive: Receive, path: str, headers: Mapping[bytes, bytes], hold: Callable[[int], None]
    ) -> Receive:
        """`receive` that rejects the body once it exceeds the limit, whatever its Content-Length said."""
        size = 0

        async def counted() -> Message:
            nonlocal size
            message = await receive()
            size += len(message.get("body", b""))
            self._access.check_size(size, path, headers)
            if not goes_to_disk(path):
                hold(size)
            return message

        return counted


class _Exchange:
    """The answer in progress: adds the request id and records the status."""

    def __init__(self, send: Send, request_id: str) -> None:
        self._send = send
        self._request_id = request_id.encode()
        self.status = 0
        self.hot = False

    async def send(self, message: Message) -> None:
        """What the API sends."""
        if message["type"] == "http.response.start":
            self.status = message["status"]
            message["headers"] = [*message.get("headers", ()), (b"x-request-id", self._request_id)]
        await self._send(message)

    async def answer(self, content: bytes) -> None:
        """A hot route's JSON."""
        self.hot = True
        headers = [(b"content-type", b"application/json"), (b"content-length", b"%d" % len(content))]
        await self.send({"type": "http.response.start", "status": 200, "headers": headers})
        await self.send({"type": "http.response.body", "body": content})


def _plain(method: str, headers: Mapping[bytes, bytes]) -> bool:
    """Whether JSON is requested and, if there is a body, sent."""
    accept = headers.get(b"accept", b"").lower()
    if b"csv" in accept or b"npz" in accept:
        return False
    return method == "GET" or headers.get(b"content-type", b"").split(b";")[0].strip().lower() == b"application/json"


def _replay(message: Message, receive: Receive) -> Receive:
    """A message that was received already, followed by the remaining ones."""
    pending = True

    async def replayed() -> Message:
        nonlocal pending
        if pending:
            pending = False
            return message
        return await receive()

    return replayed
