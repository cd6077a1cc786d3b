"""Annotations of skins and campaigns: name, remark, tags. Also discarding: skins without campaigns in use and campaigns
on which nothing builds are hidden from lists but remain readable."""

from collections.abc import Mapping

from sqlalchemy import Connection, func, select, update

from service.store import campaigns as kept_campaigns
from service.store import changes, skins
from service.store.errors import Conflict, Missing
from service.store.tables import AnyRow, campaigns, diagnosed_campaigns, diagnoses
from service.store.tables import skins as skin_rows
from service.store.times import now

OF_CAMPAIGN = ("name", "remark", "tags")
OF_SKIN = ("title", "remark", "tags")


def of_campaign(
    connection: Connection, campaign_id: str, values: Mapping[str, str | None], made_from: str | None
) -> None:
    """Change some of `OF_CAMPAIGN`; nothing is recorded if nothing differs. Raises Missing."""
    row = kept_campaigns.find(connection, campaign_id, lock=True)
    after = {name: value for name, value in values.items() if getattr(row, name) != value}
    if after:
        before = {name: getattr(row, name) for name in after}
        connection.execute(update(campaigns).where(campaigns.c.id == campaign_id).values(**after))
        changes.record(
            connection, "annotate", row.skin_id, made_from, campaign_id=campaign_id, before=before, after=after
        )


def of_skin(connection: Connection, root: str, values: Mapping[str, str | None], made_from: str | None) -> None:
    """Change some of `OF_SKIN`; nothing is recorded if nothing differs. Raises Missing."""
    row = skins.lock(connection, [root]).get(root)
    if row is None:
        raise Missing(f"There is no skin {root!r}.")
    after = {name: value for name, value in values.items() if getattr(row, name) != value}
    if after:
        before = {name: getattr(row, name) for name in after}
        connection.execute(update(skin_rows).where(skin_rows.c.id == root).values(**after))
        changes.record(connection, "annotate", root, made_from, before=before, after=after)


def discard_campaign(connection: Connection, campaign_id: str, reason: str, made_from: str | None) -> None:
    """Discard and withdraw a campaign; raises Missing, or Conflict if something builds on it."""
    row = kept_campaigns.find(connection, campaign_id, lock=True)
    builds_on = _builds_on(connection, row)
    if builds_on is not None:
        raise Conflict(f"Campaign {campaign_id!r} {builds_on}.")
    after: dict[str, str | None] = {"discarded_at": now()}
    if row.withdrawn_at is None:
        after |= {"withdrawn_at": after["discarded_at"], "withdraw_reason": reason, "withdrawn_from": made_from}
    before = {name: getattr(row, name) for name in after}
    values = {**after, "revision": campaigns.c.revision + 1}
    connection.execute(update(campaigns).where(campaigns.c.id == campaign_id).values(**values))
    changes.record(
        connection,
        "discard",
        row.skin_id,
        made_from,
        campaign_id=campaign_id,
        reason=reason,
        before=before,
        after=after,
    )


def may_be_discarded(connection: Connection, row: AnyRow) -> bool:
    """Whether nothing builds on a campaign and it is not discarded."""
    return _builds_on(connection, row) is None


def _builds_on(connection: Connection, row: AnyRow) -> str | None:
    """Why a campaign cannot be discarded; None if it can."""
    if row.discarded_at is not None:
        return "was discarded already"
    if row.corrects is not None or row.corrected_by is not None:
        return "is part of a correction: withdraw it"
    of_single = select(diagnoses.c.number).where(diagnoses.c.campaign == row.number)
    together = select(diagnosed_campaigns.c.diagnosis).where(diagnosed_campaigns.c.campaign == row.number)
    diagnosed = any(connection.execute(query.limit(1)).first() is not None for query in (of_single, together))
    return "was diagnosed: withdraw it" if diagnosed else None


def discard(connection: Connection, root: str, reason: str, made_from: str | None) -> None:
    """Discard a skin; raises Conflict if a campaign of it is in use, or if it is discarded already."""
    row = skins.lock(connection, [root])[root]
    if row.discarded_at is not None:
        raise Conflict(f"Skin {root!r} was discarded already.")
    used = in_use(connection, root)
    if used:
        raise Conflict(f"Skin {root!r} has {used} campaigns in use: withdraw them first.")
    after = {"discarded_at": now()}
    connection.execute(update(skin_rows).where(skin_rows.c.id == root).values(**after))
    before = {"discarded_at": None}
    changes.record(connection, "discard", root, made_from, reason=reason, before=before, after=after)


def in_use(connection: Connection, root: str) -> int:
    """Number of campaigns of a skin that figures use."""
    query = select(func.count()).select_from(campaigns)
    query = query.where(campaigns.c.skin_id.in_(skins.members(root)), kept_campaigns.CURRENT)
    return int(connection.execute(query).scalar_one())
