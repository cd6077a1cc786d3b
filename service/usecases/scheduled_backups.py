"""Backups on a schedule, while the server answers: written, read back, and the oldest deleted.

The time of the next backup is read from the folder itself, so a restart neither skips nor repeats one. Of several
servers that share a database and a folder one makes it, holding a lock on the folder. A folder belongs to one store,
named by a file in it; servers of other stores make none there. Nothing is deleted while the newest backup is far
smaller than the largest, as when a server was started on an empty data folder. If a folder that held backups is empty
or gone, its disk is missing: none is made in its place, also after a restart, because the data folder notes it.
"""

import fcntl
import math
import os
import re
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from prometheus_client import Counter, Gauge

from service import durable
from service.log import first_line, logger
from service.store import Database, StorageFailed, StoreError, backup, identity
from service.usecases import mechanisms

_PREFIX, _STAMP = "underskin-", "%Y%m%dT%H%M%SZ"
_NAME = re.compile(rf"{_PREFIX}(\d{{8}}T\d{{6}}Z)\.(?:sqlite3|pgdump)")
SKEW_S = 60.0  # by which clocks of machines that share a folder may differ
_SMALLER = 0.5  # of the largest one's bytes: below, it is another store, or most of it is gone
_LOCK = ".underskin-backup-lock"
OWNER = ".underskin-backups-of"  # holds the identity of the store whose folder it is
_NOTE = "scheduled-backups-in"  # of the data folder: holds the address of the folder that they were last made in
_LOOK_S = 60.0  # how often the folder is looked into
_RETRY_S = 600.0  # after a failure
_JOIN_S = 30.0
_HOUR_S = 3600.0

_AGE = Gauge(
    "underskin_backup_age_seconds",
    "Age of the newest scheduled backup; +Inf where there is none, NaN where the server makes none.",
)
_AGE.set(float("nan"))
_BYTES = Gauge("underskin_backup_bytes", "Size of the newest scheduled backup.")
_made = Counter("underskin_backups", "Scheduled backups that were written and read back.")
_failed = Counter("underskin_backup_failures", "Scheduled backups that failed.")


@dataclass(frozen=True)
class StoredBackup:
    """A scheduled backup in the folder."""

    path: Path
    made_at: datetime

    @property
    def age_s(self) -> float:
        """Seconds since it was made, by this machine's clock; negative if one of the clocks was wrong."""
        return (datetime.now(UTC) - self.made_at).total_seconds()


def stored_backups(folder: Path) -> list[StoredBackup]:
    """The scheduled backups in a folder, the newest first; files with other names are ignored."""
    entries = []
    for path in folder.glob(f"{_PREFIX}*"):
        match = _NAME.fullmatch(path.name)
        with suppress(ValueError):  # no such day
            if match is not None:
                entries.append(StoredBackup(path, datetime.strptime(match[1], _STAMP).replace(tzinfo=UTC)))
    return sorted(entries, key=lambda copy: copy.made_at, reverse=True)


def newest(folder: Path) -> StoredBackup | None:
    """The newest one not in the future: a backup dated ahead by a wrong clock makes none superfluous."""
    return next((copy for copy in stored_backups(folder) if copy.age_s > -SKEW_S), None)


def foreign(store: Database, folder: Path) -> str:
    """In words, that a folder holds the backups of another store, or of an unknown one; else empty."""
    try:
        owner = (folder / OWNER).read_text().strip()
    except (FileNotFoundError, NotADirectoryError):
        return ""
    except OSError as error:
        return f"whose backups {folder} holds cannot be read ({OWNER}: {error.strerror})"
    if not owner:
        return ""
    identity_of_store = store.read(identity.find)
    if owner == identity_of_store:
        return ""
    return f"{folder} holds the backups of another store ({owner}; this one is {identity_of_store or 'new'})"


