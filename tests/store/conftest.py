"""Every store test runs on SQLite and on a real PostgreSQL."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.store import postgres
from tests.store.server import Place, Server, running


@pytest.fixture(scope="session")
def cluster() -> Iterator[postgres.Cluster]:
    """PostgreSQL, started once."""
    if not postgres.available():
        pytest.skip("PostgreSQL (Debian's package postgresql) is not installed")
    with postgres.running() as started:
        yield started


@pytest.fixture(params=["sqlite", "postgresql"])
def place(request: pytest.FixtureRequest, tmp_path: Path) -> Place:
    """An empty store."""
    folder = tmp_path / "data"
    folder.mkdir()
    if request.param == "sqlite":
        return Place(folder)
    return Place(folder, request.getfixturevalue("cluster").new_database())


@pytest.fixture
def server(place: Place) -> Iterator[Server]:
    """A server over the empty store."""
    with running(place) as started:
        yield started
