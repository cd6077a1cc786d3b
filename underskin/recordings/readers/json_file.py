"""Campaigns as JSON (`campaign/1`), the format all others are converted to.

Repeated keys of an object, of which parsers silently use the last, are rejected; the search jumps from one quotation
mark to the next, so that the numbers between them cost little.
"""

import json
import re
from typing import Any, BinaryIO

import orjson

from underskin.errors import FileError
from underskin.recordings.campaign import Campaign, to_dict

_ESCAPE = re.compile(rb'\\(["\\])')
_AS_UNICODE = {b'"': rb"\u0022", b"\\": rb"\u005c"}
_STRING = re.compile(rb'"((?:[^"\\]|\\.)*)"')
_COLON = re.compile(rb"\s*:")


def repeated_key(document: bytes) -> tuple[str, str] | None:
    """The first repeated key of an object, in any escaping, and the line and column of its second place, from 1, in
    words; None without one.

    `document` must be valid JSON, in UTF-8, or in UTF-16 or UTF-32, which Python's own parser reads too.
    """
    document = _in_utf8(document)
    number = _number_of_repeated(document)
    if number is None:
        return None
    string = next(match for index, match in enumerate(_STRING.finditer(document)) if index == number)
    before = document[: string.start()].decode("utf-8", "replace")
    line, column = before.count("\n") + 1, len(before) - before.rfind("\n")
    return _unescaped(string[1]), f"line {line}, column {column}"


def _in_utf8(document: bytes) -> bytes:
    encoding = json.detect_encoding(document)
    if encoding == "utf-8":
        return document
    return document.decode(encoding, "surrogatepass").encode("utf-8", "surrogatepass")


def _number_of_repeated(document: bytes) -> int | None:
    """The index, from 0, of the string of the document that is the first repeated key."""
    if b"\\" in document:  # replace quotation marks within strings
        document = _ESCAPE.sub(lambda escape: _AS_UNICODE[escape[1]], document)
    objects: list[set[bytes]] = []  # the keys of those that are open
    number = behind = 0
    while (start := document.find(b'"', behind)) >= 0:
        if start - behind > 1 or not number:  # a single character is a colon or a comma
            closed, opens = _braces(document, behind, start)
            del objects[len(objects) - closed :]
            if opens:
                objects.append(set())
        end = document.find(b'"', start + 1)
        behind = end + 1
        follows = document[behind : behind + 1]
        if follows == b":" or (follows.isspace() and _COLON.match(document, behind)):
            key = document[start + 1 : end]
            if b"\\" in key:
                key = _unescaped(key).encode("utf-8", "surrogatepass")
            if key in objects[-1]:
                return number
            objects[-1].add(key)
        number += 1
    return None


def _braces(document: bytes, start: int, end: int) -> tuple[int, bool]:
    """The number of open objects that the braces between two strings close, and whether they open one that stays open.

    No object has a key between two strings, so that only the last brace can open one that stays open.
    """
    opening, closing = document.find(b"{", start, end), document.find(b"}", start, end)
    if opening < 0 and closing < 0:
        return 0, False
    opened = document.count(b"{", opening, end) if opening >= 0 else 0
    closed = document.count(b"}", closing, end) if closing >= 0 else 0
    stays_open = document.rfind(b"{", start, end) > document.rfind(b"}", start, end)
    return closed - opened + stays_open, stays_open


def _unescaped(string: bytes) -> str:
    return str(json.loads(b'"%b"' % string))


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
