"""An uploaded file that is an exported skin: what is in it, what of it is here already, and its coming in."""

from urllib.parse import quote

from fastapi import Request, Response
from starlette.concurrency import run_in_threadpool

from service.ingest import skin_imports
from service.pages.shared import same_request
from service.pages.shared.html import page
from service.pages.upload.file_summary import FileSeen
from service.pages.upload.keep import all_told
from service.pages.upload.pending_uploads import Shelved
from service.pages.upload.skin_summary import MOST_LISTED, skin_seen
from service.store.engine import Database
from service.store.errors import Conflict
from underskin import InvalidInput
from underskin.recordings.skin_export import is_export

KIND = "exported skin"


def holds_skin(shelved: Shelved) -> bool:
    """Whether an upload is an exported skin: one comes alone."""
    first, *others = shelved.files
    if others:
        return False
    with first.path.open("rb") as stream:
        return is_export(stream, first.label or "the file")


async def look(store: Database, shelved: Shelved) -> None:
    """See what is in it; where it cannot be read, what is wrong is told as of any other file."""
    async with skin_imports.one:
        await run_in_threadpool(_look, store, shelved)


def shown(request: Request, shelved: Shelved) -> Response:
    """What would come in."""
    return page(
        request,
        "exported.html",
        shelved=shelved,
        found=shelved.skin_seen,
        file=shelved.files[0].label or "the file",
        most_listed=MOST_LISTED,
        same=same_request.exported_skin(request, shelved.files[0].label or "skin.h5"),
    )


async def bring_in(request: Request, store: Database, shelved: Shelved) -> None:
    """Keep what is not here; what kept it from being kept is told on the upload's page. Twice asked, kept once."""
    async with skin_imports.one:
        await run_in_threadpool(_bring_in, request, store, shelved)


def _look(store: Database, shelved: Shelved) -> None:
    try:
        shelved.skin_seen = skin_seen(skin_imports.look(store, shelved.files[0]))
    except InvalidInput as error:
        label = shelved.files[0].label or "the file"
        shelved.seen = [FileSeen(label, KIND, 0, (), (), all_told(error), (), (), None)]
        shelved.drawn = {0: []}


def _bring_in(request: Request, store: Database, shelved: Shelved) -> None:
    with shelved.lock:
        if shelved.kept_at is not None:
            return
        try:
            brought = skin_imports.bring_in(store, shelved.files[0])
        except Conflict:  # somebody changed what is here since it was looked at
            _look(store, shelved)
            return
        shelved.kept_at = f"/skins/{quote(brought.skin_id, safe='')}"
        request.app.state.shelf.empty(shelved)
