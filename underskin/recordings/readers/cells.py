"""Cells of tables in text files, parsed in bulk.

A text is read in blocks of whole lines, so that a long file is never in memory as a whole (`BlockText`). Lines of a
block are split into cells on their bytes at once (`part`), where `text.cells` would give the same result: they have at
most as many cells as the table has columns, and quotes enclose whole cells. `PlainRows` are the lines whose columns of
numbers hold numbers, as `text.number` reads them; other lines (blank, comments, invalid rows) are left to the caller.

`find` locates the table: a row holds a number in every column of numbers; other columns hold text. Separator and
decimal mark are those with the longest run of rows, and among equals with the fewest columns of text.
"""

import codecs
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from underskin.errors import FileError
from underskin.recordings.readers import text
from underskin.units import Floats, Mask

Bytes = NDArray[np.uint8]
Places = NDArray[np.intp]

BLANKS = " "
QUOTE, NEWLINE = b'"\n'
_BLANK, _HASH, _EQUALS = b" #="
_SMALL_S, _TO_SMALL = ord("s"), 0x20
# A line with other bytes than these may be split at more than its blanks.
_PARTED_AT_BLANKS = np.zeros(256, bool)
_PARTED_AT_BLANKS[[NEWLINE, *(mark for mark in range(_BLANK, 127) if mark not in b';"')]] = True


@dataclass(frozen=True)
class CellBytes:
    """The cells of lines with `width` cells each: `data` holds them in sequence, each followed by a line feed, which
    `lengths` (lines, width) include; `lines` are the indices of the lines, from 0."""

    data: Bytes
    lengths: Places
    lines: Places

    def of(self, cells: Mask) -> Bytes:
        """The bytes of some of the cells (lines, width)."""
        return self.data if cells.all() else self.data[np.repeat(cells.ravel(), self.lengths.ravel())]

    def having(self, places: Mask) -> Mask:
        """Which cells (lines, width) contain any of these bytes."""
        if not self.lines.size:
            return np.zeros(self.lengths.shape, bool)
        starts = np.cumsum(self.lengths.ravel()) - self.lengths.ravel()
        return np.logical_or.reduceat(places, starts).reshape(self.lengths.shape)

    def without(self, lines: Mask) -> "CellBytes":
        """Without some of the lines."""
        if not lines.any():
            return self
        data = self.data[np.repeat(~lines, self.lengths.sum(axis=1))]
        return CellBytes(data, self.lengths[~lines], self.lines[~lines])


def part(lines: Sequence[str], separator: str, width: int, *, is_template: bool) -> CellBytes:
    """The cells of the lines that have at most `width`, padded with empty ones.

    `is_template`: lines that begin with # or sep= may be comments, and are left out.
    """
    block = _Lines("\n".join(lines))
    if separator == BLANKS:
        block.leave_out(block.having(~_PARTED_AT_BLANKS[block.data]))
        block.part_at_single_blanks()
    if is_template:
        block.leave_out(_may_be_empty_line(block))
    _leave_out_odd_quotes(block, ord(separator))
    _bring_to_width(block, ord(separator), width)
    marks = _marks(block.data, ord(separator))
    data = block.data.copy()
    data[marks] = NEWLINE
    return CellBytes(data, np.diff(marks, prepend=-1).reshape(-1, width), block.lines)


class _Lines:
    """Lines as bytes, each followed by a line feed, and their indices."""

    def __init__(self, lines: str) -> None:
        self.data: Bytes = np.frombuffer(f"{lines}\n".encode(), np.uint8)
        self.lines: Places = np.arange(np.count_nonzero(self.data == NEWLINE))

    def ends(self) -> Places:
        """The offset of the line feed of each line."""
        return np.flatnonzero(self.data == NEWLINE)

    def starts(self) -> Places:
        """The offset of the start of each line."""
        return np.append(0, self.ends() + 1)[:-1]

    def lengths(self) -> Places:
        """The number of bytes of each line, with its line feed."""
        return np.diff(self.ends(), prepend=-1)

    def having(self, places: Mask) -> Mask:
        """Which lines contain any of these bytes."""
        return np.logical_or.reduceat(places, self.starts()) if self.lines.size else np.zeros(0, bool)

    def leave_out(self, lines: Mask) -> None:
        """Remove some of the lines."""
        if lines.any():
            self.data = self.data[np.repeat(~lines, self.lengths())]
            self.lines = self.lines[~lines]

    def part_at_single_blanks(self) -> None:
        """Collapse runs of blanks to one, and remove those at the ends of lines."""
        after = np.append(self.data[1:], NEWLINE)
        self.data = self.data[(self.data != _BLANK) | ((after != _BLANK) & (after != NEWLINE))]
        before = np.insert(self.data[:-1], 0, NEWLINE)
        self.data = self.data[(self.data != _BLANK) | (before != NEWLINE)]


