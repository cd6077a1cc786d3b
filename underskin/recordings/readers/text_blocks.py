"""A text read in blocks of whole lines, so that a long file never lies in memory as a whole."""

import codecs
from collections.abc import Iterator
from typing import BinaryIO

from underskin.errors import FileError
from underskin.recordings.readers import text

BLOCK_BYTES = 1 << 20


class BlockText:
    """The text of an open file; it may be gone through any number of times.

    Raises FileError where the bytes are no text.
    """

    def __init__(self, stream: BinaryIO, file: str) -> None:
        self._stream = stream
        self._encoding, self._start = _encoding(stream, file)

    def blocks(self) -> Iterator[str]:
        """Whole lines, about BLOCK_BYTES at a time, without the end of the last of them; line ends are a line feed."""
        decoder = codecs.getincrementaldecoder(self._encoding)()
        rest = ""
        for data in _pieces(self._stream, self._start):
            rest += decoder.decode(data)
            end = len(rest) - rest.endswith("\r")  # a line feed may follow
            cut = max(rest.rfind("\n", 0, end), rest.rfind("\r", 0, end))
            if cut >= 0:
                yield _line_feeds(rest[:cut].removesuffix("\r") if rest[cut] == "\n" else rest[:cut])
                rest = rest[cut + 1 :]
        yield _line_feeds(rest)

    def lines(self) -> Iterator[str]:
        """Line by line."""
        for block in self.blocks():
            yield from block.split("\n")


def _pieces(stream: BinaryIO, start: int) -> Iterator[bytes]:
    """The bytes of a stream from a place on; others may move in it meanwhile."""
    while True:
        stream.seek(start)
        data = stream.read(BLOCK_BYTES)
        if not data:
            return
        start += len(data)
        yield data


def _line_feeds(lines: str) -> str:
    return lines.replace("\r\n", "\n").replace("\r", "\n") if "\r" in lines else lines


def _encoding(stream: BinaryIO, file: str) -> tuple[str, int]:
    """The encoding of a text, as `text.decode` finds it, and where it begins."""
    stream.seek(0)
    head = stream.read(BLOCK_BYTES)
    marked = text.marked_encoding(head)
    if marked is not None:
        _require_whole(stream, *marked, file)
        return marked
    place = 0
    for data in _pieces(stream, 0):
        zero = data.find(0)
        if zero >= 0:
            raise FileError(file, f"byte {place + zero}", "is no text: it holds a zero byte")
        place += len(data)
    try:
        decoder = codecs.getincrementaldecoder("utf-8")()
        for data in _pieces(stream, 0):
            decoder.decode(data)
        decoder.decode(b"", final=True)
    except UnicodeDecodeError:
        return "latin-1", 0
    return "utf-8", 0


def _require_whole(stream: BinaryIO, encoding: str, start: int, file: str) -> None:
    """Raises FileError where the bytes behind the mark are not of the encoding."""
    decoder = codecs.getincrementaldecoder(encoding)()
    place = 0  # from the mark on
    try:
        for data in _pieces(stream, start):
            held = len(decoder.getstate()[0])
            decoder.decode(data)
            place += len(data)
        held = len(decoder.getstate()[0])
        decoder.decode(b"", final=True)
    except UnicodeDecodeError as error:
        raise text.no_text(file, place - held + error.start, encoding, error.reason) from None
