"""What is changed on the page of a campaign: its name, remark and tags, recordings excluded, the campaign withdrawn;
and such a change taken back.
"""

from collections.abc import Callable
from urllib.parse import quote

from fastapi import APIRouter, Request, Response

from service.dependencies import WRITE, CampaignId, Store, Table, sender
from service.pages.campaign.page import shown
from service.pages.shared.forms import Form, annotated, attempted, reason, see
from service.store import Database, annotations, campaigns
from service.usecases.campaigns import exclude as exclude_recording
from service.usecases.campaigns import take_back
from underskin.recordings import validation
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter(prefix="/campaigns/{campaign_id}", dependencies=WRITE)


@router.post("/annotate")
def annotate(request: Request, campaign_id: CampaignId, sent: Form, store: Store, table: Table) -> Response:
    """Change name, remark and tags."""

    def do() -> None:
        name = validation.name("name", sent.get("name", "").strip(), False)
        store.write(annotations.of_campaign, campaign_id, {"name": name, **annotated(sent)}, sender(request))

    return _done(request, campaign_id, store, table, "annotate", sent, do)


@router.post("/exclude")
def exclude(request: Request, campaign_id: CampaignId, sent: Form, store: Store, table: Table) -> Response:
    """Leave a recording out of all figures."""

    def do() -> None:
        exclude_recording(store, table, campaign_id, sent.get("recording", ""), reason(sent), sender(request))

    return _done(request, campaign_id, store, table, "exclude", sent, do)


@router.post("/withdraw")
def withdraw(request: Request, campaign_id: CampaignId, sent: Form, store: Store, table: Table) -> Response:
    """Leave the campaign out of all figures."""

    def do() -> None:
        store.write(campaigns.withdraw, campaign_id, reason(sent), sender(request))

    return _done(request, campaign_id, store, table, "withdraw", sent, do)


@router.post("/undo")
def undo(request: Request, campaign_id: CampaignId, sent: Form, store: Store, table: Table) -> Response:
    """Take a change back, while nothing builds on it."""

    def do() -> None:
        take_back(store, table, sent.get("change", ""), sender(request))

    return _done(request, campaign_id, store, table, "undo", sent, do)


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
