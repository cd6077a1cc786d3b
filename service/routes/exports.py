"""All that is kept of a skin as one file, and back."""

import asyncio
from functools import partial
from typing import Any

from fastapi import APIRouter, Request, Response
from starlette.concurrency import run_in_threadpool

from service.dependencies import SkinId, Store
from service.ingest import skin_imports
from service.ingest.uploads import UploadFolder, received, split
from service.problems import Refusal
from service.routes.temporary_files import MadeFile, made_file
from service.schemas.skins import Imported
from service.store import Database, skins
from service.store.export import export

_AT_ONCE = asyncio.Semaphore(2)  # each holds a connection as long as it takes, and readers need some, too

router = APIRouter(prefix="/v1", tags=["skins"])

_MEDIA_TYPE = "application/x-hdf5"
_FILE: dict[str, Any] = {"content": {_MEDIA_TYPE: {"schema": {"type": "string", "format": "binary"}}}}


@router.get(
    "/skins/{skin_id}/export", summary="All that is kept of a skin", response_class=MadeFile, responses={200: _FILE}
)
async def export_skin(skin_id: SkinId, request: Request, store: Store) -> Response:
    """One HDF5 file (`skin-export/1`) with its campaigns in every state, those of skins joined to it, its rigs,
    diagnoses that have ended and models.
    """
    async with _AT_ONCE:
        return await run_in_threadpool(_exported, store, request, skin_id)


def _exported(store: Database, request: Request, skin_id: str) -> Response:
    with store.reading() as connection:
        root = skins.require_root(connection, skin_id)
        return made_file(request, f"{root}.h5", _MEDIA_TYPE, partial(export, connection, root))


@router.post(
    "/skins/import",
    summary="Bring in a skin that was exported",
    openapi_extra={
        "requestBody": {"required": True, "content": {"application/octet-stream": _FILE["content"][_MEDIA_TYPE]}}
    },
)
async def import_skin(request: Request, store: Store) -> Imported:
    """To the same state; what is here already must be the same, and is left. After a failure, send the file again."""
    folder: UploadFolder = request.app.state.uploads
    async with received(request, folder) as parts:
        _, uploads = await folder.threads.run(partial(split, parts))
        if len(uploads) != 1:
            raise Refusal(422, f"One file is imported at a time, not {len(uploads)}.")
        async with skin_imports.one_at_a_time:
            store.require_hope()
            return await run_in_threadpool(skin_imports.bring_in, store, uploads[0])
