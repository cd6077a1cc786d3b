"""What was derived counts only for the campaign, the revision and the table that it was derived from."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from service.schemas.campaign_d33 import D33
from service.store import Database, backup, campaigns, inversions, open_store
from service.store.migrate import restore
from service.store.tables import AnyRow
from service.usecases import d33_cache
from tests.support.store_server import Place, campaign
from underskin import load_table
from underskin.recordings.campaign import parse

BACKEND = "sqlite"
TABLE = "0" * 64


@pytest.fixture
def store(place: Place) -> Iterator[Database]:
    opened = open_store(place.database_url, place.folder)
    yield opened
    opened.close()


def kept(store: Database, name: str) -> AnyRow:
    """The row of a campaign of the skin `palm`, as it arrived."""
    with store.writing() as connection:
        campaign_id, _ = campaigns.add(connection, campaigns.NewCampaign(parse(campaign(name)), "palm"))
        return campaigns.find(connection, campaign_id)


def derive(store: Database, row: AnyRow) -> None:
    with store.writing() as connection:
        inversions.keep(connection, row, TABLE, {"campaign_id": row.id}, {}, {"s0": (14.0, 0.1)})


def test_a_history_shows_nothing_of_an_earlier_revision(store: Database) -> None:
    row = kept(store, "one")
    derive(store, row)
    with store.reading() as connection:
        assert [point.sensor for point in inversions.history(connection, "palm", TABLE)] == ["s0"]
        assert inversions.history(connection, "palm", "1" * 64) == []
    with store.writing() as connection:
        campaigns.exclude(connection, row.id, "s0-1N", "cable loose", None)
        assert inversions.history(connection, "palm", TABLE) == []


@pytest.mark.parametrize("error", [OverflowError("too large"), ValueError("no zone"), IndexError("none left")])
def test_figures_that_cannot_be_computed_are_an_answer_and_tried_again(
    store: Database, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, error: Exception
) -> None:
    def fail(*_: object) -> None:
        raise error

    row, table = kept(store, "odd"), load_table()
    with monkeypatch.context() as broken:
        broken.setattr(d33_cache, "invert", fail)
        for band in (None, (10.0, 100.0)):
            told = D33(**d33_cache.answer(store, table, row, band))
            assert (told.status, str(error) in str(told.reason), told.sensors) == ("none", True, [])
        d33_cache.complete(store, table, "palm")
    assert {record.levelname for record in caplog.records} == {"ERROR"}
    assert d33_cache.answer(store, table, row, None)["status"] == "ok"
    with store.reading() as connection:
        assert len(inversions.history(connection, "palm", table.sha256)) == 3


def test_what_was_derived_before_a_restore_is_not_kept_for_another_campaign(store: Database, tmp_path: Path) -> None:
    empty = tmp_path / "empty"
    backup.make(store, empty)
    lost = kept(store, "lost")
    restore(store, empty, tmp_path / "data" / "backups" / "before")
    here = kept(store, "here")
    assert here.number == lost.number
    derive(store, lost)
    with store.reading() as connection:
        assert inversions.find(connection, here, TABLE) is None
        assert inversions.history(connection, "palm", TABLE) == []
