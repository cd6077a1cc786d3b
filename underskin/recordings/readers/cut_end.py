"""Whether a text was cut within its last number, as by a full disk or a connection that broke."""

import re
from typing import BinaryIO

from underskin.recordings.readers import text

_LOOKED_AT = 1 << 16  # bytes at the end
_FEWEST, _MOST = 3, 50  # lines above that say how many digits numbers have
_SEPARATORS = "\t;, "
_NUMBER = re.compile(r"[+-]?\d*(?:[.,](?P<decimals>\d*))?(?:[eE][+-]?(?P<exponent>\d*))?")


def warning(stream: BinaryIO) -> str:
    """In words, that the last line has no end and its last number fewer digits behind the mark, or in the exponent,
    than each above it; empty where that is not so."""
    size = stream.seek(0, 2)
    stream.seek(max(size - _LOOKED_AT, 0))
    *above, last = text.lines(stream.read().replace(b"\0", b"").decode("latin-1"))
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
    found = _NUMBER.fullmatch(cell)
    return None if not cell or found is None else (len(found["decimals"] or ""), len(found["exponent"] or ""))
