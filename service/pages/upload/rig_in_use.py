"""The rig description that an upload is read with, and the skin that it is kept with."""

from typing import Any

import orjson

from service.ingest.accept import RIG
from service.ingest.uploads import Upload
from service.pages.upload.keep import field_errors
from service.store import campaigns, skins
from service.store.engine import Database
from underskin.errors import FileError, InvalidInput
from underskin.recordings import rig_description
from underskin.recordings.rig_description import LARGEST_BYTES, RigDescription


def skin_of(store: Database, corrects: str | None) -> str | None:
    """The skin of the campaign that is corrected, on which its correction stays; raises Missing."""
    if corrects is None:
        return None
    with store.reading() as connection:
        return str(campaigns.find(connection, corrects).skin_id)


def rig(store: Database, sent: Upload | None, skin: str | None) -> tuple[RigDescription | None, list[dict[str, Any]]]:
    """The rig description that was sent, or that is kept with the skin; and what is wrong with the one sent."""
    if sent is not None:
        try:
            with sent.path.open("rb") as file:
                return rig_description.parse(file.read(LARGEST_BYTES + 1), sent.label or RIG), []
        except (FileError, InvalidInput) as error:
            return None, field_errors(error)
    if skin is not None:
        with store.reading() as connection:
            document = skins.rig_of(connection, skin)
        if document is not None:
            return rig_description.from_dict(orjson.loads(document)), []
    return None, []
