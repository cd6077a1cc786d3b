"""Dependency of routes: the upload of the address, if it belongs to the session."""

from typing import Annotated

from fastapi import Depends, Request

from service.auth import session
from service.pages.upload.pending_uploads import PendingUpload, PendingUploads
from service.store import Missing


def _upload(request: Request, upload_id: str) -> PendingUpload:
    """The upload of an address; raises Missing if it is not the session's own."""
    pending_uploads: PendingUploads = request.app.state.pending_uploads
    return pending_uploads.find(session.cookie_in(dict(request.scope["headers"])), upload_id)


UploadOfSession = Annotated[PendingUpload, Depends(_upload)]


def _pending(upload: UploadOfSession) -> PendingUpload:
    """The same unless it was discarded; raises Missing if it was."""
    if upload.discarded:
        raise Missing("This upload was discarded. For an hour it can be taken back on the page “Upload”.")
    return upload


Pending = Annotated[PendingUpload, Depends(_pending)]
