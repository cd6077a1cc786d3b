"""Discarding an upload, and restoring it."""

from fastapi import APIRouter, Response

from service.dependencies import WRITE
from service.pages.shared.forms import FORM_OF_SESSION, see
from service.pages.upload.of_session import Pending, UploadOfSession

router = APIRouter(prefix="/upload")


@router.post("/{upload_id}/discard", dependencies=[*WRITE, FORM_OF_SESSION])
def discard(pending: Pending) -> Response:
    """Puts it aside; for a while it can be taken back."""
    pending.discarded = True
    return see("/upload")


@router.post("/{upload_id}/restore", dependencies=[*WRITE, FORM_OF_SESSION])
def restore(pending: UploadOfSession) -> Response:
    """Takes back that it was discarded."""
    pending.discarded = False
    return see(f"/upload/{pending.id}")