def _may_be_empty_line(block: _Lines) -> Mask:
    """Which lines begin with # or sep=, also within quotes or after a blank."""
    starts = block.starts()
    for skipped in (_BLANK, QUOTE):
        starts = starts + (block.data[starts] == skipped)
    first = block.data[starts]
    fourth = block.data[np.minimum(starts + 3, block.data.size - 1)]
    is_separator_line = ((first | _TO_SMALL) == _SMALL_S) & (fourth == _EQUALS)
    return np.asarray((first == _HASH) | (first == _BLANK) | is_separator_line)


def _leave_out_odd_quotes(block: _Lines, separator: int) -> None:
    """Remove the lines in which quotes do not enclose whole cells."""
    quotes = block.data == QUOTE
    if not quotes.any():
        return
    block.leave_out(np.add.reduceat(quotes, block.starts(), dtype=np.intp) % 2 == 1)
    quotes, inside = block.data == QUOTE, _inside(block.data)
    delimiters = (block.data == separator) | (block.data == NEWLINE)
    before, after = np.append(True, delimiters)[:-1], np.append(delimiters, True)[1:]
    block.leave_out(block.having(quotes & ~np.where(inside, before, after)))


def _inside(data: Bytes) -> Mask:
    """Which bytes lie within quotes, from each opening quote to before the closing one."""
    return np.asarray(np.logical_xor.accumulate(data == QUOTE))


def _marks(data: Bytes, separator: int) -> Places:
    """The offsets of the separators and line feeds that end cells."""
    marks = (data == separator) | (data == NEWLINE)
    return np.flatnonzero(marks & ~_inside(data) if (data == QUOTE).any() else marks)


def _bring_to_width(block: _Lines, separator: int, width: int) -> None:
    """Pad lines with fewer cells by separators, remove empty surplus cells at their ends, and remove lines with other
    surplus cells."""
    surplus = _surplus(block, separator, width)
    if (surplus > 0).any():
        ends = block.ends()
        places = np.where(block.data == separator, -1, np.arange(block.data.size))
        places[ends] = -1
        last = np.maximum(np.maximum.reduceat(places, block.starts()), block.starts() - 1)
        block.leave_out(surplus > ends - 1 - last)
        surplus = _surplus(block, separator, width)
        from_end = np.repeat(block.ends(), block.lengths()) - np.arange(block.data.size)
        block.data = block.data[(from_end == 0) | (from_end > np.repeat(surplus, block.lengths()))]
        surplus = _surplus(block, separator, width)
    block.data = np.insert(block.data, np.repeat(block.ends(), -surplus), separator)


def _surplus(block: _Lines, separator: int, width: int) -> Places:
    """The number of cells of each line beyond the width; negative where some are missing."""
    ends = block.data[_marks(block.data, separator)] == NEWLINE
    return np.diff(np.flatnonzero(ends), prepend=-1) - width


BLOCK_BYTES = 1 << 20


class BlockText:
    """The text of an open file, which can be iterated any number of times.

    Raises FileError where the bytes are no text.
    """

    def __init__(self, stream: BinaryIO, file: str) -> None:
        self._stream = stream
        self._encoding, self._start = _encoding(stream, file)

    def blocks(self) -> Iterator[str]:
        """Whole lines, about BLOCK_BYTES at a time, without the last line end; line ends are line feeds."""
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
    """The bytes of a stream from an offset on; its position may change in between."""
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
    """The encoding of a text as by `text.decode`, and the offset of its start."""
    stream.seek(0)
    head = stream.read(BLOCK_BYTES)
    marked = text.marked_encoding(head)
    if marked is not None:
        _require_decodable(stream, *marked, file)
        return marked
    offset = 0
    for data in _pieces(stream, 0):
        zero = data.find(0)
        if zero >= 0:
            raise FileError(file, f"byte {offset + zero}", "is no text: it holds a zero byte")
        offset += len(data)
    try:
        decoder = codecs.getincrementaldecoder("utf-8")()
        for data in _pieces(stream, 0):
            decoder.decode(data)
        decoder.decode(b"", final=True)
    except UnicodeDecodeError:
        return "latin-1", 0
    return "utf-8", 0


def _require_decodable(stream: BinaryIO, encoding: str, start: int, file: str) -> None:
    """Raise FileError where the bytes after the mark are invalid in the encoding."""
    decoder = codecs.getincrementaldecoder(encoding)()
    offset = 0  # from the mark on
    try:
        for data in _pieces(stream, start):
            pending = len(decoder.getstate()[0])
            decoder.decode(data)
            offset += len(data)
        pending = len(decoder.getstate()[0])
        decoder.decode(b"", final=True)
    except UnicodeDecodeError as error:
        raise text.no_text(file, offset - pending + error.start, encoding, error.reason) from None


