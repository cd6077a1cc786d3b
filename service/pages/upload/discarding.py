"""An upload that is put aside, and taken back."""

from fastapi import APIRouter, Response

from service.dependencies import WRITE
from service.pages.shared.forms import OWN_FORM, see
from service.pages.upload.of_session import Found, Pending

router = APIRouter(prefix="/upload")


@router.post("/{upload_id}/discard", dependencies=[*WRITE, OWN_FORM])
def discard(pending: Pending) -> Response:
    """Puts it aside; for a while it can be taken back."""
    pending.discarded = True
    return see("/upload")


@router.post("/{upload_id}/restore", dependencies=[*WRITE, OWN_FORM])
def restore(pending: Found) -> Response:
    """Takes back that it was discarded."""
    pending.discarded = False
    return see(f"/upload/{pending.id}")
