"""The schema at start: the tables as the code knows them, and the way from an older version."""

import shutil
import sqlite3
import subprocess
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy import inspect

from service.store import Database, StoreError, campaigns, migrate, open_store
from service.store.tables import metadata
from tests.support.store_server import Place, campaign
from underskin.recordings.campaign import parse

NEWEST = migrate.VERSIONS[-1]
NEXT = '''"""What a later underskin might add."""

import sqlalchemy as sa
from alembic import op

revision = "next"
down_revision = "{newest}"


def upgrade() -> None:
    op.add_column("skins", sa.Column("colour", sa.Text()))
    {spoil}
'''


@pytest.fixture
def store(place: Place) -> Iterator[Database]:
    """A store with a campaign in it."""
    opened = open_store(place.database_url, place.folder)
    opened.write(campaigns.add, campaigns.NewCampaign(parse(campaign("kept", sensors=1)), None))
    yield opened
    opened.close()


def a_later_version(monkeypatch: pytest.MonkeyPatch, folder: Path, spoil: str = "") -> None:
    """An underskin that knows one version more."""
    scripts = folder / "migrations"
    shutil.copytree(migrate.SCRIPTS, scripts)
    (scripts / "versions" / "next.py").write_text(NEXT.format(newest=NEWEST, spoil=spoil))
    monkeypatch.setattr(migrate, "SCRIPTS", scripts)
    monkeypatch.setattr(migrate, "VERSIONS", (*migrate.VERSIONS, "next"))


def test_the_migrations_make_the_tables_that_the_code_uses(store: Database) -> None:
    from alembic.autogenerate import compare_metadata
    from alembic.migration import MigrationContext
    from alembic.script import ScriptDirectory

    with store.reading() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        assert compare_metadata(context, metadata) == []
    assert ScriptDirectory(str(migrate.SCRIPTS)).get_current_head() == migrate.VERSIONS[-1]


def test_an_older_store_is_backed_up_and_brought_up_to_date(
    store: Database, place: Place, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    a_later_version(monkeypatch, tmp_path)
    migrate.migrate(store, place.folder)
    with store.reading() as connection:
        assert "colour" in {column["name"] for column in inspect(connection).get_columns("skins")}
        assert migrate.version_of(connection) == "next"
    (made,) = (place.folder / "backups").iterdir()
    assert names_in(made) == ["kept"]


def test_without_a_backup_there_is_no_migration(
    store: Database, place: Place, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    a_later_version(monkeypatch, tmp_path)
    (place.folder / "backups").write_text("in the way")
    with pytest.raises((OSError, StoreError)):
        migrate.migrate(store, place.folder)
    assert migrate.version(store) == NEWEST


def test_a_migration_that_fails_leaves_the_store_as_it_was(
    store: Database, place: Place, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    a_later_version(monkeypatch, tmp_path, spoil="raise RuntimeError('halfway')")
    with pytest.raises(RuntimeError, match="halfway"):
        migrate.migrate(store, place.folder)
    with store.reading() as connection:
        assert "colour" not in {column["name"] for column in inspect(connection).get_columns("skins")}
        assert migrate.version_of(connection) == NEWEST


def names_in(backup: Path) -> list[str]:
    """Of the campaigns in a backup."""
    if backup.suffix == ".sqlite3":
        with closing(sqlite3.connect(backup)) as connection:
            return [row[0] for row in connection.execute("SELECT name FROM campaigns")]
    command = ["pg_restore", "--data-only", "--table=campaigns", "--file=-", str(backup)]
    dumped = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return ["kept"] if "\tkept\t" in dumped else []
