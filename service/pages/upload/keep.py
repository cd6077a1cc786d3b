"""Storing a previewed upload, or its errors; the rig description with which it is read; and warnings before it is
stored, because stored data are never deleted."""

from collections.abc import Mapping
from typing import Any
from urllib.parse import quote

import orjson
from fastapi import Request

from service.dependencies import sender
from service.ingest import repeats
from service.ingest.accept import RIG, IngestOptions, accept, sent_rig, stored_rig
from service.ingest.reading import InspectedFile, checked, field_error
from service.ingest.uploads import Upload
from service.pages.shared.forms import signed
from service.pages.upload import stated_preload
from service.pages.upload.pending_uploads import PendingUpload, PendingUploads, Remembered
from service.problems import Refusal
from service.store import Conflict, Database, Missing, campaigns, skins
from service.usecases import d33_cache
from underskin.errors import ErrorCode, FileError, InvalidInput, errors_of
from underskin.recordings import curve_preparation

SKIN_FIELD, CORRECTS = "skin", "corrects"


def keep_good(request: Request, pending: PendingUpload, sent: Mapping[str, str], store: Database) -> list[str]:
    """Store the valid campaigns; returns their ids. Errors are shown on the upload's page. A second request stores
    nothing again."""
    pending_uploads: PendingUploads = request.app.state.pending_uploads
    with pending.lock:
        if pending.kept_at is not None or pending.is_stale:  # of which the page shows no button to keep it
            return []
        together = sent.get("together", "").strip() if sent.get("as") == "one" else None
        pending.skin = sent.get(SKIN_FIELD, "").strip() or None
        pending.reason = sent.get("reason", "").strip()
        pending.who = sent.get("who", "").strip()
        reason = pending.reason or None if pending.corrects is not None else None
        settings = request.app.state.settings
        try:
            options = IngestOptions(
                pending.skin,
                pending.corrects,
                reason,
                False,
                together,
                None,
                sender(request),
                settings.max_body_bytes,
                settings.max_unfolded_bytes,
                pending.estimator,
                turn_curves=pending.turned,
                use_stored_rig=False,  # exactly the previewed data are stored
                signed=signed(request, sent) if pending.corrects is not None else None,
            )
            with pending_uploads.in_use(pending):
                answer, _ = accept(store, [*pending.files, *_rig_upload(pending)], options)
        except (InvalidInput, Conflict, Missing, Refusal) as error:
            pending.refused = field_errors(error)
            return []
        stored = [result for result in answer["campaigns"] if result["id"] is not None]
        page = f"/campaigns/{stored[0]['id']}"
        pending.kept_at = page if len(stored) == 1 else f"/skins/{quote(stored[0]['skin_id'], safe='')}"
        pending_uploads.empty(pending)
        return [result["id"] for result in stored]


def _rig_upload(pending: PendingUpload) -> list[Upload]:
    """The rig description in use, as a part of the upload."""
    if pending.rig is None:
        return []
    path = pending.folder / RIG
    path.write_bytes(orjson.dumps(pending.rig.document))
    return [Upload(path, None, RIG, "", in_form=True)]


def field_errors(error: Exception) -> list[dict[str, Any]]:
    """Errors field by field."""
    if isinstance(error, InvalidInput):
        return [
            field_error(invalid.field, invalid.value, invalid.allowed, invalid.code) for invalid in errors_of(error)
        ]
    if isinstance(error, Refusal) and error.errors:
        return [dict(error_of_field) for error_of_field in error.errors]
    if isinstance(error, FileError):
        return [field_error(error.file, None, f"{error.place} {error.reason}".strip(), error.code)]
    detail = error.detail if isinstance(error, Refusal) else str(error)
    return [field_error("upload", None, detail, ErrorCode.INVALID_VALUE)]


def skin_of(store: Database, corrects: str | None) -> str | None:
    """The skin of the corrected campaign, on which its correction stays; raises Missing."""
    if corrects is None:
        return None
    return str(store.read(campaigns.find, corrects).skin_id)


def take_rig(store: Database, pending: PendingUpload, sent: Upload | None) -> None:
    """Read the upload by the rig description that was sent or that is stored with its skin; errors of a sent one are
    shown."""
    if sent is not None:
        try:
            pending.rig, pending.rig_label = sent_rig(sent), sent.label
        except (FileError, InvalidInput) as error:
            pending.refused = [{**detail, RIG: sent.label or RIG} for detail in field_errors(error)]
    elif pending.skin is not None:
        pending.rig = store.read(stored_rig, pending.skin)
        origin = store.read(skins.rig_origin, pending.skin)
        if pending.rig is not None and origin is not None:
            name = pending.rig.document.get("name")
            pending.remembered = Remembered(name, origin.created_at, skin=pending.skin, file=origin.file)


def worth_knowing(request: Request, look: InspectedFile, skin_id: str | None, corrects: str | None) -> list[str]:
    """Warnings in sentences on the campaigns of one file; `skin_id`: the skin it is sent for, if stated; `corrects`:
    the campaign that they replace."""
    store, table = request.app.state.store, request.app.state.table
    sentences: list[str] = []
    for in_file in map(checked, look.campaigns):
        if in_file.campaign is None:
            continue
        earlier = store.read(repeats.earlier_campaign, in_file.campaign, skin_id, corrects)
        if earlier is not None:
            sentences.append(earlier[0])
        if store.read(repeats.changes_nothing, in_file.campaign, skin_id, corrects):
            sentences.append("it says the same as the campaign that it corrects: nothing would change.")
        stored_skin_id = store.read(repeats.otherwise_named, in_file.campaign, corrects)
        if stored_skin_id is not None:
            sentences.append(
                f"the file names skin {in_file.campaign.skin.id}, not {stored_skin_id}, that of the campaign that it "
                "corrects: the name below decides."
            )
        sentences += [
            *stated_preload.doubts(in_file.campaign),
            *d33_cache.foreseen(table, in_file.campaign),
        ]
    return sentences


def counts_pressing_negative(looked: InspectedFile) -> bool:
    """Whether curves of a file count pressing negative."""
    held = [
        checked_campaign.campaign
        for checked_campaign in map(checked, looked.campaigns)
        if checked_campaign.campaign is not None
    ]
    return any(curve_preparation.findings(campaign) for campaign in held)