class ScheduledBackups:
    """Makes a backup of a store into `folder` every so many hours and keeps the newest `keep`, between `start` and
    `stop`."""

    def __init__(self, store: Database, folder: Path, every_hours: float, keep: int, data: Path) -> None:
        """`data`: the server's data folder."""
        self._store, self._folder, self._note = store, folder, data / _NOTE
        self._address = folder.absolute().as_uri()
        self._every_s, self._keep = every_hours * _HOUR_S, keep
        self._owned = False  # whether the folder has been seen to be this store's
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="backups", daemon=True)
        self._seen: StoredBackup | None = None
        self._seen_bytes = 0

    @property
    def last(self) -> StoredBackup | None:
        """The newest of this store as of the last check, without waiting for a disk."""
        return self._seen

    @property
    def overdue(self) -> bool:
        """Whether the newest is older than two intervals, or there is none of this store."""
        return self._age_s() > 2 * self._every_s

    def start(self) -> None:
        """Make the first one now if one is due."""
        self._thread.start()

    def stop(self) -> None:
        """Wait for one under way."""
        self._ending.set()
        if self._thread.ident is not None:
            self._thread.join(_JOIN_S)

    def _watch(self) -> None:
        _AGE.set_function(self._age_s)
        _BYTES.set_function(self._size)
        wait = 0.0
        while not self._ending.wait(wait):
            try:
                self._see()
                self._make_if_due()
                self._see()
                wait = min(_LOOK_S, self._every_s / 10)
            except Exception as error:  # the thread has no caller to raise to, and must go on
                _failed.inc()
                logger.warning("no scheduled backup could be made in %s: %s", self._folder, first_line(error))
                wait = min(_RETRY_S, self._every_s / 10)

    def _see(self) -> None:
        """Cache the values of `/metrics` on the newest, so that they wait for no disk or database."""
        last = self._newest()
        self._seen_bytes = 0 if last is None else last.path.stat().st_size
        self._seen = last

    def _make_if_due(self) -> None:
        if not self._owned and not self._is_noted():
            durable.make_folder(self._folder, 0o700)
        elif not (self._folder / OWNER).exists():
            raise StoreError(
                f"the folder is empty or gone, and held backups before ({OWNER}): is its disk mounted? "
                f"To begin anew there, delete {self._note} and restart the server"
            )
        with _locked(self._folder) as ours:
            last = newest(self._folder)
            if not ours:
                return
            self._claim_folder()
            if last is not None and last.age_s < self._every_s:
                return
            for leftover in self._folder.glob(f"{_PREFIX}*.part*"):  # of a server that ended half way
                leftover.unlink()
            started = time.monotonic()
            suffix = ".sqlite3" if self._store.is_sqlite else ".pgdump"
            file = self._folder / f"{_PREFIX}{datetime.now(UTC):{_STAMP}}{suffix}"
            try:
                self._store.write(mechanisms.remember_files)
            except StorageFailed as error:  # an unwritable disk here must not prevent a backup elsewhere
                logger.warning("mechanisms of the lab's own are in the backup as they were at the last one: %s", error)
            backup.make(self._store, file)
            self._rotate(file.stat().st_size)
            durable.keep_entries(self._folder)
        _made.inc()
        fields = {"file": str(file), "bytes": file.stat().st_size, "seconds": round(time.monotonic() - started, 1)}
        logger.info("backup made and read back", extra={"fields": fields})

    def _claim_folder(self) -> None:
        """Note whose folder this is; raises StoreError where it is another store's."""
        if words := foreign(self._store, self._folder):
            raise StoreError(f"{words}; give each store a folder of its own (UNDERSKIN_BACKUP_TO)")
        owner = self._folder / OWNER
        if not owner.exists() or not owner.read_text().strip():  # one that ran into a full disk is empty
            durable.write_text(owner, self._store.read(identity.find) or self._store.write(identity.ensure))
        self._owned = True
        if not self._is_noted():
            with suppress(OSError):  # an unwritable disk here must not prevent a backup elsewhere
                durable.write_text(self._note, self._address)

    def _is_noted(self) -> bool:
        """Whether this server, or one before it, has made backups in the folder."""
        with suppress(OSError, UnicodeDecodeError):
            return self._note.read_text() == self._address
        return False

    def _newest(self) -> StoredBackup | None:
        """The newest one of this store."""
        return None if foreign(self._store, self._folder) else newest(self._folder)

    def _rotate(self, size: int) -> None:
        """Delete the oldest, unless the one just made, of so many bytes, is far smaller than the largest."""
        entries = [copy for copy in stored_backups(self._folder) if copy.age_s > -SKEW_S]
        largest = max(copy.path.stat().st_size for copy in entries)
        if size < _SMALLER * largest:
            logger.warning(
                "the backup just made has %d bytes, an earlier one %d: no old ones are deleted until this is looked at",
                size, largest,
            )  # fmt: skip
            return
        for old in entries[self._keep :]:
            old.path.unlink()

    def _age_s(self) -> float:
        return math.inf if self._seen is None else self._seen.age_s

    def _size(self) -> float:
        return self._seen_bytes


@contextmanager
def _locked(folder: Path) -> Iterator[bool]:
    """Whether this process has the folder to itself; the lock ends with the process, however that ends."""
    descriptor = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            yield False
        else:
            yield True
    finally:
        os.close(descriptor)
