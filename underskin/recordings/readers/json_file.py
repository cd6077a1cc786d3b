"""Campaigns as JSON (`campaign/1`), the format all others are converted to.

Repeated keys of an object, of which parsers silently use the last, are rejected.
"""

import json
import re
from typing import Any, BinaryIO

import orjson

from underskin.errors import FileError
from underskin.recordings.campaign import Campaign, to_dict

_TOKEN = re.compile(rb'[^"{}]*+(?:([{}])|"((?:[^"\\]++|\\.)*+)"(\s*+:)?+|\Z)')


def repeated_key(document: bytes) -> tuple[str, str] | None:
    """The first repeated key of an object, in any escaping, and the line and column of its second place, from 1, in
    words; None without one.

    `document` must be valid JSON, in UTF-8, or in UTF-16 or UTF-32, which Python's own parser reads too.
    """
    encoding = json.detect_encoding(document)
    if encoding != "utf-8":
        document = document.decode(encoding, "surrogatepass").encode("utf-8", "surrogatepass")
    open_objects: list[set[str]] = []  # the keys of each
    for token in _TOKEN.finditer(document):
        brace, string, colon = token.groups()
        if brace == b"{":
            open_objects.append(set())
        elif brace == b"}":
            open_objects.pop()
        elif colon is not None:
            key = json.loads(b'"%b"' % string) if b"\\" in string else string.decode("utf-8", "surrogatepass")
            if key in open_objects[-1]:
                before = document[: token.start(2) - 1].decode("utf-8", "replace")
                return key, f"line {before.count(chr(10)) + 1}, column {len(before) - before.rfind(chr(10))}"
            open_objects[-1].add(key)
    return None


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
        parsed = orjson.loads(data)
    except orjson.JSONDecodeError as error:
        raise FileError(file, f"line {error.lineno}, column {error.colno}", f"not JSON: {error.msg}") from None
    if repeated := repeated_key(data):
        key, place = repeated
        raise FileError(file, place, f"the key {key!r} must be given once in its object")
    return parsed


def write(campaign: Campaign) -> bytes:
    """The campaign as JSON; numbers keep every digit."""
    return orjson.dumps(to_dict(campaign))
