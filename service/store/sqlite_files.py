"""The files of an SQLite store: held open, and compared with those on the disk under their names.

A removed or replaced file still accepts writes from processes that have it open, and is lost with them. SQLite does not
check this, so each commit must, and each new connection, which would open or create another file of that name.
"""

import sqlite3
import threading
from pathlib import Path

from service.store.errors import StoreError, StoreMoved
from service.store.write_turns import WAIT_S

_BUSY_S = WAIT_S  # how long a write waits for one of another program, which takes no turn
_SUFFIXES = ("", "-wal", "-shm")  # the database, its write-ahead log, and the log's index

_Identity = tuple[int, int] | None  # device and inode; None where there is no such file


class SqliteFiles:
    """The files of one database as this process first opened them. Thread-safe."""

    def __init__(self, path: Path) -> None:
        """Opens nothing yet."""
        self._path = path.absolute()
        self._lock = threading.Lock()
        # Open as long as others may be: the last one to be closed removes the write-ahead log, and the next one to be
        # opened would make another.
        self._first: sqlite3.Connection | None = None
        self._held: list[_Identity] = []

    def make(self) -> None:
        """Create the empty database if it is missing; raises StoreError if its write-ahead log exists."""
        log = Path(f"{self._path}-wal")
        if self.is_made():
            return
        if log.exists():  # an empty database in the place of the one that it has lost would overwrite it
            raise StoreError(
                f"{self._path} is missing, and its write-ahead log {log.name}, which may hold what was kept last, is "
                f"there: put {self._path.name} back next to it. To start without it, empty or from a backup, move "
                f"{log.name} and {self._path.name}-shm out of {self._path.parent}."
            )
        self._path.touch()

    def is_made(self) -> bool:
        """Whether the database is there."""
        return self._path.exists()

    def connect(self) -> sqlite3.Connection:
        """A connection to the files opened first; raises StoreMoved if the disk has others."""
        with self._lock:
            if self._first is None:
                first = _open(self._path)
                self._held = self._on_disk()
                self._first = first
        self.require_in_place()
        connection = _open(self._path)
        try:
            self.require_in_place()
        except StoreMoved:
            connection.close()
            raise
        return connection

    def require_in_place(self) -> None:
        """Raises StoreMoved if the disk has other files, or none, under the names of the open ones."""
        if self._first is None:
            return
        for suffix, held, there in zip(_SUFFIXES, self._held, self._on_disk(), strict=True):
            if there != held:
                happened = "was removed" if there is None else "was replaced by another file"
                raise StoreMoved(
                    f"{self._path}{suffix} {happened} while the service runs: nothing is kept until the file that was "
                    "there is back. Put it back. Where that cannot be, save what can still be read with `underskin "
                    "export` before the service ends: a restart starts from what is on the disk."
                )

    def close(self) -> None:
        """After all other connections."""
        with self._lock:
            if self._first is not None:
                self._first.close()
                self._first = None

    def _on_disk(self) -> list[_Identity]:
        return [_identity(Path(f"{self._path}{suffix}")) for suffix in _SUFFIXES]


def _identity(file: Path) -> _Identity:
    try:
        status = file.stat()
    except OSError:  # its folder may be gone, or the disk
        return None
    return status.st_dev, status.st_ino


def _open(path: Path) -> sqlite3.Connection:
    """Never creates the file: an empty file in place of a removed one would pass for a store."""
    connection = sqlite3.connect(f"{path.as_uri()}?mode=rw", uri=True, timeout=_BUSY_S, check_same_thread=False)
    connection.isolation_level = None  # we say BEGIN ourselves: Python would say it too late
    for pragma in ("journal_mode = WAL", "synchronous = FULL", "foreign_keys = ON"):
        connection.execute(f"PRAGMA {pragma}")
    connection.execute("SELECT count(*) FROM sqlite_master").fetchall()  # the log is opened with the first read
    # SQLite's own knows the letters of ASCII only.
    connection.create_function("lower", 1, _lower, deterministic=True)
    return connection


def _lower(value: str | None) -> str | None:
    return None if value is None else value.lower()
