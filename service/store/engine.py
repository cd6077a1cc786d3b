"""The database behind the store: SQLite in the data folder, or PostgreSQL by URL."""

import errno
import fcntl
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Concatenate, ParamSpec, TypeAlias, TypeVar

import orjson
from sqlalchemy import URL, Connection, Engine, Table, create_engine, event, make_url, select, text
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.exc import ArgumentError, DBAPIError, InternalError, OperationalError
from sqlalchemy.exc import TimeoutError as NoConnectionError

from service.store.errors import StoreError
from service.store.sqlite_files import SqliteFiles
from service.store.write_turns import SOON_S, WAIT_S, WriteTurns, busy

SQLITE_FILE = "underskin.sqlite3"
CONNECTION_WAIT_S = 10.0  # for a connection of the pool, in addition to the wait for other writers
_TAKES_NOTHING = (errno.EROFS, errno.EIO, errno.EFBIG)  # the last where files may not grow beyond some size
_NOT_WRITTEN = (  # of SQLite, other than for a full disk
    sqlite3.SQLITE_IOERR_WRITE,
    sqlite3.SQLITE_IOERR_FSYNC,
    sqlite3.SQLITE_IOERR_TRUNCATE,
    sqlite3.SQLITE_IOERR_SHMSIZE,
)
_PG_DISK_FULL = "53100"
_PG_READ_ONLY = "25006"
# A server that is gone without a word, as when its power fails, is noticed within half a minute: by the system's own
# limits it would be a quarter of an hour for what was sent, and two hours for an answer.
_NOTICED = {"keepalives_idle": 10, "keepalives_interval": 5, "keepalives_count": 3, "tcp_user_timeout": 20_000}  # s, ms
_PG_WRITING = 7236412  # any number, the same for all servers of a database; a migration has another
_SCHEMES = ("postgresql", "postgres", "postgresql+psycopg")
_Given = ParamSpec("_Given")
_Answer = TypeVar("_Answer")
_OnConnection: TypeAlias = Callable[Concatenate[Connection, _Given], _Answer]


class StorageFailed(Exception):
    """The disk cannot be written: mounted read-only, or failing; nothing of the request was stored."""


class StorageFull(StorageFailed):
    """The disk is full; nothing of the request was stored."""


class Database:
    """Transactions on one engine: a write is durable once its block has ended, or has no effect."""

    def __init__(self, url: URL) -> None:
        """Opens no connection yet."""
        self.url = url
        self._files = SqliteFiles(Path(url.database or "")) if url.get_backend_name() == "sqlite" else None
        self.engine = _engine(url, self._files)
        self._writers = _engine(url, self._files)  # readers that take long leave writers theirs, and the other way
        self._turns = WriteTurns()

    @property
    def is_sqlite(self) -> bool:
        """Whether it is a file; otherwise it is PostgreSQL."""
        return self._files is not None

    def make(self) -> None:
        """Create an empty SQLite file if there is none; everything else here requires one."""
        if self._files is not None:
            self._files.make()

    def is_made(self) -> bool:
        """Whether the SQLite file exists; PostgreSQL databases are created by others."""
        return self._files is None or self._files.is_made()

    def require_in_place(self) -> None:
        """Raises StoreMoved if the files of an SQLite store are missing or are not those on the disk."""
        if self._files is not None:
            self._files.require_in_place()

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """A connection that sees one state of the store.

        If the files of an SQLite store were removed or replaced, open connections go on reading them, so that the data
        can be saved; new ones raise StoreMoved.
        """
        with _connected(self.engine) as connection:
            if not self.is_sqlite:
                connection.execution_options(isolation_level="REPEATABLE READ", postgresql_readonly=True)
            yield connection

    @contextmanager
    def writing(self, *, soon: bool = False) -> Iterator[Connection]:
        """A transaction that commits at the end of the block.

        Raises OperationalError if others write for too long or too many wait; StorageFull, StorageFailed; StoreMoved if
        the file is not the one on the disk. `soon`: wait less than a second, for data that can be made again.
        """
        wait_s = SOON_S if soon else WAIT_S
        engine = self.engine if soon else self._writers  # whose connections may all be waiting
        try:
            with (
                self._turn(wait_s),
                _connected(engine).execution_options(write=True) as connection,
                connection.begin(),
            ):
                if not self.is_sqlite:
                    connection.execute(text(f"SET LOCAL lock_timeout = '{wait_s:g}s'"))
                    connection.execute(text("SELECT pg_advisory_xact_lock_shared(:number)"), {"number": _PG_WRITING})
                yield connection
                self.require_in_place()
            self.require_in_place()  # a move during the commit is not acknowledged either
            self._turns.note(in_vain=False)
        except (DBAPIError, OSError) as error:
            failure = storage_failure(error)
            if failure is not None:
                raise failure from error
            if isinstance(error, InternalError) and error.orig and _sqlstate(error.orig) == _PG_READ_ONLY:
                raise OperationalError(None, None, error.orig) from error  # a standby: another server takes writes
            if isinstance(error, OperationalError):
                self._turns.note(in_vain=True, soon=soon)
            raise

    def require_hope(self, *, soon: bool = False) -> None:
        """Check before long work that ends in a write: raises OperationalError if writers have just waited in vain;
        for a `soon` write also if they did not wait long."""
        self._turns.require_hope(soon=soon)

    def read(self, query: _OnConnection[_Given, _Answer], *given: _Given.args, **named: _Given.kwargs) -> _Answer:
        """The result of one function of a connection in a block of `reading`."""
        with self.reading() as connection:
            return query(connection, *given, **named)

    def write(self, change: _OnConnection[_Given, _Answer], *given: _Given.args, **named: _Given.kwargs) -> _Answer:
        """The same in a block of `writing`."""
        with self.writing() as connection:
            return change(connection, *given, **named)

    @contextmanager
    def without_writers(self) -> Iterator[None]:
        """Within the block nobody writes, in this process or another: current writes end, later ones wait."""
        with self._locked_file() if self.is_sqlite else self.pg_lock(_PG_WRITING):
            yield

    @contextmanager
    def pg_lock(self, number: int) -> Iterator[None]:
        """A lock of PostgreSQL that processes take by its number, one at a time."""
        with self.engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
            connection.execute(text("SELECT pg_advisory_lock(:number)"), {"number": number})
            try:
                yield
            finally:
                connection.execute(text("SELECT pg_advisory_unlock(:number)"), {"number": number})

    @contextmanager
    def _turn(self, wait_s: float) -> Iterator[None]:
        """The lock of writers; SQLite has one writer at a time anyway, but its own lock cannot span a restore."""
        with self._turns.slot():
            if not self.is_sqlite:
                yield
                return
            self.require_in_place()  # a new lock file elsewhere would exclude nobody
            with self._turns.sole(self._lock_file, wait_s):
                yield

    @property
    def _lock_file(self) -> Path:
        return Path(f"{self.url.database}.lock")

    @contextmanager
    def _locked_file(self) -> Iterator[None]:
        """The lock for a restore, which waits as long as necessary."""
        self.require_in_place()
        with self._lock_file.open("a") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield

    def close(self) -> None:
        """Close all connections."""
        self.engine.dispose()
        self._writers.dispose()
        if self._files is not None:
            self._files.close()


