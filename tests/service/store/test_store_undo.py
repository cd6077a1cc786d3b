"""Changes taken back below others, of skins put away, and beside other writers."""

import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from pathlib import Path

import pytest
from sqlalchemy import Connection, select

from service.store import (
    Conflict,
    Database,
    annotations,
    campaigns,
    diagnoses,
    export,
    import_checks,
    models,
    open_store,
    skins,
    undo,
)
from service.store.tables import changes as change_rows
from tests.support import postgres
from tests.support.store_server import Place, campaign
from underskin.recordings.campaign import parse
from underskin.recordings.skin_export import read_overview

BACKEND = "postgresql"


@pytest.fixture
def store(place: Place) -> Iterator[Database]:
    opened = open_store(place.database_url, place.folder)
    yield opened
    opened.close()


@pytest.fixture
def on_postgresql(cluster: postgres.Cluster, tmp_path: Path) -> Iterator[Database]:
    opened = open_store(cluster.new_database(), tmp_path)
    yield opened
    opened.close()


def keep(connection: Connection, skin: str) -> str:
    arrival = campaigns.NewCampaign(parse(campaign(f"of {skin}", sensors=1)), skin)
    return campaigns.add(connection, arrival)[0]


def last(store: Database) -> str:
    """The id of the latest change."""
    query = select(change_rows.c.id).order_by(change_rows.c.number.desc()).limit(1)
    return str(store.read(lambda connection: connection.execute(query).scalar_one()))


def joined(store: Database, skin: str, other: str) -> str:
    store.write(skins.join, skin, other, "one skin", None)
    return last(store)


def roots(store: Database, names: str) -> dict[str, str]:
    return {name: store.read(skins.require_root, name) for name in names}


def listed(store: Database) -> set[str]:
    return {row.id for row in store.read(skins.listed, None, None, 9)}


def test_a_join_below_another_is_undone_only_after_that(store: Database) -> None:
    for name in "abcd":
        store.write(skins.require, name)
    lower, upper = joined(store, "a", "b"), joined(store, "c", "a")
    with pytest.raises(Conflict, match="a later change builds on it"):
        store.write(undo.undo, lower, None)
    store.write(undo.undo, upper, None)
    store.write(undo.undo, lower, None)
    assert roots(store, "abc") == {name: name for name in "abc"}
    joined(store, "d", "b")
    with pytest.raises(Conflict, match="it was undone already"):
        store.write(undo.undo, lower, None)
    assert roots(store, "abcd") == {"a": "a", "b": "d", "c": "c", "d": "d"}


def test_a_join_undone_since_is_exported_and_imported(store: Database, tmp_path: Path) -> None:
    for name in "ab":
        store.write(skins.require, name)
    store.write(undo.undo, joined(store, "a", "b"), None)
    store.read(export.export, "a", tmp_path / "a.h5")
    with (tmp_path / "a.h5").open("rb") as stream:
        checked = import_checks.overview(read_overview(stream, "a.h5"))
    assert [change.action for change in checked.changes] == ["join", "undo"]


@pytest.mark.parametrize("away", ["palm", "hand"])
def test_neither_of_two_joined_skins_stays_put_away(store: Database, away: str) -> None:
    for name in ("palm", "hand"):
        store.write(skins.require, name)
    store.write(annotations.discard, away, "empty", None)
    join = joined(store, "palm", "hand")
    assert listed(store) == {"palm"}
    store.write(keep, "hand")
    assert listed(store) == {"palm"}
    store.write(undo.undo, join, None)
    assert listed(store) == {"palm", "hand"}


def test_arrivals_of_one_skin_do_not_wait_for_each_other(on_postgresql: Database) -> None:
    on_postgresql.write(skins.require, "palm")
    with on_postgresql.writing() as connection:
        keep(connection, "palm")
        other = threading.Thread(target=on_postgresql.write, args=(keep, "palm"))
        other.start()
        other.join(240)
        assert not other.is_alive()


def test_an_arrival_brings_back_a_skin_that_is_being_put_away(on_postgresql: Database) -> None:
    on_postgresql.write(skins.require, "palm")
    other = threading.Thread(target=on_postgresql.write, args=(keep, "palm"))
    with on_postgresql.writing() as connection:
        annotations.discard(connection, "palm", "empty", None)
        other.start()
        other.join(1)
        assert other.is_alive()
    other.join()
    assert listed(on_postgresql) == {"palm"}


def test_an_undo_and_a_change_of_one_campaign_wait_for_each_other(on_postgresql: Database) -> None:
    campaign_id = on_postgresql.write(keep, "palm")
    on_postgresql.write(annotations.of_campaign, campaign_id, {"remark": "wet"}, None)
    other = threading.Thread(target=on_postgresql.write, args=(undo.undo, last(on_postgresql), None))
    with on_postgresql.writing() as connection:
        campaigns.find(connection, campaign_id, lock=True)
        other.start()
        other.join(1)  # time to take its locks
        assert other.is_alive()
        campaigns.withdraw(connection, campaign_id, "wrong sphere", None)
    other.join()
    assert on_postgresql.read(campaigns.find, campaign_id).remark is None


def test_the_undo_of_a_correction_waits_for_a_model_of_the_skin_that_it_left(on_postgresql: Database) -> None:
    older, another = on_postgresql.write(keep, "palm"), on_postgresql.write(keep, "palm")
    asked = on_postgresql.write(diagnoses.ask, another, diagnoses.Basis("0" * 64, "1.0"), None)
    diagnosis = on_postgresql.read(diagnoses.find, asked.id)
    arrival = campaigns.NewCampaign(parse(campaign("of hand", sensors=1)), "hand")
    on_postgresql.write(campaigns.add, arrival, corrects=older, reason="it was the hand")
    correction = last(on_postgresql)
    with ThreadPoolExecutor() as threads, on_postgresql.writing() as connection:
        models.adopt(connection, "palm", diagnosis, None)
        undone = threads.submit(on_postgresql.write, undo.undo, correction, None)
        wait([undone], 1)  # time to take its locks
        assert not undone.done()
        connection.commit()
        with pytest.raises(Conflict, match="a model was adopted since"):
            undone.result(240)
