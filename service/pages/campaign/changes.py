"""What is changed on the page of a campaign: recordings excluded, the campaign withdrawn."""

from urllib.parse import quote

from fastapi import APIRouter, Request, Response

from service.dependencies import WRITE, CampaignId, Store, Table
from service.pages.campaign.page import shown
from service.pages.shared.forms import Form, attempted, reason, see
from service.store import campaigns
from service.usecases.campaigns import exclude as exclude_recording

router = APIRouter(prefix="/campaigns/{campaign_id}", dependencies=WRITE)


@router.post("/exclude")
def exclude(request: Request, campaign_id: CampaignId, sent: Form, store: Store, table: Table) -> Response:
    """Leave a recording out of all figures."""
    refused = attempted(
        "exclude", sent, lambda: exclude_recording(store, table, campaign_id, sent.get("recording", ""), reason(sent))
    )
    return shown(request, campaign_id, store, table, refused=refused) if refused else _see(campaign_id)


@router.post("/withdraw")
def withdraw(request: Request, campaign_id: CampaignId, sent: Form, store: Store, table: Table) -> Response:
    """Leave the campaign out of all figures."""
    refused = attempted("withdraw", sent, lambda: store.write(campaigns.withdraw, campaign_id, reason(sent)))
    return shown(request, campaign_id, store, table, refused=refused) if refused else _see(campaign_id)


def _see(campaign_id: str) -> Response:
    return see(f"/campaigns/{quote(campaign_id, safe='')}")
