"""Health checks of a server: store, disk, tables, keys, backups, clock and queue.

A check returns its finding and, if something is wrong, what to do; it changes nothing.
"""

import os
import shutil
import sqlite3
import stat
import time
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import IntEnum
from pathlib import Path

from sqlalchemy import ColumnElement, Connection, func, select
from sqlalchemy.exc import DBAPIError

from service.auth.access_control import LOOPBACK_NAMES
from service.auth.keys import KeyStore, KeysUnreadable
from service.log import first_line
from service.settings import Settings, unknown_settings
from service.store import Database, StoreError, StoreMoved, backup, database, diagnoses, key_requirement, migrate
from service.store.engine import SQLITE_FILE
from service.store.tables import campaigns
from service.store.tables import diagnoses as queue
from service.usecases.scheduled_backups import OWNER, SKEW_S, foreign, newest, stored_backups
from underskin import TableError
from underskin.surrogate.sigma_table import SIGMA_TABLE, SigmaTable

FILES_OPEN = "see that the disk answers, and that this user is the one that runs the server"
_LITTLE_MB, _TOO_LITTLE_MB = 2000, 200
_SKEW_S = 5.0  # of two clocks
_DATABASE = "see whether the database runs, and its address in UNDERSKIN_DATABASE_URL"
_WAITS_S = 300.0  # a diagnosis in the queue


class Level(IntEnum):
    """Severity as in monitoring systems: the exit status of the worst finding."""

    OK = 0
    WARNING = 1
    CRITICAL = 2


@dataclass(frozen=True)
class Observation:
    """What a check found, in words, and what to do where that is anything."""

    check: str
    level: Level
    found: str
    advice: str = ""


def carried_out(check: str, observations: Iterator[Observation]) -> Iterator[Observation]:
    """The findings of a check, and one more if a disk or file error ends it early."""
    try:
        yield from observations
    except OSError as error:
        yield Observation(check, Level.CRITICAL, f"cannot be looked at: {first_line(error)}", FILES_OPEN)


def open_to_others(check: str, folders: Sequence[Path]) -> Iterator[Observation]:
    """Files in these folders that others than their owner may read or write."""
    files = [path for folder in folders for path in sorted(folder.glob("*")) if path.is_file()]
    open_paths = [str(path) for path in files if stat.S_IMODE(path.stat().st_mode) & 0o077]
    if open_paths:
        more = f" and {len(open_paths) - 3} more" if len(open_paths) > 3 else ""
        message = f"others than their owner may open {', '.join(open_paths[:3])}{more}"
        yield Observation(check, Level.WARNING, message, "chmod 600 these files")


def of_backups(settings: Settings, store: Database) -> Iterator[Observation]:
    """One finding or more."""
    if settings.backup_to is None:
        yield Observation("backups", Level.WARNING, "the server makes none by itself",
                      "set UNDERSKIN_BACKUP_TO, or see that `underskin backup FILE` runs every day")  # fmt: skip
        return
    try:
        words = foreign(store, settings.backup_to)
    except (DBAPIError, StoreError, StoreMoved, OSError):
        words = ""
        yield Observation("backups", Level.WARNING, f"of which store those in {settings.backup_to} are is unknown",
                          "see to the store first")  # fmt: skip
    if words:
        yield Observation("backups", Level.CRITICAL, f"{words}, and the server makes none there",
                          "set UNDERSKIN_BACKUP_TO to a folder of its own; if it is this store after all, "
                          f"delete {settings.backup_to / OWNER}")  # fmt: skip
        return
    yield from open_to_others("backups", [settings.backup_to])
    ahead = [copy for copy in stored_backups(settings.backup_to) if copy.age_s < -SKEW_S]
    if ahead:
        yield Observation("backups", Level.WARNING, f"{ahead[0].path.name} is dated ahead of this machine's clock",
                      "set the clock, and rename or delete what a wrong one dated")  # fmt: skip
    last = newest(settings.backup_to)
    if last is None:
        yield Observation("backups", Level.CRITICAL, f"there is none in {settings.backup_to}",
                      "see that its disk is mounted and a server runs; its log says why it makes none")  # fmt: skip
        return
    hours = last.age_s / 3600
    if hours > 2 * settings.backup_every:
        yield Observation("backups", Level.CRITICAL, f"the newest, {last.path.name}, is {hours:.0f} hours old",
                      "see that the server runs; its log says why none can be made")  # fmt: skip
        return
    try:
        backup.verify(store, last.path)
    except (StoreError, OSError) as error:
        yield Observation("backups", Level.CRITICAL, str(error),
                      "see that it is of this store and its disk is sound; then `underskin backup FILE`")  # fmt: skip
        return
    if (count := len(stored_backups(settings.backup_to))) > settings.backup_keep + 1:
        yield Observation("backups", Level.WARNING, f"{count} are kept, more than UNDERSKIN_BACKUP_KEEP = "
                          f"{settings.backup_keep}: none is deleted while the newest is far smaller than the largest",
                          "see whether the store lacks anything; if not, delete the larger ones")  # fmt: skip
    addition = ", on the disk of the store itself" if _on_one_disk(settings.data, settings.backup_to) else ""
    yield Observation("backups", Level.OK, f"{last.path.name}, {hours:.1f} hours old, read whole{addition}")


