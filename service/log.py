"""The log: one JSON object per line on stderr, without API keys."""

import logging
import re
import sys
import threading
from datetime import UTC, datetime
from typing import Any

import orjson

logger = logging.getLogger("underskin")
KEY = re.compile(r"us_[\w-]{16,}")  # a text that looks like a key, wherever it is


def without_keys(text: str) -> str:
    """A text with everything that looks like an API key removed."""
    return KEY.sub("us_…", text)


def first_line(reason: object) -> str:
    """The first line of an error's message (database drivers write several); if empty, its class."""
    return next(iter(str(reason).splitlines()), type(reason).__name__)


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
        return without_keys(orjson.dumps(fields).decode())


def configure_logging() -> None:
    """Send all loggers to stderr as JSON, uvicorn's included."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(JsonFormatter())
    logging.basicConfig(level=logging.INFO, handlers=[handler], force=True)


class LastingFailure:
    """Logs a repeating failure once per cause and duration; shared by threads with the same cause, such as a store
    that does not answer."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._logged: set[tuple[str, type[Exception]]] = set()

    def log(self, what: str, error: Exception) -> None:
        """Warn, unless an error of this kind was logged since the last success."""
        kind = (what, type(error))
        with self._lock:
            is_logged = kind in self._logged
            self._logged.add(kind)
        if not is_logged:
            logger.warning("%s: %s", what, error)

    def is_over(self) -> None:
        """Log that it works again if it had failed."""
        with self._lock:
            failed = bool(self._logged)
            self._logged.clear()
        if failed:
            logger.info("the store answers again")
