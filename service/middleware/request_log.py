"""A line in the log and an observation in the metrics for each request."""

import asyncio
import os
from contextlib import suppress
from datetime import UTC, datetime
from functools import cache
from typing import NamedTuple

import orjson
from prometheus_client import Histogram

from service.auth.keys import Key
from service.log import without_keys

# Requests are written and counted together: one by one, that would cost as much as to answer them.
_DELAY_S = 0.2

_LONGEST_WHY = 300

_seconds = Histogram(
    "underskin_request_seconds",
    "Time to answer a request, by route as documented, method and status",
    ["method", "route", "status"],
    buckets=(0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 10.0),
)


class Answered(NamedTuple):
    """A request that was answered; `route` is its path as documented, `why` the reason of an error."""

    ended: float
    request_id: str
    method: str
    route: str
    path: str
    status: int
    seconds: float
    key: Key | None
    why: str | None


_waiting: list[Answered] = []


def record(request: Answered) -> None:
    """Log a request and count it, a moment later."""
    if not _waiting:
        asyncio.get_running_loop().call_later(_DELAY_S, flush)
    _waiting.append(request)


def flush() -> None:
    """Count and write the requests that wait."""
    text = b"".join(map(_line, _waiting))
    for request in _waiting:
        _series(request.method, request.route, request.status).observe(request.seconds)
    _waiting.clear()
    with suppress(OSError):  # an unread log or a full disk must not stop the answers
        while text:
            text = text[os.write(2, text) :]


@cache  # finding the series by its labels takes longer than observing it
def _series(method: str, route: str, status: int) -> Histogram:
    return _seconds.labels(method, route, str(status))


def _line(request: Answered) -> bytes:
    path = without_keys(request.path)[:200]
    fields = {
        "time": datetime.fromtimestamp(request.ended, UTC),
        "level": "info" if request.status < 500 else "warning",
        "logger": "underskin.request",
        "message": f"{request.method} {path} {request.status}",
        "request_id": request.request_id,
        "method": request.method,
        "path": path,
        "route": request.route,
        "status": request.status,
        "milliseconds": round(1e3 * request.seconds, 3),
        "key": request.key.name if request.key else None,
    }
    if request.why is not None:
        fields["error"] = without_keys(request.why)[:_LONGEST_WHY]
    return orjson.dumps(fields, option=orjson.OPT_APPEND_NEWLINE)
