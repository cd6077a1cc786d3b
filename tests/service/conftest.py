"""Store tests run on SQLite and on a real PostgreSQL; those of a module that names one `BACKEND` so in `make soak`.

Such modules are about what lies above any store: clients, commands, sessions, files that come and go.
"""

import shutil
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from pathlib import Path

import psycopg
import pytest

from bench.soak import SOAK
from service.store.engine import SQLITE_FILE
from service.store.tables import metadata
from tests.service.backends import BACKENDS
from tests.service.waiting import LIMIT_S
from tests.support import postgres
from tests.support.store_server import Place, Server, running


@pytest.hookimpl(tryfirst=True)
def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Run the tests of a module that names a `BACKEND` on that alone, but for those that name theirs (backends.py)."""
    backend = getattr(metafunc.module, "BACKEND", None)
    if backend is None or SOAK:
        return
    named = {mark.args[0] for mark in metafunc.definition.iter_markers("parametrize")}
    for fixture in {"place", "server"} & set(metafunc.fixturenames) - named:
        metafunc.definition.add_marker(pytest.mark.parametrize(fixture, [backend], indirect=True))


@pytest.fixture(scope="session")
def cluster() -> Iterator[postgres.Cluster]:
    """PostgreSQL, started once."""
    if not postgres.available():
        pytest.skip("PostgreSQL (Debian's package postgresql) is not installed")
    with postgres.running() as started:
        yield started


@pytest.fixture(params=BACKENDS)
def place(request: pytest.FixtureRequest, tmp_path: Path) -> Place:
    """An empty store, for tests that start and end servers."""
    folder = tmp_path / "data"
    folder.mkdir()
    return Place(folder, "" if request.param == "sqlite" else request.getfixturevalue("cluster").new_database())


@pytest.fixture(scope="session")
def servers(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Callable[[str], Server]]:
    """Servers by name, started when first asked for, since that takes longer than most tests.

    One called `working` runs diagnoses, one at a time, the others none.
    """
    started: dict[str, Server] = {}
    with ExitStack() as stack:

        def server(name: str) -> Server:
            if name not in started:
                folder = tmp_path_factory.mktemp(name)
                url = request.getfixturevalue("cluster").new_database() if name == "postgresql" else ""
                works = name == "working"
                settings = {"UNDERSKIN_DIAGNOSIS_WORKERS": f"{works:d}", "UNDERSKIN_DIAGNOSIS_READY": str(works)}
                started[name] = stack.enter_context(running(Place(folder, url), **settings))
            return started[name]

        yield server


@pytest.fixture(params=BACKENDS)
def server(request: pytest.FixtureRequest, servers: Callable[[str], Server]) -> Server:
    """A running server, its store emptied."""
    return emptied(servers(request.param))


@pytest.fixture
def working(servers: Callable[[str], Server]) -> Server:
    """A running server on SQLite that makes diagnoses, its store emptied."""
    return emptied(servers("working"))


@pytest.fixture
def elsewhere(servers: Callable[[str], Server]) -> Server:
    """Another one."""
    return emptied(servers("elsewhere"))


def emptied(server: Server) -> Server:
    """The server without anything kept."""
    deleted = "".join(f"DELETE FROM {table.name};" for table in reversed(metadata.sorted_tables))
    if server.place.database_url:
        with psycopg.connect(server.place.database_url) as connection:
            connection.execute(deleted.encode())
    else:
        with closing(sqlite3.connect(server.place.folder / SQLITE_FILE, timeout=LIMIT_S)) as file:
            file.executescript(f"BEGIN IMMEDIATE;{deleted}COMMIT;")
    shutil.rmtree(server.place.folder / "backups", ignore_errors=True)
    return server
