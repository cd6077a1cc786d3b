"""The record of changes to skins and campaigns: who, when, why, and the values before.

Rows are added and never altered; undoing a change is itself a change that names it.
"""

import secrets
from collections.abc import Mapping, Sequence
from typing import Any

from sqlalchemy import Connection, func, insert, select

from service.schemas.changes import Action
from service.store import times
from service.store.errors import Missing
from service.store.tables import AnyRow, changes, skins


def record(
    connection: Connection,
    action: Action,
    skin_id: str,
    made_from: str | None,
    *,
    campaign_id: str | None = None,
    recording: str | None = None,
    reason: str | None = None,
    before: Mapping[str, Any] | None = None,
    after: Mapping[str, Any] | None = None,
    undoes: str | None = None,
) -> None:
    """Record a change of a skin or of a campaign of it; `made_from`: name of the API key or, without one, as typed."""
    row = {
        "id": f"ch-{secrets.token_hex(8)}",
        "action": action,
        "skin_id": skin_id,
        "campaign_id": campaign_id,
        "recording": recording,
        "at": times.next_of(connection, [skin_id]),
        "made_from": made_from,
        "reason": reason,
        "before": dict(before or {}),
        "after": dict(after or {}),
        "undoes": undoes,
    }
    connection.execute(insert(changes), row)


def find(connection: Connection, change_id: str) -> AnyRow:
    """A change; raises Missing."""
    row = connection.execute(select(changes).where(changes.c.id == change_id)).first()
    if row is None:
        raise Missing(f"There is no change {change_id!r}.")
    return row


def of_campaign(connection: Connection, campaign_id: str) -> Sequence[AnyRow]:
    """Changes of a campaign and its recordings, the latest first."""
    query = select(changes).where(changes.c.campaign_id == campaign_id)
    return connection.execute(query.order_by(changes.c.number.desc())).all()


def of_skin(connection: Connection, root: str) -> Sequence[AnyRow]:
    """Changes of a skin itself and of those joined to it, without those of its campaigns, the latest first."""
    skin_ids = select(skins.c.id).where(skins.c.root_id == root)
    query = select(changes).where(changes.c.skin_id.in_(skin_ids), changes.c.campaign_id.is_(None))
    return connection.execute(query.order_by(changes.c.number.desc())).all()


def order_of_exclusions(connection: Connection, campaign_id: str) -> dict[str, int]:
    """The number of the latest exclusion of each recording of a campaign, by the recording's id."""
    excluding = (changes.c.campaign_id == campaign_id) & (changes.c.action == "exclude")
    query = select(changes.c.recording, func.max(changes.c.number).label("number")).where(excluding)
    return {row.recording: row.number for row in connection.execute(query.group_by(changes.c.recording))}
