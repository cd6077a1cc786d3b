"""The forms that change stored data on the pages of a campaign and of a skin: names, notes and tags, exclusion,
withdrawal, discarding, joining, and the undoing of these."""

from collections.abc import Callable
from typing import Annotated
from urllib.parse import quote

from fastapi import APIRouter, Depends, Request, Response
from sqlalchemy import Connection

from service.dependencies import CampaignId, RunnerInUse, SkinId, Store, Table, sender
from service.pages import campaign, skin
from service.pages.shared.forms import FORM_OF_SESSION, Form, annotated, attempted, reason, see, signed
from service.problems import parsed
from service.schemas.diagnoses import AskForSkin
from service.schemas.skins import Join
from service.store import annotations, campaigns, changes, models, skins
from service.usecases import campaigns as of_campaigns
from service.usecases import changes as written
from service.usecases import diagnoses as diagnosis_usecase
from service.usecases import skins as of_skins

router = APIRouter()


class Change:
    """A form that was sent: its fields, and who signed it."""

    def __init__(self, request: Request, sent: Form, store: Store, table: Table) -> None:
        self.request, self.sent, self.store, self.table = request, sent, store, table

    def why(self) -> tuple[str, str | None]:
        """The reason as typed, and who gives it; raises InvalidInput."""
        return reason(self.sent), self.signed()

    def signed(self) -> str | None:
        """Who sent it; raises InvalidInput."""
        return signed(self.request, self.sent)

    def of_campaign(self, campaign_id: str, form: str, do: Callable[[], object]) -> Response:
        """Do it, and show the campaign; a form that is refused is shown again, with the reason."""
        refused = attempted(form, self.sent, do)
        if refused is None:
            return see(f"/campaigns/{quote(campaign_id, safe='')}")
        return campaign.campaign(self.request, campaign_id, self.store, self.table, refused=refused)

    def of_skin(self, skin_id: str, form: str, do: Callable[[], object]) -> Response:
        """The same of a skin."""
        refused = attempted(form, self.sent, do)
        if refused is None:
            return see(f"/skins/{quote(skin_id, safe='')}")
        return skin.skin(self.request, skin_id, self.store, self.table, refused=refused)

    def write_root(self, skin_id: str, change: Callable[..., object], *values: object) -> None:
        """Change the skin that an id counts as."""

        def write(connection: Connection) -> None:
            change(connection, skins.require_root(connection, skin_id), *values)

        self.store.write(write)


SentChange = Annotated[Change, Depends()]


@router.post("/campaigns/{campaign_id}/annotate")
def annotate_campaign(campaign_id: CampaignId, change: SentChange) -> Response:
    """Change name, remark and tags."""

    def do() -> None:
        values = {"name": written.name(change.sent.get("name", "")), **annotated(change.sent)}
        change.store.write(annotations.of_campaign, campaign_id, values, sender(change.request))

    return change.of_campaign(campaign_id, "annotate", do)


@router.post("/campaigns/{campaign_id}/exclude")
def exclude(campaign_id: CampaignId, change: SentChange) -> Response:
    """Exclude a recording from all figures."""

    def do() -> None:
        recording = change.sent.get("recording", "")
        of_campaigns.exclude(change.store, change.table, campaign_id, recording, *change.why())

    return change.of_campaign(campaign_id, "exclude", do)


@router.post("/campaigns/{campaign_id}/withdraw")
def withdraw(campaign_id: CampaignId, change: SentChange) -> Response:
    """Withdraw the campaign from all figures."""
    return change.of_campaign(
        campaign_id, "withdraw", lambda: change.store.write(campaigns.withdraw, campaign_id, *change.why())
    )


@router.post("/campaigns/{campaign_id}/discard")
def discard_campaign(campaign_id: CampaignId, change: SentChange) -> Response:
    """Remove a trial campaign from all lists."""
    return change.of_campaign(
        campaign_id, "discard", lambda: change.store.write(annotations.discard_campaign, campaign_id, *change.why())
    )


@router.post("/skins/{skin_id}/diagnosis", dependencies=[FORM_OF_SESSION])
def diagnose_together(request: Request, skin_id: SkinId, runner: RunnerInUse, store: Store, table: Table) -> Response:
    """Queue one diagnosis of all campaigns in use; an existing one is shown."""
    row = store.write(diagnosis_usecase.ask_of_skin, skin_id, table, sender(request), AskForSkin())
    runner.stir()
    return see(f"/diagnoses/{row.id}")


@router.post("/skins/{skin_id}/model/withdraw")
def withdraw_model(skin_id: SkinId, change: SentChange) -> Response:
    """Withdraw the model in force."""
    return change.of_skin(skin_id, "model", lambda: change.write_root(skin_id, models.withdraw, *change.why()))


@router.post("/skins/{skin_id}/join")
def join(skin_id: SkinId, change: SentChange) -> Response:
    """Count the other skin as this one from now on."""

    def do() -> None:
        why, who = change.why()
        demand = parsed(Join, {"skin_id": change.sent.get("other", "").strip(), "reason": why})
        of_skins.join(change.store, skin_id, demand.skin_id, demand.reason, who)

    return change.of_skin(skin_id, "join", do)


@router.post("/skins/{skin_id}/annotate")
def annotate_skin(skin_id: SkinId, change: SentChange) -> Response:
    """Change title, remark and tags."""

    def do() -> None:
        values = {"title": written.title(change.sent.get("title")), **annotated(change.sent)}
        change.write_root(skin_id, annotations.of_skin, values, sender(change.request))

    return change.of_skin(skin_id, "annotate", do)


@router.post("/skins/{skin_id}/discard")
def discard_skin(skin_id: SkinId, change: SentChange) -> Response:
    """Remove a skin without campaigns in use from all lists."""
    return change.of_skin(skin_id, "discard", lambda: change.write_root(skin_id, annotations.discard, *change.why()))


@router.post("/changes/{change_id}/undo")
def undo(change_id: str, change: SentChange) -> Response:
    """Take a change back, while nothing builds on it."""

    def read(connection: Connection) -> tuple[str | None, str]:
        row = changes.find(connection, change_id)
        return row.campaign_id, skins.require_root(connection, row.skin_id)

    def do() -> None:
        of_campaigns.take_back(change.store, change.table, change_id, change.signed())

    campaign_id, root = change.store.read(read)
    return change.of_skin(root, "undo", do) if campaign_id is None else change.of_campaign(campaign_id, "undo", do)
