"""Skins: listed, joined, their d33 over time; all that is kept of one as a file, and back."""

from typing import Annotated, Literal

import orjson
from fastapi import APIRouter, Query, Security
from sqlalchemy import Connection

from service.dependencies import SkinId, Store, Table, authorised
from service.middleware.unique_keys import JsonRoute
from service.problems import Refusal
from service.schemas import skins as models
from service.store import skins
from service.store.errors import Missing
from service.usecases import d33_cache, histories
from underskin import InvalidInput

router = APIRouter(prefix="/v1", tags=["skins"], route_class=JsonRoute)

WRITE = [Security(authorised, scopes=["write"])]


@router.get("/skins", operation_id="skins", summary="Skins, by id")
def listed(
    store: Store,
    id_contains: Annotated[str | None, Query(description="Only those whose id contains this.")] = None,
    limit: Annotated[int, Query(ge=1, le=200, description="How many on a page.")] = 50,
    cursor: Annotated[str | None, Query(description="`next` of the page before.")] = None,
) -> models.SkinList:
    """Those joined to another are under that one."""
    with store.reading() as connection:
        rows = skins.listed(connection, id_contains, cursor, limit + 1)
    page = [models.SkinEntry(id=row.id, created_at=row.created_at, campaigns=row.campaigns) for row in rows[:limit]]
    return models.SkinList(skins=page, next=rows[limit - 1].id if len(rows) > limit else None)


@router.get("/skins/{skin_id}", operation_id="skin", summary="One skin")
def one(skin_id: SkinId, store: Store) -> models.SkinDetail:
    """With what was joined to it; of a joined skin, the one that it counts as."""
    with store.reading() as connection:
        return _detail(connection, skin_id)


@router.post("/skins/{skin_id}/join", operation_id="join_skins", summary="Join another skin to it", dependencies=WRITE)
def join(skin_id: SkinId, join: models.Join, store: Store) -> models.SkinDetail:
    """Two ids turned out to mean one skin: from now on figures of this one use the campaigns of both."""
    if skin_id == join.skin_id:
        raise InvalidInput("skin_id", join.skin_id, "must be another skin")
    with store.writing() as connection:
        found = skins.lock(connection, [skin_id, join.skin_id])
        for name in (skin_id, join.skin_id):
            if name not in found:
                raise Missing(f"There is no skin {name!r}.")
            if found[name].root_id != name:
                raise Refusal(
                    409, f"Skin {name!r} was joined to {found[name].joined_to!r}: use {found[name].root_id!r}."
                )
        skins.join(connection, skin_id, join.skin_id, join.reason)
        return _detail(connection, skin_id)


@router.get("/skins/{skin_id}/history", operation_id="skin_history", summary="d33 over time")
def history(
    skin_id: SkinId,
    store: Store,
    table: Table,
    model: Annotated[
        Literal["paper", "adopted"], Query(description="`adopted`: d33 under the model in force of the skin.")
    ] = "paper",
) -> models.History:
    """d33 of each sensor in every current campaign, its trend and whether that is significant; all by one model.

    Campaigns that lack what an adopted model needs are left out, with the reason.
    """
    with store.reading() as connection:
        root = skins.require_root(connection, skin_id)
    if model == "adopted":
        return histories.adopted_history(store, table, root)
    d33_cache.complete(store, table, root)
    with store.reading() as connection:
        return histories.history(connection, root, table.sha256)


def _detail(connection: Connection, skin_id: str) -> models.SkinDetail:
    row = skins.find(connection, skins.require_root(connection, skin_id))
    assert row is not None
    rig = skins.rig_of(connection, row.id)
    return models.SkinDetail(
        id=row.id,
        created_at=row.created_at,
        joined=[histories.joined(other) for other in skins.joined_to(connection, row.id)],
        rig=None if rig is None else orjson.loads(rig),
    )
