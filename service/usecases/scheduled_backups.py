"""Backups on a schedule: written, read back, and the oldest ones deleted, while the server answers.

When the next one is due is read from the folder itself, so that a restart neither skips one nor makes one too many. Of
several servers that share a database and a folder one makes it: it holds a lock on the folder meanwhile.
"""

import fcntl
import logging
import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from prometheus_client import Counter, Gauge

from service import durable
from service.store import Database, StorageFull, StoreError, backup
from service.usecases import mechanism_files

logger = logging.getLogger("underskin")

_PREFIX = "underskin-"
_LOCK = ".underskin-backup-lock"
_LOOK_S = 60.0  # how often it is looked whether one is due
_RETRY_S = 600.0  # after a failure
_JOIN_S = 30.0
_HOUR_S = 3600.0

_age = Gauge("underskin_backup_age_seconds", "Age of the newest scheduled backup; NaN where there is none.")
_age.set(float("nan"))
_bytes = Gauge("underskin_backup_bytes", "Size of the newest scheduled backup.")
_made = Counter("underskin_backups", "Scheduled backups that were written and read back.")
_failed = Counter("underskin_backup_failures", "Scheduled backups that failed.")


@dataclass(frozen=True)
class Kept:
    """A scheduled backup in the folder."""

    path: Path
    made_at: datetime

    @property
    def age_s(self) -> float:
        """Seconds since it was made, by this machine's clock; 0 for one of the future."""
        return max(0.0, (datetime.now(UTC) - self.made_at).total_seconds())


def kept(folder: Path) -> list[Kept]:
    """The scheduled backups in a folder, the newest first; what bears another name is left alone."""
    found = []
    for path in folder.glob(f"{_PREFIX}*"):
        stamp = path.name.removeprefix(_PREFIX).partition(".")[0]
        try:
            moment = datetime.strptime(stamp, "%Y%m%dT%H%M%SZ").replace(tzinfo=UTC)
        except ValueError:
            continue
        if path.suffix in (".sqlite3", ".pgdump"):
            found.append(Kept(path, moment))
    return sorted(found, key=lambda entry: entry.made_at, reverse=True)


class ScheduledBackups:
    """Makes a backup of a store into `folder` every so many hours and keeps the newest `keep`, between `start` and
    `stop`."""

    def __init__(self, store: Database, folder: Path, every_hours: float, keep: int) -> None:
        self._store, self._folder = store, folder
        self._every_s, self._keep = every_hours * _HOUR_S, keep
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="backups", daemon=True)

    @property
    def folder(self) -> Path:
        """Where they are."""
        return self._folder

    @property
    def overdue(self) -> bool:
        """Whether the newest is older than twice the time between two, or there is none."""
        newest = next(iter(kept(self._folder)), None)
        return newest is None or newest.age_s > 2 * self._every_s

    def start(self) -> None:
        """Make the first one now if one is due."""
        self._thread.start()

    def stop(self) -> None:
        """Wait for one under way."""
        self._ending.set()
        if self._thread.ident is not None:
            self._thread.join(_JOIN_S)

    def _watch(self) -> None:
        wait = 0.0
        while not self._ending.wait(wait):
            try:
                self._make_if_due()
                wait = min(_LOOK_S, self._every_s / 10)
            except (StoreError, OSError) as error:
                _failed.inc()
                logger.warning("no scheduled backup could be made: %s", error)
                wait = min(_RETRY_S, self._every_s / 10)
            self._tell()

    def _make_if_due(self) -> None:
        self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with _locked(self._folder) as ours:
            newest = next(iter(kept(self._folder)), None)
            if not ours or (newest is not None and newest.age_s < self._every_s):
                return
            started = time.monotonic()
            suffix = ".sqlite3" if self._store.is_sqlite else ".pgdump"
            file = self._folder / f"{_PREFIX}{datetime.now(UTC):%Y%m%dT%H%M%SZ}{suffix}"
            try:
                self._store.write(mechanism_files.remember)
            except StorageFull as error:  # a full disk here keeps nobody from a backup elsewhere
                logger.warning("mechanisms of the lab's own are in the backup as they were at the last one: %s", error)
            backup.make(self._store, file)
            for old in kept(self._folder)[self._keep :]:
                old.path.unlink()
            durable.keep_entries(self._folder)
        _made.inc()
        fields = {"file": str(file), "bytes": file.stat().st_size, "seconds": round(time.monotonic() - started, 1)}
        logger.info("backup made and read back", extra={"fields": fields})

    def _tell(self) -> None:
        newest = next(iter(kept(self._folder)), None)
        _age.set(float("nan") if newest is None else newest.age_s)
        _bytes.set(0 if newest is None else newest.path.stat().st_size)


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
