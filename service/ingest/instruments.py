"""Instruments, recognised by the headings of their files, and the reusable part of a rig description."""

import hashlib
from collections.abc import Mapping
from typing import Any

import orjson

from underskin.recordings.channels import Contents
from underskin.recordings.rig_description import RigDescription

_OF_INSTRUMENT = ("indenter_radius_mm", "stage_stiffness_n_per_mm", "sample_rate_hz")  # where typed, not from a file


def recognised(kind: str, contents: Contents) -> str | None:
    """A digest of format, channels and units, equal for files of one instrument; None for a file without channels."""
    headings = {(channel.name, channel.unit) for block in contents.blocks for channel in block.channels}
    if not headings:
        return None
    return hashlib.sha256(orjson.dumps([kind, sorted(headings)])).hexdigest()


def template_of(rig: RigDescription) -> str:
    """The part of a rig description (JSON) that holds for all files of an instrument: without the skin and without
    values typed for one recording."""
    document = rig.document
    recording = {
        name: value
        for name, value in document.get("recording", {}).items()
        if isinstance(value, Mapping) or name in _OF_INSTRUMENT
    }
    return orjson.dumps({**document, "skin": {}, "recording": recording}).decode()


def of_skin(rig: RigDescription) -> str:
    """The part of a rig description (JSON) that holds for later files of its skin: without a typed time, which belongs
    to these recordings only."""
    recording = {
        name: value
        for name, value in rig.document.get("recording", {}).items()
        if name != "recorded_at" or isinstance(value, Mapping)
    }
    recording_part = {"recording": recording} if "recording" in rig.document else {}
    return orjson.dumps({**rig.document, **recording_part}).decode()


def with_skin(template: str, skin: Mapping[str, Any]) -> dict[str, Any]:
    """The rig description (`rig/1`) of a template, completed with the known fields of a skin."""
    return {**orjson.loads(template), "skin": dict(skin)}
