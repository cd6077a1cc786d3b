"""An example skin with campaigns, kept by one click."""

import hashlib
from pathlib import Path

from fastapi import APIRouter, Request, Response
from sqlalchemy import Connection
from starlette.concurrency import run_in_threadpool

from service.dependencies import WRITE, Store, Table, sender
from service.ingest.accept import IngestOptions, accept
from service.ingest.uploads import Upload
from service.pages.shared.forms import FORM_OF_SESSION, see
from service.store import campaigns, skins
from service.usecases import d33_cache

router = APIRouter()

SKIN = "example"
_FOLDER = Path(__file__).parent / "example"


@router.post("/example", dependencies=[*WRITE, FORM_OF_SESSION])
async def load(request: Request, store: Store, table: Table) -> Response:
    """Store the example's campaigns once; again if all were withdrawn."""
    withdrawn = await run_in_threadpool(store.read, _withdrawn)
    if withdrawn is None:
        return see(f"/skins/{SKIN}")
    uploads = [_upload(file) for file in sorted(_FOLDER.glob("*.json"))]
    request_text = f"the example skin, {withdrawn} withdrawn" if withdrawn else "the example skin"
    settings = request.app.state.settings
    most = settings.max_body_bytes, settings.max_unfolded_bytes
    options = IngestOptions(SKIN, None, None, False, None, request_text, sender(request), *most)
    answer, _ = await run_in_threadpool(accept, store, uploads, options)
    await run_in_threadpool(d33_cache.derive, store, table, [campaign["id"] for campaign in answer["campaigns"]])
    return see(f"/skins/{SKIN}")


def _withdrawn(connection: Connection) -> int | None:
    """How many campaigns the skin had, all of which were withdrawn; None where one is in use."""
    skin = skins.find(connection, SKIN)
    rows = [] if skin is None else campaigns.of_skin(connection, skin.root_id)
    return None if any(campaigns.state(row) == "current" for row in rows) else len(rows)


def _upload(file: Path) -> Upload:
    return Upload(file, file.name, "file", hashlib.sha256(file.read_bytes()).hexdigest(), in_form=True)
