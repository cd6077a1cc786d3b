"""The rig description that an upload is read with, and the skin that it is kept with."""

from typing import Any

from service.ingest.accept import kept_rig, sent_rig
from service.ingest.uploads import Upload
from service.pages.upload.keep import field_errors
from service.store import Database, campaigns
from underskin.errors import FileError, InvalidInput
from underskin.recordings.rig_description import RigDescription


def skin_of(store: Database, corrects: str | None) -> str | None:
    """The skin of the campaign that is corrected, on which its correction stays; raises Missing."""
    if corrects is None:
        return None
    return str(store.read(campaigns.find, corrects).skin_id)


def rig(store: Database, sent: Upload | None, skin: str | None) -> tuple[RigDescription | None, list[dict[str, Any]]]:
    """The rig description that was sent, or that is kept with the skin; and what is wrong with the one sent."""
    if sent is not None:
        try:
            return sent_rig(sent), []
        except (FileError, InvalidInput) as error:
            return None, field_errors(error)
    if skin is None:
        return None, []
    return store.read(kept_rig, skin), []