def database(database_url: str, folder: Path) -> Database:
    """The database at `database_url`, or SQLite in `folder` where that is empty; raises StoreError."""
    if not database_url:
        return Database(URL.create("sqlite", database=str(folder / SQLITE_FILE)))
    try:
        url = make_url(database_url)
    except ArgumentError:
        raise StoreError("UNDERSKIN_DATABASE_URL is not a URL like postgresql://user:password@host/database") from None
    if url.drivername not in _SCHEMES:
        allowed = "postgresql; leave it out for SQLite in the data folder"
        raise StoreError(f"UNDERSKIN_DATABASE_URL names {url.drivername!r}; allowed: {allowed}")
    return Database(url.set(drivername="postgresql+psycopg"))


def storage_failure(error: OSError | DBAPIError) -> StorageFailed | None:
    """StorageFull or StorageFailed if an error, or its cause, says so; None otherwise."""
    if isinstance(error, OSError):
        full, failed = error.errno in (errno.ENOSPC, errno.EDQUOT), error.errno in _TAKES_NOTHING
        message = error.strerror
    else:
        code = getattr(error.orig, "sqlite_errorcode", 0)
        full = code & 0xFF == sqlite3.SQLITE_FULL or _sqlstate(error.orig) == _PG_DISK_FULL
        failed = code & 0xFF == sqlite3.SQLITE_READONLY or code in _NOT_WRITTEN
        message = str(error.orig)
    if full:
        return StorageFull(str(error))
    return StorageFailed(message) if failed else None


def _sqlstate(error: BaseException | None) -> str | None:
    """PostgreSQL's code of an error."""
    return getattr(error, "sqlstate", None)


def holds(connection: Connection, table: Table, **values: Any) -> bool:
    """Whether a table has a row with these values."""
    same = [table.c[name] == value for name, value in values.items()]
    return connection.execute(select(1).select_from(table).where(*same).limit(1)).first() is not None


def upsert(connection: Connection, table: Table) -> sqlite.Insert | postgresql.Insert:
    """An insert that can define what to do if the row exists, as each database has its own."""
    return (sqlite if connection.dialect.name == "sqlite" else postgresql).insert(table)


def _engine(url: URL, files: SqliteFiles | None) -> Engine:
    options: dict[str, Any] = {
        "pool_timeout": CONNECTION_WAIT_S,
        "json_serializer": lambda value: orjson.dumps(value).decode(),
        "json_deserializer": orjson.loads,
        "hide_parameters": True,  # stored values, keys' digests included, stay out of errors and thus of the log
    }
    if files is not None:
        engine = create_engine(url, creator=files.connect, **options)
        event.listen(engine, "begin", _begin_sqlite)
        return engine
    # A commit waits for the disk whatever the server's default. No statement is prepared: a restore replaces tables.
    durable = {"options": "-c synchronous_commit=on -c timezone=UTC", "prepare_threshold": None, "connect_timeout": 10}
    return create_engine(url, connect_args=durable | _NOTICED, pool_pre_ping=True, **options)


def _connected(engine: Engine) -> Connection:
    """A connection; raises OperationalError if all are in use for too long."""
    try:
        return engine.connect()
    except NoConnectionError:
        raise busy("a connection") from None


def _begin_sqlite(connection: Connection) -> None:
    """A write takes the lock at once: a transaction that began as a read could not wait for another's end."""
    write = connection.get_execution_options().get("write", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if write else "BEGIN")
