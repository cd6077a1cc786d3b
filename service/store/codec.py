"""Conversion between the campaign model and the store's rows, without loss.

The arrays of a recording are one blob of float64, byte-shuffled and deflated: length of the header (4 bytes, little
endian), the header (JSON, [[name, count], ...]), then zlib of the shuffled bytes of all arrays in sequence. Shuffling
groups bytes of equal significance, in which neighbouring numbers are similar.
"""

import struct
import zlib
from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

import numpy as np
import orjson

from service.store.tables import AnyRow
from service.store.times import stored
from underskin.recordings.campaign import KINDS, Campaign, Recording, Sensor, SkinDescription, Tolerances
from underskin.units import Floats

_LEVEL = 1  # higher levels take several times longer and save a few per cent


def about(campaign: Campaign) -> dict[str, Any]:
    """The campaign without its recordings."""
    return {"name": campaign.name, "skin": asdict(campaign.skin), "units_checked": campaign.units_checked}


def campaign_of(about: dict[str, Any], recordings: tuple[Recording, ...]) -> Campaign:
    """The inverse of `about`."""
    sensors = tuple(Sensor(**sensor) for sensor in about["skin"]["sensors"])
    stated = about["skin"].get("tolerances")
    tolerances = None if stated is None else Tolerances(**stated)
    skin = SkinDescription(**{**about["skin"], "sensors": sensors, "tolerances": tolerances})
    return Campaign(about["name"], skin, recordings, about["units_checked"])


def recording_columns(recording: Recording) -> dict[str, Any]:
    """A recording as columns of its table."""
    values = {field.name: getattr(recording, field.name) for field in fields(recording)}
    arrays = {name: value for name, value in values.items() if isinstance(value, np.ndarray)}
    scalars = {name: value for name, value in values.items() if name not in arrays and value is not None}
    return {
        "id": recording.id,
        "kind": recording.kind,
        "sensor": values.get("sensor"),
        "recorded_at": recorded_at(recording),
        "scalars": scalars,
        "arrays": pack(arrays),
    }


def recording_of(row: AnyRow) -> Recording:
    """The inverse of `recording_columns`, from a row with kind, scalars and arrays."""
    values: dict[str, Any] = {**row.scalars, **unpack(row.arrays)}
    if "position_mm" in values:
        values["position_mm"] = tuple(values["position_mm"])
    return KINDS[row.kind](**values)


def document_of(row: AnyRow) -> dict[str, Any]:
    """The recording as campaign/1 has it, its arrays as such, from a row with kind, scalars and arrays."""
    scalars = {name: value for name, value in row.scalars.items() if (name, value) != ("kind", "frf")}
    return {**scalars, **unpack(row.arrays)}


def recorded_at(recording: Recording) -> str | None:
    """When it was recorded, in the store's form; None if the recording has no valid time."""
    try:
        return None if recording.recorded_at is None else stored(recording.recorded_at)
    except ValueError:
        return None


def earliest(campaign: Campaign) -> str | None:
    """The earliest time of its recordings, in the store's form; None if none has a time."""
    return min((time for recording in campaign.recordings if (time := recorded_at(recording))), default=None)


def compressed(document: Any) -> bytes:
    """JSON, deflated."""
    return zlib.compress(orjson.dumps(document), 1)


def decompressed(blob: bytes) -> Any:
    """The inverse of `compressed`."""
    return orjson.loads(zlib.decompress(blob))


def pack(arrays: Mapping[str, Floats]) -> bytes:
    """Named arrays of one axis as a blob."""
    header = orjson.dumps([[name, len(values)] for name, values in arrays.items()])
    together = np.concatenate([np.asarray(values, "<f8") for values in arrays.values()]) if arrays else np.empty(0)
    shuffled = np.ascontiguousarray(together.view(np.uint8).reshape(-1, 8).T)
    return struct.pack("<I", len(header)) + header + zlib.compress(shuffled.data, _LEVEL)


def unpack(blob: bytes) -> dict[str, Floats]:
    """The arrays given to `pack`."""
    (size,) = struct.unpack_from("<I", blob)
    header = orjson.loads(blob[4 : 4 + size])
    shuffled = np.frombuffer(zlib.decompress(blob[4 + size :]), np.uint8)
    together = np.ascontiguousarray(shuffled.reshape(8, -1).T).view("<f8").ravel()
    ends = np.cumsum([count for _, count in header])
    return {name: together[end - count : end] for (name, count), end in zip(header, ends, strict=True)}