def _on_one_disk(*folders: Path) -> bool:
    return len({folder.stat().st_dev for folder in folders if folder.is_dir()}) == 1


def examine(settings: Settings) -> Iterator[Observation]:
    """At least one finding per check, also from a check that fails."""
    yield from _of_settings()
    yield from carried_out("data folder", _of_folder(settings.data))
    yield from carried_out("disk", _of_disk(settings))
    yield _of_tables(settings.tables)
    try:
        store = database(settings.database_url, settings.data)
    except StoreError as error:
        yield Observation("store", Level.CRITICAL, str(error), "set UNDERSKIN_DATABASE_URL right")
        return
    with closing(store):
        answers = _of_store(store, settings)
        yield answers
        yield from carried_out("backups", of_backups(settings, store))
        needed: bool | None = None
        made = True
        try:
            made = store.is_made()
            if made and migrate.version(store) is not None:
                needed = store.read(key_requirement.is_needed)
            if answers.level is Level.OK:
                for look in (_of_clock, _of_queue):
                    yield store.read(look)
        except (DBAPIError, StoreMoved, OSError) as error:
            if answers.level is not Level.CRITICAL:  # otherwise reported already
                yield _unanswered(error)
        yield from carried_out("keys", _of_keys(settings, needed=needed, made=made))


def _of_settings() -> Iterator[Observation]:
    if unknown := unknown_settings():
        yield Observation("settings", Level.WARNING, f"nothing reads {', '.join(unknown)}", "see docs/settings.md")


def _of_folder(folder: Path) -> Iterator[Observation]:
    if not folder.is_dir():
        yield Observation(
            "data folder", Level.CRITICAL, f"{folder} is not there",
            "set UNDERSKIN_DATA to the server's folder, or mount its disk",
        )  # fmt: skip
        return
    mode = stat.S_IMODE(folder.stat().st_mode)
    if not os.access(folder, os.W_OK | os.X_OK):
        who = f"chown it to the user that runs the server (this one has the number {os.geteuid()})"
        yield Observation("data folder", Level.CRITICAL, f"{folder} cannot be written to (mode {mode:o})", who)
    elif mode & 0o007:
        yield Observation("data folder", Level.WARNING, f"everybody may enter {folder} (mode {mode:o})", "chmod 700 it")
    else:
        yield Observation("data folder", Level.OK, f"{folder}, mode {mode:o}")
    yield from open_to_others("data folder", [folder, folder / "backups", folder / "mechanisms"])


def _of_disk(settings: Settings) -> Iterator[Observation]:
    for name, folder in (("disk", settings.data), ("disk of the backups", settings.backup_to)):
        if folder is None or not folder.is_dir():
            continue
        free = shutil.disk_usage(folder).free / 1e6
        level = Level.CRITICAL if free < _TOO_LITTLE_MB else Level.WARNING if free < _LITTLE_MB else Level.OK
        advice = "" if level is Level.OK else "make room: what finds none is refused (507), and backups fail"
        yield Observation(name, level, f"{free:,.0f} MB free in {folder}", advice)


def _of_tables(folder: Path) -> Observation:
    try:
        table = SigmaTable(folder / SIGMA_TABLE)
    except (TableError, OSError) as error:
        return Observation("tables", Level.CRITICAL, str(error), "set UNDERSKIN_TABLES, or install underskin again")
    return Observation("tables", Level.OK, f"{folder / SIGMA_TABLE}, SHA-256 {table.sha256[:12]}…")


def _of_store(store: Database, settings: Settings) -> Observation:
    try:
        if not store.is_made():
            return _of_none(settings)
        version = migrate.version(store)
        if version is None:
            return Observation("store", Level.WARNING, "it is empty", "start the server once")
        migrate.require_known(version)
        count = store.read(_count_campaigns)
        damage = _damage(store)
    except (StoreError, StoreMoved) as error:
        return Observation("store", Level.CRITICAL, str(error), "see docs/store.md")
    except (DBAPIError, OSError) as error:
        return _unanswered(error)
    if damage:
        return Observation("store", Level.CRITICAL, f"it is damaged: {damage}", "stop the server and restore a backup")
    if version != migrate.VERSIONS[-1]:
        return Observation("store", Level.WARNING, f"its schema is {version}, the newest {migrate.VERSIONS[-1]}",
                       "start this server: it backs the store up and brings it up to date")  # fmt: skip
    return Observation("store", Level.OK, f"{count:,} campaigns, schema {version}")


