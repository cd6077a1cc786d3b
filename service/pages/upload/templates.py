"""Rig descriptions of earlier files of an instrument, offered for the next ones."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import orjson

from service.ingest.instruments import template_of, with_skin
from service.ingest.rig_words import SKIN
from service.pages.upload.file_summary import FileSummary
from service.pages.upload.mapping import tares_of
from service.pages.upload.pending_uploads import PendingUpload, Remembered
from service.store import AnyRow, Database, Missing, instrument_templates
from underskin.recordings import rig_description


@dataclass(frozen=True)
class OfferedTemplate:
    """A template as offered: the instrument's name, by whom and when it was stored, its content, including the
    samples in use, the part of a curve [%] in which a quantity is 0, and whether unusual values were confirmed."""

    name: str
    kept_at: str
    kept_from: str | None
    channels: Mapping[str, Any]
    derived: Mapping[str, str]
    trim: Mapping[str, int]
    tares: Mapping[str, float]
    units_checked: bool


def offered(store: Database, pending: PendingUpload, file: FileSummary) -> OfferedTemplate | None:
    """The template of the instrument that wrote a file; None if there is none, or if it is in use already."""
    row = _latest(store, file)
    if row is None or (pending.rig is not None and template_of(pending.rig) == row.document):
        return None
    if pending.rig is not None and file.recordings:
        return None
    document = orjson.loads(row.document)
    return OfferedTemplate(
        document.get("name") or "",
        row.kept_at,
        row.kept_from,
        document["channels"],
        document.get("derived") or {},
        document.get("trim") or {},
        tares_of(document["channels"]),
        document.get("units_checked", False),
    )


def use(store: Database, pending: PendingUpload, skin: Mapping[str, Any]) -> None:
    """Read the upload by the template of its first file that has one; `skin`: known values of the skin. Raises
    Missing if there is none."""
    row = next((template for file in pending.seen if (template := _latest(store, file)) is not None), None)
    if row is None:
        raise Missing("There is no template for these files.")
    skin_values = {name: skin[name] for name in (*[name for name, *_ in SKIN], "sensors") if skin.get(name) is not None}
    document = with_skin(row.document, {"poisson_ratio": 0.5, **skin_values})
    pending.rig, pending.draft, pending.refused = rig_description.from_dict(document), None, []
    pending.rig_label = "rig.json"  # as the page saves it
    pending.remembered = Remembered(document.get("name"), row.kept_at, row.kept_from)
    pending.lacking = None
    pending.turned &= not pending.is_depth_composed


def _latest(store: Database, file: FileSummary) -> AnyRow | None:
    return None if file.instrument is None else store.read(instrument_templates.latest, file.instrument)
