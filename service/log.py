"""The log: one JSON object a line on stderr."""

import asyncio
import logging
import os
import sys
import time
from contextlib import suppress
from datetime import UTC, datetime
from typing import Any

import orjson

from service.keys import Key

_DELAY_S = 0.2
_waiting: list[tuple[float, str, str, str, int, float, Key | None]] = []


class JsonFormatter(logging.Formatter):
    """A log record as one line of JSON; values given in `extra={"fields": {...}}` are put beside the message."""

    def format(self, record: logging.LogRecord) -> str:
        """The line."""
        fields: dict[str, Any] = {
            "time": _iso(record.created),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
            **getattr(record, "fields", {}),
        }
        if record.exc_info:
            fields["exception"] = self.formatException(record.exc_info)
        return orjson.dumps(fields).decode()


def configure_logging() -> None:
    """Send all loggers to stderr as JSON, uvicorn's included."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(JsonFormatter())
    logging.basicConfig(level=logging.INFO, handlers=[handler], force=True)


def log_request(request_id: str, method: str, path: str, status: int, seconds: float, key: Key | None) -> None:
    """One line a request, written with others a moment later: to write each alone costs as much as to answer."""
    if not _waiting:
        asyncio.get_running_loop().call_later(_DELAY_S, flush)
    _waiting.append((time.time(), request_id, method, path, status, seconds, key))


def flush() -> None:
    """Write the lines that wait."""
    text = b"".join(_line(*entry) for entry in _waiting)
    _waiting.clear()
    with suppress(OSError):  # a log that nobody reads, or a full disk, must not stop the answers
        while text:
            text = text[os.write(2, text) :]


def _line(ended: float, request_id: str, method: str, path: str, status: int, seconds: float, key: Key | None) -> bytes:
    fields = {
        "time": datetime.fromtimestamp(ended, UTC),
        "level": "info",
        "logger": "underskin.request",
        "message": f"{method} {path[:200]} {status}",
        "request_id": request_id,
        "method": method,
        "path": path[:200],
        "status": status,
        "milliseconds": round(1e3 * seconds, 3),
        "key": key.name if key else None,
    }
    return orjson.dumps(fields, option=orjson.OPT_APPEND_NEWLINE)


def _iso(seconds: float) -> str:
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="milliseconds")
