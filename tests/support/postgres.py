"""A real PostgreSQL server of the tests' own: fresh cluster, free port, run by the user postgres where we are root."""

import os
import pwd
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_BIN = os.pathsep.join(map(str, sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)))
_PATH = os.pathsep.join([_BIN, os.environ["PATH"]])
INITDB = shutil.which("initdb", path=_PATH)
USER = "postgres"
WAL_SEGMENT_MB = 1  # a test of power cuts copies those that are synced
# For clusters whose machine keeps its power: nothing waits for a disk, and no process looks for what to tidy.
_IN_A_HURRY = ("fsync=off", "synchronous_commit=off", "full_page_writes=off", "autovacuum=off")
_GONE_WITHIN_S = 240


def available() -> bool:
    """Whether PostgreSQL is installed, and its user there where we need it."""
    return INITDB is not None and (os.geteuid() != 0 or _has_user())


def _has_user() -> bool:
    try:
        pwd.getpwnam(USER)
    except KeyError:
        return False
    return True


def _run(*command: str, **settings: str) -> subprocess.CompletedProcess[str]:
    as_user = ["setpriv", f"--reuid={USER}", f"--regid={USER}", "--init-groups"] if os.geteuid() == 0 else []
    environment = {"PATH": _PATH, "LC_ALL": "C.UTF-8", **settings}
    done = subprocess.run([*as_user, *command], env=environment, capture_output=True, text=True, cwd="/")
    assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
    return done


class Cluster:
    """A running server; `new_database` gives the URL of an empty database."""

    def __init__(self, folder: Path, port: int, user: str, *, synced: bool) -> None:
        self.folder = folder
        settings = ["listen_addresses=127.0.0.1", f"port={port}", f"unix_socket_directories={folder}"]
        self._options = " ".join(f"-c {one}" for one in (*settings, *(() if synced else _IN_A_HURRY)))
        self._base = f"postgresql://{user}@127.0.0.1:{port}"
        self._psql = ["psql", "--no-psqlrc", "--host=127.0.0.1", f"--port={port}", f"--username={user}"]
        self._count = 0

    @property
    def data(self) -> Path:
        """The folder of all that it keeps."""
        return self.folder / "data"

    def start(self, **settings: str) -> None:
        """Start it, with these variables in its environment."""
        given = (f"--pgdata={self.data}", f"--log={self.folder}/log", f"--options={self._options}")
        try:
            _run("pg_ctl", "start", "--wait", *given, **settings)
        except AssertionError as error:
            log = (self.folder / "log").read_text(encoding="utf-8", errors="replace")
            error.add_note("\n".join(log.splitlines()[-30:]))
            raise

    def stop(self) -> None:
        """End its processes at once, where they run: the next start recovers from the write-ahead log.

        Returns when no process has the server's number any more: a start after a power cut finds the old lock file, and
        refuses while the number in it is taken, be it by a dead process that nobody has waited for yet.
        """
        lock = self.data / "postmaster.pid"
        if lock.exists():
            number = int(lock.read_text().split()[0])
            _run("pg_ctl", "stop", "--mode=immediate", f"--pgdata={self.data}")
            given_up = time.monotonic() + _GONE_WITHIN_S
            while Path(f"/proc/{number}").exists():
                assert time.monotonic() < given_up, f"PostgreSQL (process {number}) is still there after its end"
                time.sleep(0.02)

    def new_database(self, tablespace: Path | None = None) -> str:
        """An empty database, its tables in `tablespace`.

        PostgreSQL's own catalogue stays outside: a backend that finds no room for its cache of it refuses to connect.
        """
        self._count += 1
        name = f"test{self._count}"
        self.run_sql("postgres", f"CREATE DATABASE {name}")
        if tablespace is not None:
            self.run_sql("postgres", f"CREATE TABLESPACE {name} LOCATION '{tablespace}'")
            self.run_sql("postgres", f"ALTER DATABASE {name} SET default_tablespace = {name}")
        return f"{self._base}/{name}"

    def drop(self, url: str) -> None:
        """Drop a database in a tablespace of its own, and that: before its disk goes, or checkpoints fail for all."""
        name = url.rpartition("/")[2]
        self.run_sql("postgres", f"DROP DATABASE {name} WITH (FORCE)")
        self.run_sql("postgres", f"DROP TABLESPACE {name}")

    def run_sql(self, database: str, statement: str) -> str:
        return _run(*self._psql, f"--dbname={database}", "--command", statement).stdout


@contextmanager
def running(*, synced: bool = False) -> Iterator[Cluster]:
    """A cluster in a folder that is gone at the end; `synced` keeps what it acknowledges through a power cut."""
    folder = Path(tempfile.mkdtemp(prefix="underskin-postgres-"))
    if os.geteuid() == 0:
        shutil.chown(folder, USER, USER)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    cluster = Cluster(folder, port, USER, synced=synced)
    try:
        given = (f"--username={USER}", "--encoding=UTF8", f"--pgdata={cluster.data}", f"--wal-segsize={WAL_SEGMENT_MB}")
        _run("initdb", "--auth=trust", "--no-sync", *given)
        cluster.start()
        try:
            yield cluster
        finally:
            cluster.stop()
    finally:
        shutil.rmtree(folder)
