"""Campaigns of the store: described, read as campaign/1 with few recordings in memory, recordings left out."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import orjson
from sqlalchemy import Connection

from service.schemas.campaigns import CampaignDetail, CampaignEntry, RecordingEntry, RecordingResult
from service.store import AnyRow, Database, campaigns, codec, undo
from service.usecases import changes, d33_cache
from underskin.recordings.campaign import to_dict
from underskin.recordings.readers import hdf5_file
from underskin.surrogate.sigma_table import SigmaTable


def entry(row: AnyRow) -> dict[str, Any]:
    """The fields of CampaignEntry from a row of the store."""
    names = set(CampaignEntry.model_fields) - {"state", "file", "tags"}
    fields = {"state": campaigns.state(row), "file": row.source, "tags": changes.words(row.tags)}
    return {name: getattr(row, name) for name in names} | fields


def detail(connection: Connection, campaign_id: str) -> CampaignDetail:
    """A campaign and its recordings, without their arrays; raises Missing."""
    row = campaigns.find(connection, campaign_id)
    recordings = campaigns.recordings_of(connection, row.number)
    return CampaignDetail(
        **entry(row),
        skin=row.about["skin"],
        entries=[RecordingEntry(**recording._mapping) for recording in recordings],
        refused=[RecordingResult(**refused) for refused in row.refused],
        notes=row.notes,
    )


def exclude(
    store: Database, table: SigmaTable, campaign_id: str, recording: str, reason: str, excluded_from: str | None
) -> None:
    """Leave a recording out of all figures, and compute the d33 of its campaign anew; raises Missing, Conflict."""
    store.write(campaigns.exclude, campaign_id, recording, reason, excluded_from)
    d33_cache.derive(store, table, [campaign_id])


def take_back(store: Database, table: SigmaTable, change_id: str, made_from: str | None) -> None:
    """Undo a change, and compute d33 anew where it changes figures; raises Missing, Conflict."""
    change = store.write(undo.undo, change_id, made_from)
    if change.campaign_id is not None and change.action != "annotate":
        corrected = store.read(campaigns.find, change.campaign_id).corrects if change.action == "correct" else None
        d33_cache.derive(store, table, [name for name in (change.campaign_id, corrected) if name is not None])


def json_parts(store: Database, row: AnyRow) -> Iterator[bytes]:
    """The JSON text, a recording at a time."""
    yield orjson.dumps(_head(row))[:-1] + b',"recordings":['
    for number, recording in enumerate(campaigns.documents(store, row.number)):
        if number:
            yield b","
        yield orjson.dumps(recording, option=orjson.OPT_SERIALIZE_NUMPY)
    yield b"]}"


def write_hdf5(store: Database, row: AnyRow, file: Path) -> None:
    """The same as HDF5."""
    hdf5_file.write_document(_head(row), campaigns.documents(store, row.number), file)


def _head(row: AnyRow) -> dict[str, Any]:
    document = to_dict(codec.campaign_of(row.about, ()))
    del document["recordings"]
    return document