@dataclass(frozen=True)
class RowStyle:
    """How rows are written: `width` cells, of which `columns` hold numbers.

    `is_template`: as in csv_template.py, where such a cell may be empty, and lines that begin with # or sep= may be
    comments.
    """

    separator: str
    decimal: str
    columns: Sequence[int]
    width: int
    is_template: bool = False


class PlainRows:
    """The plain rows among some lines.

    `numbers`: the values of each column of numbers, nan for empty cells; `filled` (rows, columns): the non-empty cells.
    """

    def __init__(self, lines: Sequence[str], style: RowStyle) -> None:
        cells = part(lines, style.separator, style.width, is_template=style.is_template)
        cells = cells.without(_refused(cells, style))
        columns = list(style.columns)
        values = _numbers(cells, style)
        if values is None:
            cells = cells.without(_unreadable(cells, style))
            values = _numbers(cells, style)
            assert values is not None
        self._cells = cells
        self._texts: dict[int, list[str]] = {}
        self.filled: Mask = cells.lengths[:, columns] > 1
        self.numbers: list[Floats] = _by_column(values, self.filled)

    def runs(self) -> Iterator[tuple[int, int, int]]:
        """Runs of consecutive rows: the line index of the first, from 0, its row index, and the row index after the
        last."""
        lines = self._cells.lines
        breaks = (np.flatnonzero(np.diff(lines) != 1) + 1).tolist()
        for start, end in zip([0, *breaks], [*breaks, lines.size], strict=True):
            if end > start:
                yield int(lines[start]), start, end

    def texts(self, column: int, start: int, end: int) -> list[str]:
        """The cells of a column in some rows, without their quotes and not stripped."""
        lengths = self._cells.lengths
        if (lengths[start:end, column] == 1).all():
            return [""] * (end - start)
        if column not in self._texts:
            self._texts[column] = _texts(self._cells, [column])
        return self._texts[column][start:end]


def _in_columns(cells: CellBytes, columns: Sequence[int]) -> Mask:
    wanted = np.zeros(cells.lengths.shape, bool)
    wanted[:, list(columns)] = True
    return wanted


def _texts(cells: CellBytes, columns: Sequence[int]) -> list[str]:
    """The cells of some columns, row by row."""
    data = cells.of(_in_columns(cells, columns))
    return data[data != QUOTE].tobytes().decode().split("\n")[:-1]


def _refused(cells: CellBytes, style: RowStyle) -> Mask:
    """The lines without any content, or with an empty or non-numeric cell in a column of numbers."""
    filled = cells.lengths > 1
    wrong = _in_columns(cells, style.columns) & cells.having(~_OF_NUMBERS[style.decimal][cells.data])
    digits = cells.having((cells.data > ord('"')) & (cells.data != ord("-")))  # np.fromstring reads a blank as -1
    wrong |= _in_columns(cells, style.columns) & filled & ~digits
    if not style.is_template:
        wrong |= _in_columns(cells, style.columns) & ~filled
    return np.asarray(wrong.any(axis=1) | ~filled.any(axis=1))


def _numbers(cells: CellBytes, style: RowStyle) -> Floats | None:
    """The numbers of all non-empty cells, row by row; None where one cannot be read."""
    wanted = _in_columns(cells, style.columns) & (cells.lengths > 1)
    data = cells.of(wanted)
    joined = data[data != QUOTE].tobytes().replace(text.MINUS.encode(), b"-").replace(style.decimal.encode(), b".")
    count = np.count_nonzero(wanted)
    try:
        # A line feed ends each number, and blanks may stand around it.
        numbers = np.fromstring(joined.replace(b"\n", b",")[:-1], sep=",") if count else np.empty(0)
    except ValueError:
        return None
    return numbers if numbers.size == count else None


def _unreadable(cells: CellBytes, style: RowStyle) -> Mask:
    """The lines in which a cell of a column of numbers is no number."""
    filled = cells.lengths[:, list(style.columns)] > 1
    readable = [text.number(cell, style.decimal) is not None for cell in _texts(cells, style.columns)]
    return np.asarray((filled & ~np.reshape(readable, filled.shape)).any(axis=1))


def _by_column(values: Floats, filled: Mask) -> list[Floats]:
    """The numbers of each column as a contiguous copy."""
    if filled.all():
        return [column.copy() for column in values.reshape(filled.shape).T]
    spread = np.full(filled.shape, np.nan)
    spread[filled] = values
    return [column.copy() for column in spread.T]


def _bytes_of_numbers(decimal: str) -> Mask:
    """By byte, whether it may be in a cell that holds a number."""
    may_be = np.zeros(256, bool)
    may_be[list(b'0123456789+-eE nNaAiIfFtTyY"\n' + text.MINUS.encode() + decimal.encode())] = True
    return may_be


