"""Requests and changes on the page of a skin: joint diagnosis, model withdrawn, skins joined, title, remark and
tags, skin discarded."""

from collections.abc import Callable
from urllib.parse import quote

from fastapi import APIRouter, Request, Response
from sqlalchemy import Connection

from service.dependencies import WRITE, RunnerInUse, SkinId, Store, Table, sender
from service.pages.shared.forms import FORM_OF_SESSION, Form, annotated, attempted, reason, see, signed
from service.pages.skin.page import shown
from service.problems import parsed
from service.schemas.diagnoses import AskForSkin
from service.schemas.skins import Join
from service.store import Database, annotations, models, skins
from service.usecases import annotations as written
from service.usecases import diagnoses as diagnosis_usecase
from service.usecases import skins as usecase
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter(prefix="/skins/{skin_id}", dependencies=WRITE)


@router.post("/diagnosis", dependencies=[FORM_OF_SESSION])
def diagnose_together(request: Request, skin_id: SkinId, runner: RunnerInUse, store: Store, table: Table) -> Response:
    """Queue one diagnosis of all campaigns in use; an existing one is shown."""
    row = store.write(diagnosis_usecase.ask_of_skin, skin_id, table, sender(request), AskForSkin())
    runner.stir()
    return see(f"/diagnoses/{row.id}")


@router.post("/model/withdraw")
def withdraw_model(request: Request, skin_id: SkinId, sent: Form, store: Store, table: Table) -> Response:
    """Withdraw the model in force."""

    def do() -> None:
        _of_root(store, skin_id, models.withdraw, reason(sent), signed(request, sent))

    return _done(request, skin_id, store, table, "model", sent, do)


@router.post("/join")
def join(request: Request, skin_id: SkinId, sent: Form, store: Store, table: Table) -> Response:
    """Count the other skin as this one from now on."""

    def do() -> None:
        demand = parsed(Join, {"skin_id": sent.get("other", "").strip(), "reason": reason(sent)})
        usecase.join(store, skin_id, demand.skin_id, demand.reason, signed(request, sent))

    return _done(request, skin_id, store, table, "join", sent, do)


@router.post("/annotate")
def annotate(request: Request, skin_id: SkinId, sent: Form, store: Store, table: Table) -> Response:
    """Change title, remark and tags."""

    def do() -> None:
        values = {"title": written.title(sent.get("title")), **annotated(sent)}
        _of_root(store, skin_id, annotations.of_skin, values, sender(request))

    return _done(request, skin_id, store, table, "annotate", sent, do)


@router.post("/discard")
def discard(request: Request, skin_id: SkinId, sent: Form, store: Store, table: Table) -> Response:
    """Remove a skin without campaigns in use from all lists."""

    def do() -> None:
        _of_root(store, skin_id, annotations.discard, reason(sent), signed(request, sent))

    return _done(request, skin_id, store, table, "discard", sent, do)


def _of_root(store: Database, skin_id: str, change: Callable[..., object], *values: object) -> None:
    """Change the skin that an id counts as."""

    def write(connection: Connection) -> None:
        change(connection, skins.require_root(connection, skin_id), *values)

    store.write(write)


def _done(
    request: Request,
    skin_id: str,
    store: Database,
    table: SigmaTable,
    form: str,
    sent: dict[str, str],
    do: Callable[[], None],
) -> Response:
    refused = attempted(form, sent, do)
    if refused is not None:
        return shown(request, skin_id, store, table, refused=refused)
    return see(f"/skins/{quote(skin_id, safe='')}")
