"""What is asked for and changed on the page of a skin: diagnosed together, its model withdrawn, another one joined."""

from urllib.parse import quote

from fastapi import APIRouter, Request, Response

from service.dependencies import WRITE, RunnerInUse, SkinId, Store, Table, sender
from service.pages.shared.forms import OWN_FORM, Form, attempted, reason, see
from service.pages.skin.page import shown
from service.problems import parsed
from service.schemas.diagnoses import AskForSkin
from service.schemas.skins import Join
from service.store import Database, models, skins
from service.usecases import diagnoses as diagnosis_usecase
from service.usecases import skins as usecase

router = APIRouter(prefix="/skins/{skin_id}", dependencies=WRITE)


@router.post("/diagnosis", dependencies=[OWN_FORM])
def diagnose_together(request: Request, skin_id: SkinId, runner: RunnerInUse, store: Store, table: Table) -> Response:
    """Puts one diagnosis of all campaigns in use into the queue; one that there is already is shown."""
    row = store.write(diagnosis_usecase.ask_of_skin, skin_id, table, sender(request), AskForSkin())
    runner.stir()
    return see(f"/diagnoses/{row.id}")


@router.post("/model/withdraw")
def withdraw_model(request: Request, skin_id: SkinId, sent: Form, store: Store, table: Table) -> Response:
    """Has no model in force."""
    refused = attempted("model", sent, lambda: _withdraw(store, skin_id, reason(sent), sender(request)))
    return shown(request, skin_id, store, table, refused=refused) if refused else _see(skin_id)


@router.post("/join")
def join(request: Request, skin_id: SkinId, sent: Form, store: Store, table: Table) -> Response:
    """Count the other as this one from now on."""
    refused = attempted("join", sent, lambda: _join(store, skin_id, sent.get("other", "").strip(), reason(sent)))
    return shown(request, skin_id, store, table, refused=refused) if refused else _see(skin_id)


def _withdraw(store: Database, skin_id: str, why: str, withdrawn_from: str | None) -> None:
    with store.writing() as connection:
        models.withdraw(connection, skins.require_root(connection, skin_id), why, withdrawn_from)


def _join(store: Database, skin_id: str, other: str, why: str) -> None:
    asked = parsed(Join, {"skin_id": other, "reason": why})
    usecase.join(store, skin_id, asked.skin_id, asked.reason)


def _see(skin_id: str) -> Response:
    return see(f"/skins/{quote(skin_id, safe='')}")
