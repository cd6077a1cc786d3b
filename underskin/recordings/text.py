"""Text as instruments write it: byte order marks, old code pages, decimal commas."""

import re
from typing import BinaryIO

from underskin.errors import FileError

_LINE_END = re.compile(r"\r\n|\r|\n")
_NUMBER = re.compile(r"[+-]?(\d+([.]\d*)?|[.]\d+)([eE][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.IGNORECASE)
_BOMS = {b"\xef\xbb\xbf": "utf-8", b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}


def content(stream: BinaryIO, file: str) -> str:
    """The text of a whole open file."""
    stream.seek(0)
    return decode(stream.read(), file)


def decode(data: bytes, file: str) -> str:
    """The text of a file: UTF-8, UTF-16 where a byte order mark says so, else Latin-1, which older instruments write.

    Raises FileError where the bytes are no text.
    """
    for mark, encoding in _BOMS.items():
        if data.startswith(mark):
            return _decoded(data[len(mark) :], encoding, file)
    zero = data.find(0)
    if zero >= 0:
        raise FileError(file, f"byte {zero}", "is no text: it holds a zero byte")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _decoded(data: bytes, encoding: str, file: str) -> str:
    try:
        return data.decode(encoding)
    except UnicodeDecodeError as error:
        raise FileError(file, f"byte {error.start}", f"is no {encoding.upper()} text: {error.reason}") from None


def lines(text: str) -> list[str]:
    """The lines, however they end."""
    return _LINE_END.split(text)


def cells(line: str, separator: str) -> list[str]:
    """The cells of a line, without quotes and without the empty ones at its end; at least one."""
    found = [cell.strip().strip('"') for cell in line.split(separator)]
    while len(found) > 1 and not found[-1]:
        found.pop()
    return found


def number(cell: str, decimal: str) -> float | None:
    """The number in a cell, or None where it holds something else."""
    cell = cell.strip()
    if decimal == ",":
        if "." in cell:
            return None
        cell = cell.replace(",", ".")
    if not cell.isascii() or not _NUMBER.fullmatch(cell):
        return None
    return float(cell)
