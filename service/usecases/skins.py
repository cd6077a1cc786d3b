"""Skins: described, and joined where two ids mean one."""

import orjson
from sqlalchemy import Connection

from service.problems import Refusal
from service.schemas.skins import SkinDetail
from service.store import Database, Missing, skins
from service.usecases import histories
from underskin.errors import conflicting


def join(store: Database, skin_id: str, other: str, reason: str) -> None:
    """Count `other` as `skin_id` from now on; raises InvalidInput, Missing, or Refusal where one was joined before."""
    if skin_id == other:
        raise conflicting("skin_id", other, "must be another skin")
    with store.writing() as connection:
        rows = skins.lock(connection, [skin_id, other])
        for name in (skin_id, other):
            if name not in rows:
                raise Missing(f"There is no skin {name!r}.")
            if rows[name].root_id != name:
                raise Refusal(409, f"Skin {name!r} was joined to {rows[name].joined_to!r}: use {rows[name].root_id!r}.")
        skins.join(connection, skin_id, other, reason)


def detail(connection: Connection, skin_id: str) -> SkinDetail:
    """A skin and those joined to it; of a joined one, the skin that it counts as. Raises Missing."""
    row = skins.find(connection, skins.require_root(connection, skin_id))
    assert row is not None
    rig = skins.rig_of(connection, row.id)
    return SkinDetail(
        id=row.id,
        created_at=row.created_at,
        joined=[histories.joined(other) for other in skins.joined_to(connection, row.id)],
        rig=None if rig is None else orjson.loads(rig),
    )
