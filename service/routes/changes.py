"""Names, notes and tags; trials and empty skins put away; what was changed, and the way back."""

from collections.abc import Callable, Mapping
from typing import Annotated, Any

from fastapi import APIRouter, Path, Request
from pydantic import BaseModel
from sqlalchemy import Connection

from service.dependencies import CampaignId, SkinId, Store, Table, sender
from service.middleware.json_bodies import JsonRoute
from service.schemas import changes as models
from service.schemas.campaigns import CampaignDetail
from service.schemas.skins import SkinDetail
from service.store import annotations, campaigns, skins
from service.usecases import campaigns as of_campaigns
from service.usecases import changes as usecase
from service.usecases import changes as written
from service.usecases import skins as of_skins

router = APIRouter(prefix="/v1", route_class=JsonRoute)
_CHECKS: Mapping[str, Callable[[Any], str | None]] = {
    "name": written.name,
    "title": written.title,
    "remark": written.remark,
    "tags": written.tags,
}


@router.patch("/campaigns/{campaign_id}", summary="Rename it, or change its notes or tags", tags=["campaigns"])
def annotate_campaign(
    request: Request, campaign_id: CampaignId, annotation: models.CampaignAnnotation, store: Store
) -> CampaignDetail:
    """Changes what is sent and leaves the rest; its document keeps the name that it came with."""
    with store.writing() as connection:
        annotations.of_campaign(connection, campaign_id, _values(annotation), sender(request))
        return of_campaigns.detail(connection, campaign_id)


@router.patch("/skins/{skin_id}", summary="Name it, or change its notes or tags", tags=["skins"])
def annotate_skin(request: Request, skin_id: SkinId, annotation: models.SkinAnnotation, store: Store) -> SkinDetail:
    """Changes what is sent and leaves the rest; its id stays."""
    with store.writing() as connection:
        root = skins.require_root(connection, skin_id)
        annotations.of_skin(connection, root, _values(annotation), sender(request))
        return of_skins.detail(connection, root)


@router.post("/campaigns/{campaign_id}/discard", summary="Put a trial away", tags=["campaigns"])
def discard_campaign(
    request: Request, campaign_id: CampaignId, discarding: models.Discarding, store: Store
) -> CampaignDetail:
    """Withdrawn and in no list any more; it can still be read. 409 if it was diagnosed or is part of a correction."""
    with store.writing() as connection:
        annotations.discard_campaign(connection, campaign_id, discarding.reason, sender(request))
        return of_campaigns.detail(connection, campaign_id)


@router.post("/skins/{skin_id}/discard", summary="Put an empty skin away", tags=["skins"])
def discard_skin(request: Request, skin_id: SkinId, discarding: models.Discarding, store: Store) -> SkinDetail:
    """In no list until a campaign arrives for it; 409 where a campaign of it is in use."""
    with store.writing() as connection:
        root = skins.require_root(connection, skin_id)
        annotations.discard(connection, root, discarding.reason, sender(request))
        return of_skins.detail(connection, root)


@router.get("/campaigns/{campaign_id}/changes", summary="What was changed of it", tags=["campaigns"])
def campaign_changes(campaign_id: CampaignId, store: Store) -> models.Changes:
    """Who, when, why, and whether it can be undone; its exclusions are among them."""

    def read(connection: Connection) -> models.Changes:
        campaigns.find(connection, campaign_id)
        return models.Changes(changes=usecase.of_campaign(connection, campaign_id))

    return store.read(read)


@router.get("/skins/{skin_id}/changes", summary="What was changed of it", tags=["skins"])
def skin_changes(skin_id: SkinId, store: Store) -> models.Changes:
    """Of the skin itself and of those joined to it, withdrawn models among them, not of its campaigns."""

    def read(connection: Connection) -> models.Changes:
        return models.Changes(changes=usecase.of_skin(connection, skins.require_root(connection, skin_id)))

    return store.read(read)


@router.post("/changes/{change_id}/undo", summary="Undo a change", tags=["campaigns"])
def undo_change(
    request: Request,
    change_id: Annotated[str, Path(description="Id of a change, as `changes` of its campaign or skin list it.")],
    store: Store,
    table: Table,
) -> models.Change:
    """The change, taken back; both stay on record. 409 where something builds on it, or it was undone already."""
    of_campaigns.take_back(store, table, change_id, sender(request))
    return store.read(usecase.one, change_id)


def _values(annotation: BaseModel) -> dict[str, str | None]:
    """What was sent, as it is kept; raises InvalidInput."""
    return {name: _CHECKS[name](getattr(annotation, name)) for name in sorted(annotation.model_fields_set)}
