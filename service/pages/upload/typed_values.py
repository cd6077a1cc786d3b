"""Errors of typed values in the form of an upload, by the checks of a campaign, before any file is read. Empty
fields and properties of a file are no errors here."""

from collections.abc import Mapping
from typing import Any

from service.ingest.field_words import RECORDING, SKIN
from service.pages.upload import recorded_time
from underskin.errors import InvalidInput
from underskin.recordings.campaign import KINDS, SkinDescription
from underskin.recordings.validation import check_fields

_OF_SKIN = {name for name, *_ in SKIN}
_OF_RECORDING = {name for name, *_ in RECORDING} - {recorded_time.FIELD}  # which is read in the lab's time zone


def refused(document: Mapping[str, Any]) -> list[InvalidInput]:
    """Of the rig description that a form says, those of its skin and of its recordings."""
    units_checked = bool(document.get("units_checked"))
    skin = {name: value for name, value in document.get("skin", {}).items() if name in _OF_SKIN}
    of_skin = _refused(SkinDescription, skin, units_checked=units_checked)
    of_recordings = of_recording(document["kind"], document.get("recording", {}), units_checked=units_checked)
    return [
        *(invalid.at(f"skin.{invalid.field}") for invalid in of_skin),
        *(invalid.at(f"recording.{invalid.field}") for invalid in of_recordings),
    ]


def of_recording(kind: str, values: Mapping[str, Any], *, units_checked: bool) -> list[InvalidInput]:
    """Of fields of recordings of a kind."""
    typed = {name: value for name, value in values.items() if name in _OF_RECORDING and not isinstance(value, Mapping)}
    return _refused(KINDS[kind], typed, units_checked=units_checked) if kind in KINDS else []


def _refused(model: Any, typed: Mapping[str, Any], *, units_checked: bool) -> list[InvalidInput]:
    """In the form's order, without what is missing, which a file may state."""
    wrong = {invalid.field: invalid for invalid in check_fields(model, typed, units_checked=units_checked)[1]}
    return [wrong[name] for name in typed if name in wrong]