_OF_NUMBERS = {decimal: _bytes_of_numbers(decimal) for decimal in ".,"}


_STYLES = (("\t", "."), (";", "."), (",", "."), ("\t", ","), (";", ","), (BLANKS, "."), (BLANKS, ","))
_TOKEN = re.compile(r'"[^"]*"|\S+')
_COMMENT = re.compile(r"\s*(#|%|//|!)+\s*")
_LEAST = 2  # columns of numbers, rows of a table


@dataclass(frozen=True)
class Table:
    """The first row and the style of the rows; `columns`: those that hold numbers, of `width` in all."""

    start: int
    separator: str
    decimal: str
    columns: tuple[int, ...]
    width: int

    def cells(self, line: str) -> list[str]:
        """The cells of a line; empty for at most one cell, or unclosed quotes."""
        return split(line, self.separator)

    def row(self, line: str) -> list[float] | None:
        """The numbers of a row, one for each of `columns`; None where the line is no row."""
        cells = self.cells(line)
        if not max(self.columns) < len(cells) <= self.width:
            return None
        numbers = [text.number(cells[column], self.decimal) for column in self.columns]
        return None if None in numbers else [number for number in numbers if number is not None]


def split(line: str, separator: str) -> list[str]:
    """The cells of a line without empty ones at its end; empty for at most one cell, or unclosed quotes."""
    if separator == BLANKS:
        return _tokens(line) if " " in line and "\t" not in line and ";" not in line else []
    try:
        return text.cells(line, separator) if separator in line else []
    except ValueError:
        return []


def _tokens(line: str) -> list[str]:
    tokens = [token.strip('"') for token in _TOKEN.findall(line)] if '"' in line else line.split()
    return tokens if len(tokens) > 1 else []


def room(line: str, separator: str) -> int:
    """The number of cells of a line, including empty ones at its end."""
    return len(split(line, separator)) if separator == BLANKS else line.count(separator) + 1


def uncommented(line: str) -> str:
    """The line without a leading comment mark."""
    return _COMMENT.sub("", line, count=1) if is_comment(line) else line


def is_comment(line: str) -> bool:
    """Whether a line begins with a comment mark: #, %, // or !."""
    return _COMMENT.match(line) is not None


def find(lines: Sequence[str]) -> Table | None:
    """The table of a text; None where no two rows of at least two numbers follow each other."""
    filled = [line for line in lines if line.strip()]
    has_commas = any("," in line for line in filled)
    best, most = None, 0.0
    for separator, decimal in _STYLES:
        if decimal == "," and not has_commas:
            continue
        columns, first, length = _longest_run([_columns(line, separator, decimal) for line in filled])
        if length < _LEAST:
            continue
        run = filled[first : first + length]
        rows = length * len(columns) / max(len(split(line, separator)) for line in run)
        if rows > most:
            width = max(room(line, separator) for line in run)
            best, most = Table(0, separator, decimal, columns, width), rows
    if best is None:
        return None
    return replace(best, start=next(index for index, line in enumerate(lines) if best.row(line) is not None))


def most_numbers(lines: Sequence[str]) -> tuple[int, int]:
    """The number of numbers of the line with most of them, with any separator, and its index."""
    counts = [max(_count(line, *style) for style in _STYLES) for line in lines]
    most = max(counts)
    return most, counts.index(most)


def _count(line: str, separator: str, decimal: str) -> int:
    cells = split(line, separator) or [line]
    return sum(text.number(cell, decimal) is not None for cell in cells)


def _columns(line: str, separator: str, decimal: str) -> tuple[int, ...]:
    """Which cells of a line are numbers; empty where fewer than two are."""
    cells = split(line, separator)
    columns = tuple(index for index, cell in enumerate(cells) if text.number(cell, decimal) is not None)
    return columns if len(columns) >= _LEAST else ()


def _longest_run(columns_of: Sequence[tuple[int, ...]]) -> tuple[tuple[int, ...], int, int]:
    """The columns, the first line and the length of the longest run of lines with numbers in the same columns."""
    best: tuple[tuple[int, ...], int, int] = ((), 0, 0)
    first = 0
    for columns, run in groupby(columns_of):
        length = sum(1 for _ in run)
        if columns and length > best[2]:
            best = (columns, first, length)
        first += length
    return best


def no_row(index: int, line: str, table: Table, file: str) -> FileError:
    """The error for an invalid line among the rows."""
    where = "" if len(table.columns) == table.width else f" in {table.width} columns"
    expected = f"must be a row of {len(table.columns)} numbers{where}, as above it; found {line[:60]!r}"
    return FileError(file, f"line {index + 1}", expected)
