"""A campaign as campaign/1, JSON or HDF5, with a few of its recordings in memory at a time."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import orjson

from service.store import AnyRow, Database, campaigns, codec
from underskin.recordings.campaign import to_dict
from underskin.recordings.readers import hdf5_file


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
