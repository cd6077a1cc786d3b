"""Skins: made by the first campaign that names them, joined where two names mean one skin."""

import secrets
from collections.abc import Collection, Sequence
from typing import Any

from sqlalchemy import ColumnElement, Connection, ScalarSelect, Select, func, insert, literal, or_, select, update

from service.store import changes
from service.store.engine import upsert
from service.store.errors import Missing
from service.store.tables import AnyRow, campaigns, rigs, skins
from service.store.times import now
from underskin.errors import wrong_type

_LONGEST_ID = 200


def require_usable(field: str, skin_id: str) -> None:
    """Refuses an id that cannot be part of an address (InvalidInput)."""
    plain = skin_id.isprintable() and "/" not in skin_id and skin_id not in (".", "..")
    if not plain or not skin_id.strip() or len(skin_id) > _LONGEST_ID:
        raise wrong_type(field, skin_id, f"must be a printable text of 1 to {_LONGEST_ID} characters without /")


def require(connection: Connection, skin_id: str | None) -> str:
    """`skin_id`, or a new one where there is none; the skin is there afterwards, also where it was put away."""
    skin_id = skin_id or f"skin-{secrets.token_hex(6)}"
    row = {"id": skin_id, "root_id": skin_id, "created_at": now()}
    connection.execute(upsert(connection, skins).on_conflict_do_nothing(), row)
    bring_back(connection, require_root(connection, skin_id))
    return skin_id


def bring_back(connection: Connection, root: str) -> None:
    """Have a skin in lists again that was put away. Until the transaction ends nobody can put it away; others may keep
    something of it."""
    query = select(skins.c.discarded_at).where(skins.c.id == root).with_for_update(read=True, key_share=True)
    if connection.execute(query).scalar() is not None:
        connection.execute(update(skins).where(skins.c.id == root).values(discarded_at=None))


def find(connection: Connection, skin_id: str) -> AnyRow | None:
    """The row of a skin."""
    return connection.execute(select(skins).where(skins.c.id == skin_id)).first()


def require_root(connection: Connection, skin_id: str) -> str:
    """The id of the skin that `skin_id` counts as; raises Missing."""
    row = find(connection, skin_id)
    if row is None:
        raise Missing(f"There is no skin {skin_id!r}.")
    return str(row.root_id)


def are_joined(connection: Connection, first: str, second: str) -> bool:
    """Whether two ids mean one skin: they are the same, or were joined."""
    rows = [(name, find(connection, name)) for name in (first, second)]
    return len({name if row is None else row.root_id for name, row in rows}) == 1


def root_of(skin_id: str) -> ScalarSelect[Any]:
    """The id of the skin that `skin_id` was joined to in the end, or its own."""
    return select(skins.c.root_id).where(skins.c.id == skin_id).scalar_subquery()


def members(root: str | ScalarSelect[Any]) -> Select[Any]:
    """Ids of a skin and of all joined to it."""
    return select(skins.c.id).where(skins.c.root_id == root)


def joined_to(connection: Connection, root: str) -> Sequence[AnyRow]:
    """Rows of the skins that were joined to `root`."""
    query = select(skins).where(skins.c.root_id == root, skins.c.id != root).order_by(skins.c.id)
    return connection.execute(query).all()


def listed(connection: Connection, contains: str | None, after: str | None, limit: int) -> Sequence[AnyRow]:
    """Skins by id, without those joined to another, with how many campaigns each has."""
    query = _with_campaigns()
    if contains is not None:
        query = query.where(called(contains))
    if after is not None:
        query = query.where(skins.c.id > after)
    return connection.execute(query.limit(limit)).all()


def of_ids(connection: Connection, ids: Collection[str]) -> Sequence[AnyRow]:
    """Those of `listed` that have these ids."""
    return connection.execute(_with_campaigns().where(skins.c.id.in_(ids))).all()


def _with_campaigns() -> Select[Any]:
    member = skins.alias("member")
    counted = (
        select(func.count(campaigns.c.number))
        .select_from(campaigns.join(member, campaigns.c.skin_id == member.c.id))
        .where(member.c.root_id == skins.c.id)
        .scalar_subquery()
    )
    query = select(skins, counted.label("campaigns")).where(skins.c.root_id == skins.c.id)
    return query.where(skins.c.discarded_at.is_(None)).order_by(skins.c.id)


def called(contains: str) -> ColumnElement[bool]:
    """Whether a skin's id, title or tags contain a text, in capitals or not."""
    texts = (skins.c.id, skins.c.title, skins.c.tags)
    return or_(*(func.lower(text).contains(contains.lower(), autoescape=True) for text in texts))


def join(connection: Connection, skin_id: str, other: str, reason: str, joined_from: str | None) -> None:
    """Count `other`, and all joined to it, as `skin_id` from now on; both are their own roots, and neither stays put
    away."""
    for root in (skin_id, other):
        bring_back(connection, root)
    counted = list(connection.execute(members(other)).scalars())
    before = {"skin_id": other, "members": counted}
    connection.execute(update(skins).where(skins.c.root_id == other).values(root_id=skin_id))
    joined = {"joined_to": skin_id, "joined_at": now(), "join_reason": reason, "joined_from": joined_from}
    connection.execute(update(skins).where(skins.c.id == other).values(**joined))
    changes.record(connection, "join", skin_id, joined_from, reason=reason, before=before)


def lock(connection: Connection, ids: Sequence[str]) -> dict[str, AnyRow]:
    """Rows of skins by id, locked until the transaction ends."""
    query = select(skins).where(skins.c.id.in_(ids)).order_by(skins.c.id).with_for_update()
    return {row.id: row for row in connection.execute(query)}


def keep_rig(connection: Connection, skin_id: str, document: str) -> None:
    """Keep a rig description with a skin, unless it is the one already in use."""
    if rig_of(connection, skin_id) != document:
        row = {"skin_id": skin_id, "document": document, "created_at": now()}
        connection.execute(insert(rigs), row)


def rig_origin(connection: Connection, skin_id: str) -> AnyRow | None:
    """Of the rig description that `rig_of` gives, when it was kept (`created_at`), and the `file` of the campaign that
    it came with; None where there is none."""
    counted = members(root_of(skin_id))
    row = connection.execute(
        select(rigs.c.created_at).where(rigs.c.skin_id.in_(counted)).order_by(rigs.c.number.desc()).limit(1)
    ).first()
    if row is None:
        return None
    came_with = (
        select(campaigns.c.source)
        .where(campaigns.c.skin_id.in_(counted), campaigns.c.received_at <= row.created_at)
        .order_by(campaigns.c.received_at.desc())
        .limit(1)
        .scalar_subquery()
    )
    return connection.execute(select(literal(row.created_at).label("created_at"), came_with.label("file"))).first()


def rig_of(connection: Connection, skin_id: str) -> str | None:
    """The latest rig description of a skin, or of those it is joined with; None where there is none."""
    query = select(rigs.c.document).where(rigs.c.skin_id.in_(members(root_of(skin_id))))
    document: str | None = connection.execute(query.order_by(rigs.c.number.desc()).limit(1)).scalar()
    return document
