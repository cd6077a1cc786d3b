"""Text as instruments write it: byte order marks, old code pages, cells in quotes, decimal commas.

Whether a text was cut within its last number, as by a full disk or a connection that broke.
"""

import csv
import re
from collections.abc import Callable, Iterable, Sequence
from typing import BinaryIO

from underskin.errors import FileError

_LINE_END = re.compile(r"\r\n|\r|\n")
_NUMBER = re.compile(r"[+-]?(\d+([.]\d*)?|[.]\d+)([eE][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.IGNORECASE)
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
_LOOKED_AT, _MOSTLY = 4096, 0.8  # bytes of a text without a mark, and how many of a half must be zero
MINUS = "\N{MINUS SIGN}"
_BOMS = {b"\xef\xbb\xbf": "utf-8", b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}


def content(stream: BinaryIO, file: str) -> str:
    """The text of a whole open file."""
    stream.seek(0)
    return decode(stream.read(), file)


def decode(data: bytes, file: str) -> str:
    """The text of a file: UTF-8, UTF-16 where a byte order mark or every second byte says so, else Latin-1, which older
    instruments write.

    Raises FileError where the bytes are no text.
    """
    marked = marked_encoding(data)
    if marked is not None:
        encoding, start = marked
        try:
            return data[start:].decode(encoding)
        except UnicodeDecodeError as error:
            raise no_text(file, error.start, encoding, error.reason) from None
    zero = data.find(0)
    if zero >= 0:
        raise FileError(file, f"byte {zero}", "is no text: it holds a zero byte")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def marked_encoding(head: bytes) -> tuple[str, int] | None:
    """The encoding that the first bytes of a text say, and where the text begins behind their mark; None where they
    say none."""
    for mark, encoding in _BOMS.items():
        if head.startswith(mark):
            return encoding, len(mark)
    unmarked = _unmarked(head) if head.find(0) in (0, 1) else ""
    return (unmarked, 0) if unmarked else None


def _unmarked(data: bytes) -> str:
    """The encoding of a text in UTF-16 that has no byte order mark: every second byte is zero in what is mostly ASCII;
    empty where it is none."""
    first, second = (data[start:_LOOKED_AT:2].count(0) for start in (0, 1))
    half = len(data[:_LOOKED_AT]) // 2
    if max(first, second) < _MOSTLY * half or min(first, second):
        return ""
    return "utf-16-be" if first > second else "utf-16-le"


def no_text(file: str, place: int, encoding: str, reason: str) -> FileError:
    """What is wrong with a text at a byte, counted from behind its mark."""
    return FileError(file, f"byte {place}", f"is no {encoding.upper()} text: {reason}")


def lines(text: str) -> list[str]:
    """The lines, however they end."""
    return _LINE_END.split(text)


def cells(line: str, separator: str) -> list[str]:
    """The cells of a line, without quotes and without the empty ones at its end; at least one.

    A cell in quotes may hold the separator, and quotes, doubled; it ends on its line. Raises ValueError where it does
    not.
    """
    split = [cell.strip() for cell in (_quoted(line, separator) if '"' in line else line.split(separator))]
    while len(split) > 1 and not split[-1]:
        split.pop()
    return split


def _quoted(line: str, separator: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True, strict=True))
    except csv.Error:
        raise ValueError(
            "a cell in quotes must end on its line, before the next separator, with the quotes inside it doubled"
        ) from None


def decimal_mark(holding: Callable[[str], Iterable[Sequence[str]]], separator: str) -> str:
    """The decimal mark of a table, by its cells; `holding` gives the rows in which a mark may be.

    A comma where a cell is a number only that way and cannot have its thousands apart instead. Beside semicolons, which
    stand for commas that are decimal marks, any such cell says so; between commas none does where others have points.
    """
    if separator == "," and _has_number(holding("."), "."):
        return "."
    return "," if _has_number(holding(","), ",", grouped=separator == ";") else "."


def _has_number(rows: Iterable[Sequence[str]], decimal: str, *, grouped: bool = False) -> bool:
    """Whether a cell is a number with this decimal mark; `grouped`: even if that may part its thousands instead."""
    return any(
        decimal in cell and number(cell, decimal) is not None and (grouped or not is_grouped(cell))
        for row in rows
        for cell in row
    )


def is_grouped(cell: str) -> bool:
    """Whether a cell such as 16,000 is a whole number with its thousands apart, or a number with a decimal comma."""
    return _GROUPED.fullmatch(cell) is not None


def ungrouped(cell: str) -> str:
    """What is asked of a cell like that."""
    return f"can be {cell.replace(',', '')} or {cell.replace(',', '.', 1)}: write it without a comma"


def number(cell: str, decimal: str) -> float | None:
    """The number in a cell, or None where it holds something else."""
    cell = cell.strip().replace(MINUS, "-")
    if decimal == ",":
        if "." in cell:
            return None
        cell = cell.replace(",", ".")
    if not cell.isascii() or not _NUMBER.fullmatch(cell):
        return None
    return float(cell)


_END = 1 << 16  # bytes at the end
_FEWEST, _MOST = 3, 50  # lines above that say how many digits numbers have
_SEPARATORS = "\t;, "
_CUT_NUMBER = re.compile(r"[+-]?\d*(?:[.,](?P<decimals>\d*))?(?:[eE][+-]?(?P<exponent>\d*))?")


def warning(stream: BinaryIO) -> str:
    """In words, that the last line has no end and its last number fewer digits behind the mark, or in the exponent,
    than each above it; empty where that is not so."""
    size = stream.seek(0, 2)
    stream.seek(max(size - _END, 0))
    *above, last = lines(stream.read().replace(b"\0", b"").decode("latin-1"))
    separator = next((mark for mark in _SEPARATORS if mark in last), "")
    if not separator:
        return ""
    cell = last.rpartition(separator)[2]
    own = _digits(cell)
    rows = [line.rstrip() for line in above[-_MOST:] if line.count(separator) == last.count(separator)]
    others = [found for row in rows if (found := _digits(row.rpartition(separator)[2])) is not None]
    if own is None or len(others) < _FEWEST:
        return ""
    fewest = [min(digits) for digits in zip(*others, strict=True)]
    if all(mine >= least for mine, least in zip(own, fewest, strict=True)):
        return ""
    ends = f"the file ends without the end of a line, in {cell!r}"
    return f"{ends}, which has fewer digits than the numbers above it: it may be cut there"


def _digits(cell: str) -> tuple[int, int] | None:
    """How many a number has behind the mark and in the exponent; None of what is none."""
    found = _CUT_NUMBER.fullmatch(cell)
    return None if not cell or found is None else (len(found["decimals"] or ""), len(found["exponent"] or ""))
