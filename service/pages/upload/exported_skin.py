"""An uploaded file that is an exported skin: its content, what of it is stored already, and its import."""

from urllib.parse import quote

from fastapi import Request, Response

from service.ingest import skin_imports
from service.pages.shared import same_request
from service.pages.shared.html import page
from service.pages.upload.file_summary import FileSummary
from service.pages.upload.keep import field_errors
from service.pages.upload.pending_uploads import PendingUpload, PendingUploads
from service.pages.upload.skin_summary import MOST_LISTED, skin_summary
from service.store import Conflict, Database
from underskin import InvalidInput
from underskin.recordings.skin_export import is_export

KIND = "exported skin"


def holds_skin(pending: PendingUpload) -> bool:
    """Whether an upload is an exported skin, which must be the only file."""
    first, *others = pending.files
    if others:
        return False
    with first.path.open("rb") as stream:
        return is_export(stream, first.label or "the file")


def look(store: Database, pending: PendingUpload) -> None:
    """Summarise it; where it cannot be read, list the errors as for any other file. One at a time."""
    try:
        pending.skin_summary = skin_summary(skin_imports.look(store, pending.files[0]))
    except InvalidInput as error:
        label = pending.files[0].label or "the file"
        pending.seen = [FileSummary(label, KIND, 0, (), (), field_errors(error), (), (), None)]
        pending.drawn = {0: []}


def shown(request: Request, pending: PendingUpload) -> Response:
    """What would come in."""
    return page(
        request,
        "exported.html",
        pending=pending,
        summary=pending.skin_summary,
        file=pending.files[0].label or "the file",
        most_listed=MOST_LISTED,
        same=same_request.exported_skin(request, pending.files[0].label or "skin.h5"),
    )


def bring_in(request: Request, store: Database, pending: PendingUpload) -> None:
    """Keep what is not here; errors are shown on the upload's page. A second request stores nothing again."""
    pending_uploads: PendingUploads = request.app.state.pending_uploads
    with pending.lock:
        if pending.kept_at is not None:
            return
        with pending_uploads.in_use(pending):
            try:
                brought = skin_imports.bring_in(store, pending.files[0])
            except Conflict:  # the stored data were changed since it was examined
                look(store, pending)
                return
        pending.kept_at = f"/skins/{quote(brought.skin_id, safe='')}"
        pending_uploads.empty(pending)
