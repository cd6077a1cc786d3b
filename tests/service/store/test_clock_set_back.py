"""A clock that was ahead and is set back, or another server's that is ahead: what is done later counts as later."""

from collections.abc import Callable, Iterator
from datetime import datetime, timedelta

import pytest
from sqlalchemy import Column, func, select, update

from service.store import Conflict, Database, campaigns, diagnosed_together, diagnoses, models, open_store, skins, undo
from service.store.diagnosed_together import Together
from service.store.tables import AnyRow, recordings
from service.store.tables import changes as change_rows
from service.store.tables import diagnoses as diagnosis_rows
from service.store.tables import models as model_rows
from tests.support.store_server import Place, campaign
from underskin.recordings.campaign import parse

BACKEND = "postgresql"
BASIS = diagnoses.Basis("0" * 64, "1.0")


@pytest.fixture
def store(place: Place) -> Iterator[Database]:
    opened = open_store(place.database_url, place.folder)
    yield opened
    opened.close()


def kept(store: Database, name: str, skin: str = "palm") -> str:
    """The id of a campaign."""
    return store.write(campaigns.add, campaigns.NewCampaign(parse(campaign(name, sensors=1)), skin))[0]


def asked(store: Database, campaign_id: str) -> AnyRow:
    """The diagnosis of a campaign."""
    return store.write(diagnoses.ask, campaign_id, BASIS, None)


def by_a_clock_ahead(store: Database, column: Column[str]) -> str:
    """Give the latest of these times, the one of a clock that is an hour ahead; that."""
    with store.writing() as connection:
        moment = connection.execute(select(func.max(column))).scalar_one()
        later = datetime.fromisoformat(moment) + timedelta(hours=1)
        ahead = later.isoformat(timespec="microseconds").replace("+00:00", "Z")
        connection.execute(update(column.table).where(column == moment).values({column.name: ahead}))
    return ahead


def test_a_model_adopted_after_a_clock_was_set_back_is_in_force(store: Database) -> None:
    first, second = (asked(store, kept(store, name)) for name in ("monday", "tuesday"))
    store.write(models.adopt, "palm", first, None)
    ahead = by_a_clock_ahead(store, model_rows.c.adopted_at)
    adopted = store.write(models.adopt, "palm", second, None)
    assert (adopted.id, adopted.model_version) == (second.id, 2)
    assert adopted.model_adopted_at > ahead
    assert store.write(models.adopt, "palm", second, None).model_id == adopted.model_id
    assert [row.id for row in store.read(models.of_skin, "palm")] == [second.id, first.id]
    assert [row.id for row in store.read(models.all_in_force)] == [second.id]
    store.write(models.withdraw, "palm", "wrong diagnosis", None)
    assert store.write(models.adopt, "palm", first, None).model_version == 3


def test_a_diagnosis_leaves_out_what_was_excluded_when_it_was_asked_for(store: Database) -> None:
    campaign_id = kept(store, "monday")
    store.write(campaigns.exclude, campaign_id, "s0-2N", "cable loose", None)
    by_a_clock_ahead(store, recordings.c.excluded_at)
    diagnosis = asked(store, campaign_id)
    store.write(campaigns.exclude, campaign_id, "s0-1N", "slipped", None)
    campaign_then, excluded = store.read(diagnoses.campaign_of, diagnosis)
    assert [left.recording for left in excluded] == ["s0-2N"]
    assert [recording.id for recording in campaign_then.recordings] == ["s0-1N"]


def last_change(store: Database) -> str:
    query = select(change_rows.c.id).order_by(change_rows.c.number.desc()).limit(1)
    return str(store.read(lambda connection: connection.execute(query).scalar_one()))


def excluded(store: Database, campaign_id: str) -> str:
    store.write(campaigns.exclude, campaign_id, "s0-2N", "cable loose", None)
    return campaign_id


def joined(store: Database, campaign_id: str) -> str:
    store.write(skins.require, "hand")
    store.write(skins.join, "palm", "hand", "one skin", None)
    return campaign_id


def corrected_to_another_skin(store: Database, campaign_id: str) -> str:
    arrival = campaigns.NewCampaign(parse(campaign("of finger", sensors=1)), "finger")
    return store.write(campaigns.add, arrival, corrects=campaign_id, reason="it was the finger")[0]


def asked_with_others(store: Database, _: str) -> None:
    """A diagnosis of all campaigns of the skin and of another one."""
    kept(store, "tuesday")
    kept(store, "of thumb", "thumb")
    with store.writing() as connection:
        members = [one for skin in ("palm", "thumb") for one in diagnosed_together.usable(connection, skin)]
        diagnoses.ask_together(connection, Together("fleet", "hands", members, ["palm", "thumb"]), BASIS, None)


Change = Callable[[Database, str], str]  # of a store's campaign; the one that is in use then


@pytest.mark.parametrize("diagnose", [asked, asked_with_others])
@pytest.mark.parametrize("change", [excluded, joined, corrected_to_another_skin])
def test_a_change_by_a_clock_ahead_is_not_undone_once_diagnosed(
    store: Database, change: Change, diagnose: Callable[[Database, str], object]
) -> None:
    in_use = change(store, kept(store, "monday"))
    by_a_clock_ahead(store, change_rows.c.at)
    diagnose(store, in_use)
    with pytest.raises(Conflict, match="it was diagnosed since"):
        store.write(undo.undo, last_change(store), None)


@pytest.mark.parametrize("change", [excluded, joined])
def test_a_change_after_a_diagnosis_by_a_clock_ahead_is_undone(store: Database, change: Change) -> None:
    campaign_id = kept(store, "monday")
    asked(store, campaign_id)
    by_a_clock_ahead(store, diagnosis_rows.c.asked_at)
    change(store, campaign_id)
    store.write(undo.undo, last_change(store), None)
    assert store.read(campaigns.find, campaign_id).excluded == 0
    assert store.read(skins.joined_to, "palm") == []
