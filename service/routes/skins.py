"""Skins: listed, joined, their d33 over time; all that is kept of one as a file, and back."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request

from service.dependencies import Cursor, Limit, SkinId, Store, Table, sender
from service.middleware.json_bodies import JsonRoute
from service.schemas import skins as models
from service.store import skins
from service.usecases import d33_cache
from service.usecases import skins as usecase

router = APIRouter(prefix="/v1", tags=["skins"], route_class=JsonRoute)


@router.get("/skins", operation_id="skins", summary="Skins, by id")
def listed(
    store: Store,
    id_contains: Annotated[str | None, Query(description="Only those whose id contains this.")] = None,
    limit: Limit = 50,
    cursor: Cursor = None,
) -> models.SkinList:
    """Those joined to another are under that one."""
    rows = store.read(skins.listed, id_contains, cursor, limit + 1)
    page = [usecase.entry(row) for row in rows[:limit]]
    return models.SkinList(skins=page, next=rows[limit - 1].id if len(rows) > limit else None)


@router.get("/skins/{skin_id}", summary="One skin")
def skin(skin_id: SkinId, store: Store) -> models.SkinDetail:
    """With what was joined to it; of a joined skin, the one that it counts as."""
    return store.read(usecase.detail, skin_id)


@router.post("/skins/{skin_id}/join", summary="Join another skin to it")
def join_skins(request: Request, skin_id: SkinId, join: models.Join, store: Store) -> models.SkinDetail:
    """Two ids turned out to mean one skin: from now on figures of this one use the campaigns of both."""
    usecase.join(store, skin_id, join.skin_id, join.reason, sender(request))
    return store.read(usecase.detail, skin_id)


@router.get("/skins/{skin_id}/history", summary="d33 over time")
def skin_history(
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
    root = store.read(skins.require_root, skin_id)
    computed = d33_cache.complete(store, table, root) if model == "paper" else {}
    return usecase.history_by_model(store, table, root, model, computed)
