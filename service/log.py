"""The log: one JSON object a line on stderr."""

import logging
import os
import sys
from contextlib import suppress
from datetime import UTC, datetime
from typing import Any

import orjson

from service.keys import Key


class JsonFormatter(logging.Formatter):
    """A log record as one line of JSON; values given in `extra={"fields": {...}}` are put beside the message."""

    def format(self, record: logging.LogRecord) -> str:
        """The line."""
        fields: dict[str, Any] = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
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
    """One line a request, written directly: the logging module would cost as much as answering."""
    line = orjson.dumps(
        {
            "time": datetime.now(UTC).isoformat(timespec="milliseconds"),
            "level": "info",
            "logger": "underskin.request",
            "message": f"{method} {path[:200]} {status}",
            "request_id": request_id,
            "method": method,
            "path": path[:200],
            "status": status,
            "milliseconds": round(1e3 * seconds, 3),
            "key": key.name if key else None,
        },
        option=orjson.OPT_APPEND_NEWLINE,
    )
    with suppress(OSError):  # a log that nobody reads, or a full disk, must not stop the answers
        os.write(2, line)
