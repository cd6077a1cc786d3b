"""What was derived counts only for the campaign, the revision and the table that it was derived from."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from service.store import Database, backup, campaigns, inversions, open_store
from service.store.restore import restore
from service.store.tables import AnyRow
from tests.store.server import Place, campaign
from underskin.recordings.campaign import parse

TABLE = "0" * 64


@pytest.fixture
def store(place: Place) -> Iterator[Database]:
    opened = open_store(place.database_url, place.folder)
    yield opened
    opened.close()


def kept(store: Database, name: str) -> AnyRow:
    """The row of a campaign of the skin `palm`, as it arrived."""
    with store.writing() as connection:
        campaign_id, _ = campaigns.add(connection, campaigns.Arrival(parse(campaign(name)), "palm"))
        return campaigns.find(connection, campaign_id)


def derive(store: Database, row: AnyRow) -> None:
    with store.writing() as connection:
        inversions.keep(connection, row, TABLE, {"campaign_id": row.id}, {"s0": (14.0, 0.1)})


def test_a_history_shows_nothing_of_an_earlier_revision(store: Database) -> None:
    row = kept(store, "one")
    derive(store, row)
    with store.reading() as connection:
        assert [point.sensor for point in inversions.history(connection, "palm", TABLE)] == ["s0"]
        assert inversions.history(connection, "palm", "1" * 64) == []
    with store.writing() as connection:
        campaigns.exclude(connection, row.id, "s0-1N", "cable loose")
        assert inversions.history(connection, "palm", TABLE) == []


def test_what_was_derived_before_a_restore_is_not_kept_for_another_campaign(store: Database, tmp_path: Path) -> None:
    empty = tmp_path / "empty"
    backup.make(store, empty)
    lost = kept(store, "lost")
    restore(store, empty, tmp_path / "data" / "backups" / f"before{backup.suffix(store)}")
    here = kept(store, "here")
    assert here.number == lost.number
    derive(store, lost)
    with store.reading() as connection:
        assert inversions.find(connection, here, TABLE) is None
        assert inversions.history(connection, "palm", TABLE) == []
