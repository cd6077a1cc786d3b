"""Turns of writers: one at a time for an SQLite file, and never so many waiting that readers find no free thread."""

import fcntl
import math
import sqlite3
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from sqlalchemy.exc import OperationalError

WAIT_S = 20.0  # for others' writes, a restore included; then the client is asked to come again
SOON_S = 1.0  # the same for data that can be made again and need not be stored now
MOST_WAITING = 64  # of the threads of a process (`THREADS`)
THREADS = 2 * MOST_WAITING  # that answer requests
SLOT_WAIT_S = 1.0  # a burst of more writes passes within that, while nobody holds the lock
VAIN_S = 5.0  # for so long after a wait in vain nothing begins that takes long before it writes
_LOOK_S = 0.005  # how often another process' lock is looked at


class WriteTurns:
    """Turns of the writers of one process."""

    def __init__(self) -> None:
        """Nobody writes yet."""
        self._places = threading.BoundedSemaphore(MOST_WAITING)
        self._first = threading.Lock()
        self._in_vain_at = self._not_soon_at = -math.inf

    def note(self, *, in_vain: bool, soon: bool = False) -> None:
        """Record that somebody has waited in vain, for long or only `soon`, or has written."""
        self._not_soon_at = time.monotonic() if in_vain else -math.inf
        if not soon or not in_vain:
            self._in_vain_at = self._not_soon_at

    def require_hope(self, *, soon: bool) -> None:
        """Raises OperationalError if somebody has just waited in vain and nobody has written since; `soon`: however
        long they waited."""
        if time.monotonic() - (self._not_soon_at if soon else self._in_vain_at) < VAIN_S:
            raise busy("a turn to write")

    @contextmanager
    def slot(self) -> Iterator[None]:
        """A place among those that write or wait for a turn; raises OperationalError if none becomes free soon."""
        if not self._places.acquire(timeout=SLOT_WAIT_S):
            raise busy("a turn to write")
        try:
            yield
        finally:
            self._places.release()

    @contextmanager
    def sole(self, lock_file: Path, wait_s: float) -> Iterator[None]:
        """The only writer of all processes, by a lock on a file; raises OperationalError if that takes too long."""
        ends = time.monotonic() + wait_s
        if not self._first.acquire(timeout=wait_s):  # of this process, so that one at a time looks at the file
            raise busy("a turn to write")
        try:
            with lock_file.open("a") as lock:
                while not _taken(lock):
                    if time.monotonic() > ends:
                        raise busy("a turn to write")
                    time.sleep(_LOOK_S)
                yield
        finally:
            self._first.release()


def _taken(lock: IO[str]) -> bool:
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def busy(awaited: str) -> OperationalError:
    """SQLite's own error for a lock that is not available in time; `awaited`: what was waited for."""
    return OperationalError(awaited, {}, sqlite3.OperationalError("database is locked"))
