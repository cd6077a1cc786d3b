"""What is downloaded of an upload that is not kept: its rig description, its channels, its FRFs."""

import orjson
from fastapi import APIRouter, Request, Response

from service.pages.shared.figures import attachment, csv_answer
from service.pages.upload.figures import lines_columns, trace_columns
from service.pages.upload.looking import looked
from service.pages.upload.of_session import Pending
from service.store import Missing

router = APIRouter(prefix="/upload")


@router.get("/{upload_id}/rig.json")
def rig_json(pending: Pending) -> Response:
    """The rig description in use."""
    if pending.rig is None:
        raise Missing("There is no rig description yet.")
    content = orjson.dumps(pending.rig.document, option=orjson.OPT_INDENT_2)
    return attachment("rig.json", content, "application/json")


@router.get("/{upload_id}/{file}/traces.csv")
def traces_csv(request: Request, pending: Pending, file: int) -> Response:
    """The channels of a file's first part."""
    return csv_answer("traces", trace_columns(looked(request, pending, file)))


@router.get("/{upload_id}/{file}/frf.csv")
def frf_csv(request: Request, pending: Pending, file: int) -> Response:
    """The FRFs of a file."""
    return csv_answer("frf", lines_columns(looked(request, pending, file)))
