"""Long JSON documents, read by `sandbox.call_apart` in a separate process: long lists of numbers become arrays.

The lists are cut out of the text and converted piece by piece, with 8 bytes a number and no Python object for each; the
rest is short, and is parsed as usual.
"""

import re
import secrets
from typing import Any, BinaryIO

import numpy as np
import orjson

from underskin.errors import FileError
from underskin.recordings.readers.json_file import repeated_key
from underskin.units import Floats

_BOM = b"\xef\xbb\xbf"
_PIECE = 1 << 16  # characters of a list that are objects at once
# A string; a list of only numbers, not in place of a key; or an unclosed quotation mark.
_PARTS = re.compile(rb'"[^"\\]*+(?:\\.[^"\\]*+)*+"|\[([-+0-9.eE,\s]{64,}+)\](?!\s*+:)|"', re.DOTALL)
_NO_MEMORY = "Not enough memory"  # message of orjson
_DEEPEST = 200  # nesting of lists and objects, the limit of an answer


def read(stream: BinaryIO, most_plain: str, most_numbers: str) -> dict[str, Any]:
    """One of: `document`; `invalid`, the line, the column and the error; `repeated`, a repeated key and its second
    place; `plain`, the number of bytes outside long lists of numbers where above `most_plain`; `numbers`, the length of
    a list above `most_numbers`."""
    body = stream.read().removeprefix(_BOM)
    mark = secrets.token_hex(16)  # nothing in the document can pass for a list that was cut out
    try:
        text, arrays = _cut(body, mark, int(most_numbers))
    except _TooMany as error:
        return {"numbers": error.count}
    if len(text) > int(most_plain):
        return {"plain": len(text)}
    try:
        document = orjson.loads(text)
    except orjson.JSONDecodeError as error:
        if error.msg.startswith(_NO_MEMORY):
            raise MemoryError from None
        return {"invalid": _place(body, error)}
    if repeated_key(text):
        return {"repeated": repeated_key(body)}
    return {"document": _with_arrays(document, mark, arrays, 0)}


class _TooMany(Exception):
    def __init__(self, count: int) -> None:
        self.count = count


def _cut(body: bytes, mark: str, most_numbers: int) -> tuple[bytes, list[Floats]]:
    """The document with a string in place of each long list of numbers, and these lists; raises _TooMany."""
    pieces: list[bytes] = []
    arrays: list[Floats] = []
    behind = 0
    for part in _PARTS.finditer(body):
        if part.end() == part.start() + 1:  # the quotation mark; spans, since groups would be copies
            break
        array = None if part.start(1) < 0 else _numbers(body, *part.span(1), most_numbers)
        if array is not None:
            pieces += body[behind : part.start()], b'"%b:%d"' % (mark.encode(), len(arrays))
            arrays.append(array)
            behind = part.end()
    return b"".join((*pieces, body[behind:])), arrays


def _numbers(body: bytes, start: int, end: int, most: int) -> Floats | None:
    """The comma-separated numbers; None where the list is no valid JSON. Raises _TooMany."""
    count = body.count(b",", start, end) + 1
    if count > most:
        raise _TooMany(count)
    numbers = np.empty(count)
    filled = 0
    while start <= end:
        comma = body.find(b",", min(start + _PIECE, end), end)
        stop = end if comma < 0 else comma
        try:
            piece = orjson.loads(b"[%b]" % body[start:stop])
        except orjson.JSONDecodeError:
            return None
        if not piece:  # nothing between two commas
            return None
        numbers[filled : filled + len(piece)] = piece
        filled += len(piece)
        start = stop + 1
    return numbers


def _place(body: bytes, error: orjson.JSONDecodeError) -> list[Any]:
    """Line, column and message of the error in the original document."""
    try:
        orjson.loads(body)
    except orjson.JSONDecodeError as error_in_whole:
        error = error_in_whole
    return [error.lineno, error.colno, error.msg]


def _with_arrays(value: Any, mark: str, arrays: list[Floats], depth: int) -> Any:
    if depth > _DEEPEST:
        raise FileError("", "", f"lists and objects are nested more than {_DEEPEST} deep")
    if isinstance(value, dict):
        return {name: _with_arrays(item, mark, arrays, depth + 1) for name, item in value.items()}
    if isinstance(value, list):
        return [_with_arrays(item, mark, arrays, depth + 1) for item in value]
    if isinstance(value, str) and value.startswith(mark):
        return arrays[int(value.removeprefix(f"{mark}:"))]
    return value
