"""A change of a campaign or of a skin, taken back on the page that lists it."""

from urllib.parse import quote

from fastapi import APIRouter, Request, Response
from sqlalchemy import Connection

from service.dependencies import WRITE, Store, Table
from service.pages.campaign import page as campaign
from service.pages.shared.forms import Form, attempted, see, signed
from service.pages.skin import page as skin
from service.store import changes, skins
from service.usecases.campaigns import take_back

router = APIRouter(prefix="/changes/{change_id}", dependencies=WRITE)


@router.post("/undo")
def undo(request: Request, change_id: str, sent: Form, store: Store, table: Table) -> Response:
    """Take a change back, while nothing builds on it."""

    def read(connection: Connection) -> tuple[str | None, str]:
        change = changes.find(connection, change_id)
        return change.campaign_id, skins.require_root(connection, change.skin_id)

    campaign_id, root = store.read(read)
    refused = attempted("undo", sent, lambda: take_back(store, table, change_id, signed(request, sent)))
    if campaign_id is None:
        shown = skin.shown(request, root, store, table, refused=refused) if refused else None
        return shown or see(f"/skins/{quote(root, safe='')}")
    shown = campaign.shown(request, campaign_id, store, table, refused=refused) if refused else None
    return shown or see(f"/campaigns/{quote(campaign_id, safe='')}")
