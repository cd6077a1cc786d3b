"""Campaigns as JSON (`campaign/1`), the format all others are turned into."""

from typing import Any, BinaryIO

import orjson

from underskin.errors import FileError
from underskin.recordings.campaign import Campaign, to_dict
from underskin.recordings.readers.repeated_keys import repeated_key

_BOM = b"\xef\xbb\xbf"


def read(stream: BinaryIO, file: str) -> Any:
    """The JSON document of an open file; raises FileError that names line and column."""
    stream.seek(0)
    return document(stream.read(), file)


def document(data: bytes, file: str) -> Any:
    """The JSON document in `data`. NaN and Infinity are not JSON, and an object may have a key once.

    Raises FileError that names line and column.
    """
    data = data.removeprefix(_BOM)
    try:
        read = orjson.loads(data)
    except orjson.JSONDecodeError as error:
        raise FileError(file, f"line {error.lineno}, column {error.colno}", f"not JSON: {error.msg}") from None
    if repeated := repeated_key(data):
        key, place = repeated
        raise FileError(file, place, f"the key {key!r} must be given once in its object")
    return read


def write(campaign: Campaign) -> bytes:
    """The campaign as JSON; numbers keep every digit."""
    return orjson.dumps(to_dict(campaign))
