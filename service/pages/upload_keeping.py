"""From an upload that was looked at to what is kept, or to why nothing is."""

from collections.abc import Mapping
from typing import Any
from urllib.parse import quote

import orjson
from fastapi import Request

from service.accepting import RIG, Terms, accept
from service.pages.upload_shelf import Shelved
from service.problems import Refusal
from service.store.engine import Database
from service.store.errors import Conflict, Missing
from service.uploads import Upload
from underskin import InvalidInput
from underskin.errors import ErrorCode, FileError

SKIN_FIELD, CORRECTS = "skin", "corrects"


def keep_good(request: Request, shelved: Shelved, sent: Mapping[str, str], store: Database) -> list[str]:
    """The ids of what was kept; what kept it from being kept is told on the upload's page. Twice asked, kept once."""
    with shelved.lock:
        if shelved.kept_at is not None:
            return []
        key = request.scope["key"]
        sender = None if key is None else key.name
        together = sent.get("together", "").strip() if sent.get("as") == "one" else None
        shelved.skin = sent.get(SKIN_FIELD, "").strip() or None
        shelved.reason = sent.get("reason", "").strip()
        reason = shelved.reason or None if shelved.corrects is not None else None
        most = request.app.state.settings.max_body_bytes
        try:
            terms = Terms(shelved.skin, shelved.corrects, reason, False, together, None, sender, most)
            answer, _ = accept(store, [*shelved.files, *_rig_upload(shelved)], terms)
        except (InvalidInput, Conflict, Missing, Refusal) as error:
            shelved.refused = all_told(error)
            return []
        kept = [result for result in answer["campaigns"] if result["id"] is not None]
        one = f"/campaigns/{kept[0]['id']}"
        shelved.kept_at = one if len(kept) == 1 else f"/skins/{quote(kept[0]['skin_id'], safe='')}"
        request.app.state.shelf.empty(shelved)
        return [result["id"] for result in kept]


def _rig_upload(shelved: Shelved) -> list[Upload]:
    """The rig description that was looked with, as a part of the upload."""
    if shelved.rig is None:
        return []
    path = shelved.folder / RIG
    path.write_bytes(orjson.dumps(shelved.rig.document))
    return [Upload(path, None, RIG, "", in_form=True)]


def _told(error: InvalidInput) -> dict[str, Any]:
    return {"code": str(error.code), "field": error.field, "value": error.value, "allowed": error.allowed}


def all_told(error: Exception) -> list[dict[str, Any]]:
    """What is wrong, field by field."""
    if isinstance(error, InvalidInput):
        return [_told(error)]
    if isinstance(error, Refusal) and error.errors:
        return [dict(entry) for entry in error.errors]
    if isinstance(error, FileError):
        allowed = f"{error.place} {error.reason}".strip()
        return [{"code": str(error.code), "field": error.file, "value": None, "allowed": allowed}]
    detail = error.detail if isinstance(error, Refusal) else str(error)
    return [{"code": str(ErrorCode.INVALID_VALUE), "field": "upload", "value": None, "allowed": detail}]
