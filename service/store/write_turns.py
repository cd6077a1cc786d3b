"""Who may write: one at a time to an SQLite file, and never so many waiting that readers find no thread to answer."""

import fcntl
import sqlite3
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from sqlalchemy.exc import OperationalError

WAIT_S = 20.0  # for others' writes, a restore included; then the client is asked to come again
MOST_WAITING = 64  # of the threads of a process (`THREADS`)
THREADS = 2 * MOST_WAITING  # that answer requests
FOR_A_PLACE_S = 1.0  # a burst of more writes passes within that, while nobody holds the lock
_LOOK_S = 0.005  # how often another process' lock is looked at


class WriteTurns:
    """Turns of the writers of one process."""

    def __init__(self) -> None:
        """Nobody writes yet."""
        self._places = threading.BoundedSemaphore(MOST_WAITING)
        self._first = threading.Lock()

    @contextmanager
    def place(self) -> Iterator[None]:
        """A place among those that write or wait for a turn; raises OperationalError where none gets free soon."""
        if not self._places.acquire(timeout=FOR_A_PLACE_S):
            raise _busy()
        try:
            yield
        finally:
            self._places.release()

    @contextmanager
    def sole(self, lock_file: Path) -> Iterator[None]:
        """The only writer of all processes, by a lock on a file; raises OperationalError where it takes too long."""
        ends = time.monotonic() + WAIT_S
        if not self._first.acquire(timeout=WAIT_S):  # of this process, so that one at a time looks at the file
            raise _busy()
        try:
            with lock_file.open("a") as lock:
                while not _taken(lock):
                    if time.monotonic() > ends:
                        raise _busy()
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


def _busy() -> OperationalError:
    """What SQLite itself says of a lock that it does not get in time."""
    return OperationalError("a turn to write", {}, sqlite3.OperationalError("database is locked"))
