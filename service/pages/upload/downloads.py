"""Downloads of an upload that is not stored: its rig description, channels and FRFs."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import orjson
from fastapi import APIRouter, Request, Response

from service.ingest.reading import InspectedFile
from service.pages.shared.downloads import Numbers, attachment, downloadable
from service.pages.upload.figures import lines_columns, trace_columns
from service.pages.upload.looking import in_turn, looked
from service.pages.upload.of_session import Pending
from service.pages.upload.pending_uploads import PendingUpload
from service.store import Missing

router = APIRouter(prefix="/upload")


@router.get("/{upload_id}/rig.json")
def rig_json(pending: Pending) -> Response:
    """The rig description in use."""
    if pending.rig is None:
        raise Missing("There is no rig description yet.")
    content = orjson.dumps(pending.rig.document, option=orjson.OPT_INDENT_2)
    return attachment("rig.json", content, "application/json")


@downloadable(router, "/{upload_id}/{file}/traces")
async def traces_csv(request: Request, pending: Pending, file: int) -> Numbers:
    """The channels of a file's first part."""
    return await in_turn(_csv, "traces", trace_columns, request, pending, file)


@downloadable(router, "/{upload_id}/{file}/frf")
async def frf_csv(request: Request, pending: Pending, file: int) -> Numbers:
    """The FRFs of a file."""
    return await in_turn(_csv, "frf", lines_columns, request, pending, file)


def _csv(
    name: str,
    columns: Callable[[InspectedFile], Mapping[str, Sequence[Any]]],
    request: Request,
    pending: PendingUpload,
    file: int,
) -> Numbers:
    return Numbers(name, columns(looked(request, pending, file)))
