"""Changes on the page of a campaign: name, remark and tags, excluded recordings, withdrawal and discarding."""

from collections.abc import Callable
from urllib.parse import quote

from fastapi import APIRouter, Request, Response

from service.dependencies import WRITE, CampaignId, Store, Table, sender
from service.pages.campaign.page import shown
from service.pages.shared.forms import Form, annotated, attempted, reason, see, signed
from service.store import Database, annotations, campaigns
from service.usecases import annotations as written
from service.usecases.campaigns import exclude as exclude_recording
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter(prefix="/campaigns/{campaign_id}", dependencies=WRITE)


@router.post("/annotate")
def annotate(request: Request, campaign_id: CampaignId, sent: Form, store: Store, table: Table) -> Response:
    """Change name, remark and tags."""

    def do() -> None:
        values = {"name": written.name(sent.get("name", "")), **annotated(sent)}
        store.write(annotations.of_campaign, campaign_id, values, sender(request))

    return _done(request, campaign_id, store, table, "annotate", sent, do)


@router.post("/exclude")
def exclude(request: Request, campaign_id: CampaignId, sent: Form, store: Store, table: Table) -> Response:
    """Exclude a recording from all figures."""

    def do() -> None:
        exclude_recording(store, table, campaign_id, sent.get("recording", ""), reason(sent), signed(request, sent))

    return _done(request, campaign_id, store, table, "exclude", sent, do)


@router.post("/withdraw")
def withdraw(request: Request, campaign_id: CampaignId, sent: Form, store: Store, table: Table) -> Response:
    """Withdraw the campaign from all figures."""

    def do() -> None:
        store.write(campaigns.withdraw, campaign_id, reason(sent), signed(request, sent))

    return _done(request, campaign_id, store, table, "withdraw", sent, do)


@router.post("/discard")
def discard(request: Request, campaign_id: CampaignId, sent: Form, store: Store, table: Table) -> Response:
    """Remove a trial campaign from all lists."""

    def do() -> None:
        store.write(annotations.discard_campaign, campaign_id, reason(sent), signed(request, sent))

    return _done(request, campaign_id, store, table, "discard", sent, do)


def _done(
    request: Request,
    campaign_id: str,
    store: Database,
    table: SigmaTable,
    form: str,
    sent: dict[str, str],
    do: Callable[[], None],
) -> Response:
    refused = attempted(form, sent, do)
    if refused is not None:
        return shown(request, campaign_id, store, table, refused=refused)
    return see(f"/campaigns/{quote(campaign_id, safe='')}")
