"""What fails again and again while its cause lasts is logged once."""

import logging
import threading


class LastingFailure:
    """The failures of several threads that have one cause, such as a store that does not answer."""

    def __init__(self, logger: logging.Logger) -> None:
        self._logger = logger
        self._lock = threading.Lock()
        self._logged: set[tuple[str, type[Exception]]] = set()

    def log(self, what: str, error: Exception) -> None:
        """Warn, unless an error of this kind kept from the same since the last success."""
        kind = (what, type(error))
        with self._lock:
            known = kind in self._logged
            self._logged.add(kind)
        if not known:
            self._logger.warning("%s: %s", what, error)

    def is_over(self) -> None:
        """Say that it works again, where it had failed."""
        with self._lock:
            failed = bool(self._logged)
            self._logged.clear()
        if failed:
            self._logger.info("the store answers again")
