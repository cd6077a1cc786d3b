"""All that is kept of a skin as one file, and back."""

import asyncio
from collections.abc import Iterator
from functools import partial
from typing import Any, BinaryIO

from fastapi import APIRouter, Request, Security
from fastapi.responses import FileResponse
from pydantic import BaseModel, Field, ValidationError
from starlette.concurrency import run_in_threadpool

from service.dependencies import SkinId, Store, authorised
from service.made_files import made_file
from service.problems import Refusal
from service.store import diagnosis_export, import_checks, importing, skins
from service.store.engine import Database
from service.store.export import export
from service.uploads import Upload, received
from underskin import InvalidInput
from underskin.errors import FileError
from underskin.recordings.skin_export import ExportedCampaign, read_campaigns, read_overview

router = APIRouter(prefix="/v1", tags=["skins"])

_MEDIA_TYPE = "application/x-hdf5"
_FILE: dict[str, Any] = {"content": {_MEDIA_TYPE: {"schema": {"type": "string", "format": "binary"}}}}
_AT_A_TIME = 8  # campaigns in memory
_one = asyncio.Semaphore(1)  # imports at a time


class Imported(BaseModel):
    """What an import brought."""

    skin_id: str = Field(description="The skin.")
    kept: int = Field(description="How many campaigns are new here.")
    present: int = Field(description="How many were here already, the same.")


@router.get(
    "/skins/{skin_id}/export",
    operation_id="export_skin",
    summary="All that is kept of a skin",
    response_class=FileResponse,
    responses={200: _FILE},
)
def export_skin(skin_id: SkinId, request: Request, store: Store) -> FileResponse:
    """One HDF5 file (`skin-export/1`) with its campaigns in every state, those of skins joined to it, its rigs,
    diagnoses that have ended and models.
    """
    with store.reading() as connection:
        root = skins.require_root(connection, skin_id)
        return made_file(request.app.state.uploads, f"{root}.h5", _MEDIA_TYPE, partial(export, connection, root))


@router.post(
    "/skins/import",
    operation_id="import_skin",
    summary="Bring in a skin that was exported",
    dependencies=[Security(authorised, scopes=["write"])],
    openapi_extra={
        "requestBody": {"required": True, "content": {"application/octet-stream": _FILE["content"][_MEDIA_TYPE]}}
    },
)
async def import_skin(request: Request, store: Store) -> Imported:
    """To the same state; what is here already must be the same, and is left. After a failure, send the file again."""
    async with received(request, request.app.state.uploads) as uploads:
        if len(uploads) != 1:
            raise Refusal(422, f"One file is imported at a time, not {len(uploads)}.")
        async with _one:
            return await run_in_threadpool(_import, store, uploads[0])


def _import(store: Database, upload: Upload) -> Imported:
    label = upload.label or "the upload"
    with upload.path.open("rb") as stream:
        try:
            overview = read_overview(stream, label)
            checked = import_checks.overview(overview)
            diagnosed = diagnosis_export.checked(
                overview.diagnoses, overview.models, overview.campaigns, [row["id"] for row in overview.skins]
            )
            with store.reading() as connection:
                diagnosis_export.require_same(connection, diagnosed)
                importing.require_joined_alike(connection, checked.skins)
                present = importing.known(connection, overview.campaigns)
            for name, campaign in _campaigns(stream, label, overview.campaigns):  # all, before the first is kept
                if name not in present:
                    import_checks.campaign(campaign, name, checked.skins)
                    continue
                with store.reading() as connection:
                    importing.require_same(connection, name, campaign)
            importing.add_skins(store, checked)
            missing = [name for name in overview.campaigns if name not in present]
            for name, campaign in _campaigns(stream, label, missing):
                importing.add(store, import_checks.campaign(campaign, name, checked.skins))
            diagnosis_export.add(store, diagnosed)
        except FileError as error:
            raise InvalidInput("file", upload.label, f"{error.place}: {error.reason}".lstrip(": ")) from None
        except (ValidationError, KeyError, TypeError) as error:
            raise InvalidInput("file", upload.label, f"is not as underskin exports it: {str(error)[:500]}") from None
    return Imported(skin_id=overview.skin, kept=len(missing), present=len(present))


def _campaigns(stream: BinaryIO, label: str, names: list[str]) -> Iterator[tuple[str, ExportedCampaign]]:
    for start in range(0, len(names), _AT_A_TIME):
        some = names[start : start + _AT_A_TIME]
        yield from zip(some, read_campaigns(stream, label, some), strict=True)
