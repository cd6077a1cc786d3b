"""A clock that was ahead and is set back, or another server's that is ahead: what is done later counts as later."""

from collections.abc import Iterator
from datetime import datetime, timedelta

import pytest
from sqlalchemy import Column, select, update

from service.store import Database, campaigns, diagnoses, models, open_store
from service.store.tables import AnyRow
from service.store.tables import models as model_rows
from tests.support.store_server import Place, campaign
from underskin.recordings.campaign import parse

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
    """Give the latest row the time of a clock that is an hour ahead; that time."""
    number = column.table.c.number
    with store.writing() as connection:
        last, moment = connection.execute(select(number, column).order_by(number.desc()).limit(1)).one()
        later = datetime.fromisoformat(moment) + timedelta(hours=1)
        ahead = later.isoformat(timespec="microseconds").replace("+00:00", "Z")
        connection.execute(update(column.table).where(number == last).values({column.name: ahead}))
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
