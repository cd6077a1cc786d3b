"""All that is kept of a skin as one file, and back."""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fastapi import APIRouter, Request, Security
from fastapi.responses import FileResponse
from pydantic import BaseModel, Field, ValidationError
from starlette.background import BackgroundTask
from starlette.concurrency import run_in_threadpool

from service.dependencies import SkinId, Store, authorised
from service.problems import Refusal
from service.store import diagnosis_export, importing, skins
from service.store.engine import Database
from service.store.export import export
from service.uploads import Upload, full_disk_said, received
from underskin import InvalidInput
from underskin.errors import FileError
from underskin.recordings.skin_export import ExportedCampaign, read_campaigns, read_overview

router = APIRouter(prefix="/v1", tags=["skins"])

_MEDIA_TYPE = "application/x-hdf5"
_FILE: dict[str, Any] = {"content": {_MEDIA_TYPE: {"schema": {"type": "string", "format": "binary"}}}}
_AT_A_TIME = 8  # campaigns in memory


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
    with full_disk_said(), store.reading() as connection:
        root = skins.require_root(connection, skin_id)
        with tempfile.NamedTemporaryFile(dir=request.app.state.uploads.path, delete=False) as file:
            path = Path(file.name)
        try:
            export(connection, root, path)
        except BaseException:
            path.unlink()
            raise
    return FileResponse(
        path, media_type=_MEDIA_TYPE, filename=f"{root}.h5", background=BackgroundTask(path.unlink, missing_ok=True)
    )


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
        return await run_in_threadpool(_import, store, uploads[0])


def _import(store: Database, upload: Upload) -> Imported:
    label = upload.label or "the upload"
    with upload.path.open("rb") as stream:
        try:
            overview = read_overview(stream, label)
            diagnosed = diagnosis_export.checked(
                overview.diagnoses, overview.models, overview.campaigns, [row["id"] for row in overview.skins]
            )
            with store.reading() as connection:
                diagnosis_export.require_same(connection, diagnosed)
                present = importing.known(connection, overview)
                for campaign in _chunks(stream, label, present):
                    importing.require_same(connection, campaign)
            importing.add_skins(store, overview)
            missing = [name for name in overview.campaigns if name not in set(present)]
            for campaign in _chunks(stream, label, missing):
                importing.add(store, campaign)
            diagnosis_export.add(store, diagnosed)
        except FileError as error:
            raise InvalidInput("file", upload.label, f"{error.place}: {error.reason}".lstrip(": ")) from None
        except (ValidationError, KeyError, TypeError) as error:
            raise InvalidInput("file", upload.label, f"is not as underskin exports it: {error}") from None
    return Imported(skin_id=overview.skin, kept=len(missing), present=len(present))


def _chunks(stream: Any, label: str, names: list[str]) -> Iterator[ExportedCampaign]:
    for start in range(0, len(names), _AT_A_TIME):
        yield from read_campaigns(stream, label, names[start : start + _AT_A_TIME])
