"""d33 derived from campaigns, stored so that lists and histories need not read recordings."""

from collections.abc import Mapping, Sequence
from typing import Any

from sqlalchemy import ColumnElement, Connection, Table, delete, insert, select

from service.schemas.campaign_d33 import ANSWER_VERSION
from service.store import skins
from service.store.campaigns import CURRENT
from service.store.codec import compressed, decompressed
from service.store.tables import AnyRow, adopted_inversions, campaigns, inversions, sensor_d33


def find(connection: Connection, campaign: AnyRow, table_sha256: str) -> Any | None:
    """The stored answer for a campaign in its present state, with this table and software; None if there is none."""
    return _document(connection, inversions, _now(inversions, campaign, table_sha256))


def find_with_numbers(connection: Connection, campaign: AnyRow, table_sha256: str) -> tuple[Any, Any] | None:
    """The same with the numbers of the figures; None if either is missing."""
    query = select(inversions.c.document, inversions.c.numbers).where(_now(inversions, campaign, table_sha256))
    row = connection.execute(query.where(inversions.c.numbers.is_not(None))).first()
    return None if row is None else (decompressed(row.document), decompressed(row.numbers))


def _now(table: Table, campaign: Any, table_sha256: str) -> ColumnElement[bool]:
    """What was derived from a campaign, a row or the columns of the table of campaigns, as it is now."""
    return (
        (table.c.campaign == campaign.number)
        & (table.c.revision == campaign.revision)
        & (table.c.table_sha256 == table_sha256)
        & (table.c.answer_version == ANSWER_VERSION)
    )


def keep(
    connection: Connection,
    campaign: AnyRow,
    table_sha256: str,
    document: Any,
    numbers: Any,
    sensors: Mapping[str, tuple[float, float]],
) -> None:
    """Store an answer, the numbers of its figures, and d33 with its standard uncertainty [pC/N] by sensor, unless
    the campaign changed since."""
    derived = {"document": compressed(document), "numbers": compressed(numbers)}
    if not _replaced(connection, inversions, campaign, table_sha256, derived):
        return
    connection.execute(delete(sensor_d33).where(sensor_d33.c.campaign == campaign.number))
    values = [
        {"campaign": campaign.number, "sensor": name, "d33_pc_per_n": value, "d33_uncertainty_pc_per_n": uncertainty}
        for name, (value, uncertainty) in sensors.items()
    ]
    if values:
        connection.execute(insert(sensor_d33), values)


def find_adopted(connection: Connection, campaign: AnyRow, model_id: str, table_sha256: str) -> Any | None:
    """The answer kept for a campaign as it is now, with this model and table; None where there is none."""
    of_model = adopted_inversions.c.model_id == model_id
    return _document(connection, adopted_inversions, _now(adopted_inversions, campaign, table_sha256) & of_model)


def _document(connection: Connection, table: Table, which: ColumnElement[bool]) -> Any | None:
    blob = connection.execute(select(table.c.document).where(which)).scalar()
    return None if blob is None else decompressed(blob)


def keep_adopted(connection: Connection, campaign: AnyRow, model_id: str, table_sha256: str, document: Any) -> None:
    """Keep an answer under an adopted model, unless the campaign changed since."""
    derived = {"model_id": model_id, "document": compressed(document)}
    _replaced(connection, adopted_inversions, campaign, table_sha256, derived)


def _replaced(
    connection: Connection, table: Table, campaign: AnyRow, table_sha256: str, derived: Mapping[str, Any]
) -> bool:
    """Whether a campaign's row of the table was replaced: not where the campaign changed since."""
    # The id too: after a restore, a number may be another campaign's.
    same = (campaigns.c.number == campaign.number) & (campaigns.c.id == campaign.id)
    query = select(campaigns.c.revision).where(same).with_for_update()
    if connection.execute(query).scalar() != campaign.revision:
        return False
    connection.execute(delete(table).where(table.c.campaign == campaign.number))
    basis = {"revision": campaign.revision, "table_sha256": table_sha256, "answer_version": ANSWER_VERSION}
    connection.execute(insert(table), {"campaign": campaign.number, **basis, **derived})
    return True


def missing_of_skin(connection: Connection, root: str, table_sha256: str) -> Sequence[AnyRow]:
    """Rows of the skin's current campaigns whose d33 is not kept as they are now."""
    query = select(campaigns).outerjoin(inversions, fresh(table_sha256))
    query = query.where(inversions.c.campaign.is_(None), _current(root))
    return connection.execute(query.order_by(campaigns.c.number)).all()


def history(connection: Connection, root: str, table_sha256: str) -> Sequence[AnyRow]:
    """d33 by sensor of all current campaigns, as they are now, of a skin and of those joined to it, by arrival."""
    query = (
        select(
            campaigns.c.id,
            campaigns.c.recorded_at,
            campaigns.c.received_at,
            sensor_d33.c.sensor,
            sensor_d33.c.d33_pc_per_n,
            sensor_d33.c.d33_uncertainty_pc_per_n,
        )
        .join(inversions, fresh(table_sha256))
        .join(sensor_d33, sensor_d33.c.campaign == campaigns.c.number)
        .where(_current(root))
    )
    return connection.execute(query.order_by(campaigns.c.number, sensor_d33.c.sensor)).all()


def fresh(table_sha256: str) -> ColumnElement[bool]:
    """Joins a campaign with what was derived from it as it is now, with this table, by this software."""
    return _now(inversions, campaigns.c, table_sha256)


def _current(root: str) -> ColumnElement[bool]:
    return campaigns.c.skin_id.in_(skins.members(root)) & CURRENT