def _of_none(settings: Settings) -> Observation:
    """Where there is no SQLite store, and perhaps was one."""
    folder = settings.data
    leftovers = [path for path in (folder / f"{SQLITE_FILE}{suffix}" for suffix in ("-wal", ".lock")) if path.exists()]
    last = None if settings.backup_to is None else newest(settings.backup_to)
    if leftovers or last is not None:
        sign = leftovers[0] if last is None else last.path
        return Observation("store", Level.CRITICAL, f"there is none in {folder}, and there was: {sign} is left of it",
                       f"mount its disk, or put {SQLITE_FILE} back, or restore a backup, before the server is "
                       "started, which would begin an empty one")  # fmt: skip
    return Observation("store", Level.WARNING, f"there is none in {folder} yet",
                   "start the server once, or set UNDERSKIN_DATA to its folder, or mount its disk")  # fmt: skip


def _unanswered(error: Exception) -> Observation:
    advice = FILES_OPEN if isinstance(error, OSError) else _DATABASE
    return Observation("store", Level.CRITICAL, f"it does not answer: {first_line(error)}", advice)


def _count_campaigns(connection: Connection) -> int:
    return int(connection.execute(select(func.count()).select_from(campaigns)).scalar_one())


def _damage(store: Database) -> str:
    """SQLite's integrity errors; PostgreSQL checks itself."""
    if not store.is_sqlite:
        return ""
    uri = Path(str(store.url.database)).absolute().as_uri() + "?mode=ro"
    with closing(sqlite3.connect(uri, uri=True)) as connection:
        outcome = str(connection.execute("PRAGMA quick_check").fetchone()[0])
    return "" if outcome == "ok" else outcome


def _of_keys(settings: Settings, *, needed: bool | None, made: bool) -> Iterator[Observation]:
    """`needed`: None where the store could not be asked; `made`: whether there is a store."""
    keys = KeyStore(settings.data)
    if not keys.file_exists():
        if needed is None and made:
            yield Observation("keys", Level.WARNING, f"{keys.path} is missing; whether keys are needed is unknown",
                          "see to the store first")  # fmt: skip
        elif needed:
            yield Observation("keys", Level.CRITICAL, f"they are needed, and {keys.path} is missing",
                          "put it back, or make a key with `underskin key create NAME`")  # fmt: skip
        elif not settings.host_names <= LOOPBACK_NAMES:
            yield Observation("keys", Level.CRITICAL, f"there is none, and without one none serves as {settings.hosts}",
                              "make one with `underskin key create NAME`, or unset UNDERSKIN_HOSTS")  # fmt: skip
        else:
            yield Observation("keys", Level.OK, "none: the server answers on this machine only")
        return
    try:
        entries = keys.entries()
    except KeysUnreadable as error:
        yield Observation("keys", Level.CRITICAL, str(error), "put a copy back, or remove the file and make keys anew")
        return
    level, advice = (Level.OK, "") if entries else (Level.WARNING, "make one with `underskin key create NAME`")
    yield Observation("keys", level, f"{len(entries)} in {keys.path}", advice)


def _of_clock(connection: Connection) -> Observation:
    ahead = diagnoses.clock(connection) - time.time()
    if abs(ahead) > _SKEW_S:
        return Observation("clock", Level.WARNING, f"the database's clock is {ahead:+.0f} s from this machine's",
                      "have both follow a time server")  # fmt: skip
    last = connection.execute(select(func.max(campaigns.c.received_at))).scalar()
    now = datetime.now(UTC)
    if last is not None and (datetime.fromisoformat(last) - now).total_seconds() > _SKEW_S:
        return Observation("clock", Level.WARNING, f"a campaign came in at {last}; now it is {now:%Y-%m-%d %H:%M} UTC",
                      "set this machine's clock, and have it follow a time server")  # fmt: skip
    return Observation("clock", Level.OK, f"{now:%Y-%m-%d %H:%M:%S} UTC")


def _of_queue(connection: Connection) -> Observation:
    silent = diagnoses.clock(connection) - diagnoses.HEARTBEAT_TIMEOUT_S
    is_running = queue.c.state == "running"
    running = _count(connection, is_running, queue.c.alive_at >= silent)
    abandoned = _count(connection, is_running, queue.c.alive_at < silent)
    waiting = _count(connection, queue.c.state == "queued")
    oldest = connection.execute(select(func.min(queue.c.asked_at)).where(queue.c.state == "queued")).scalar()
    waits = 0.0 if oldest is None else (datetime.now(UTC) - datetime.fromisoformat(oldest)).total_seconds()
    message = f"{running} running, {waiting} waiting"
    if abandoned or (waits > _WAITS_S and not running):
        return Observation("diagnoses", Level.WARNING, f"{message}, {abandoned} left by a server that ended",
                      "see that a server with UNDERSKIN_DIAGNOSIS_WORKERS above 0 runs")  # fmt: skip
    return Observation("diagnoses", Level.OK, message)


def _count(connection: Connection, *conditions: ColumnElement[bool]) -> int:
    return int(connection.execute(select(func.count()).select_from(queue).where(*conditions)).scalar_one())
