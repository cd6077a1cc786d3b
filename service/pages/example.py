"""An example skin with campaigns, kept by one click."""

import hashlib
from pathlib import Path

from fastapi import APIRouter, Request, Response
from starlette.concurrency import run_in_threadpool

from service import inverting
from service.accepting import Terms, accept
from service.dependencies import Store, Table
from service.pages.forms import WRITE, Form, see
from service.store import skins
from service.uploads import Upload

router = APIRouter()

SKIN = "example"
_FOLDER = Path(__file__).parent / "example"


@router.post("/example", dependencies=WRITE)
async def load(request: Request, sent: Form, store: Store, table: Table) -> Response:  # noqa: ARG001 -- checked by it
    """Keeps the example's campaigns, once however often it is asked for."""
    with store.reading() as connection:
        if skins.is_known(connection, SKIN):
            return see(f"/skins/{SKIN}")
    uploads = [_upload(file) for file in sorted(_FOLDER.glob("*.json"))]
    key = request.scope["key"]
    sender = None if key is None else key.name
    terms = Terms(SKIN, None, None, False, None, "the example skin", sender, request.app.state.settings.max_body_bytes)
    answer, _ = await run_in_threadpool(accept, store, uploads, terms)
    await run_in_threadpool(inverting.derive, store, table, [entry["id"] for entry in answer["campaigns"]])
    return see(f"/skins/{SKIN}")


def _upload(file: Path) -> Upload:
    return Upload(file, file.name, "file", hashlib.sha256(file.read_bytes()).hexdigest(), in_form=True)
