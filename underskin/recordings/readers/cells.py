"""Cells of tables in text files, fast.

Lines of text parted into cells, by the bytes of all of them at once.

A line is taken if `text.cells` would part it alike: it has no more cells than the table has columns, and its quotes
hold whole cells. Others are left out.

A text read in blocks of whole lines, so that a long file never lies in memory as a whole.

The plain rows of a block of lines: those whose columns of numbers hold numbers, all read at once.

What else a line may be (blank, a comment, a row with something wrong in it) is left to whoever reads single lines.
Cells are what `text.cells` gives, and numbers what `text.number` reads.

Where the numbers of a text table are: separator, decimal mark, which columns hold numbers.

A row holds a number in every column of numbers; other columns hold text. The separator and the decimal mark are those
with the longest run of rows, among equals those with the fewest columns of text.
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
# Between other bytes than these, a line may be parted at more than its blanks.
_PARTED_AT_BLANKS = np.zeros(256, bool)
_PARTED_AT_BLANKS[[NEWLINE, *(mark for mark in range(_BLANK, 127) if mark not in b';"')]] = True


@dataclass(frozen=True)
class CellBytes:
    """The cells of lines with `width` cells each: `data` has them one behind another, each with a line feed behind it;
    `lengths` (lines, width) count it; `lines` says which line each is, from 0."""

    data: Bytes
    lengths: Places
    lines: Places

    def of(self, cells: Mask) -> Bytes:
        """The bytes of some of the cells (lines, width)."""
        return self.data if cells.all() else self.data[np.repeat(cells.ravel(), self.lengths.ravel())]

    def having(self, places: Mask) -> Mask:
        """Which cells (lines, width) have any of some bytes."""
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
    """The cells of the lines that have at most `width`; those that a line lacks are empty.

    `is_template`: lines that begin with # or sep= may say nothing, and are left out.
    """
    block = _Lines("\n".join(lines))
    if separator == BLANKS:
        block.leave_out(block.having(~_PARTED_AT_BLANKS[block.data]))
        block.part_at_single_blanks()
    if is_template:
        block.leave_out(_may_say_nothing(block))
    _leave_out_odd_quotes(block, ord(separator))
    _bring_to_width(block, ord(separator), width)
    marks = _marks(block.data, ord(separator))
    data = block.data.copy()
    data[marks] = NEWLINE
    return CellBytes(data, np.diff(marks, prepend=-1).reshape(-1, width), block.lines)


class _Lines:
    """Lines as bytes, each with a line feed behind it, and which each is."""

    def __init__(self, lines: str) -> None:
        self.data: Bytes = np.frombuffer(f"{lines}\n".encode(), np.uint8)
        self.lines: Places = np.arange(np.count_nonzero(self.data == NEWLINE))

    def ends(self) -> Places:
        """Where the line feed of each line is."""
        return np.flatnonzero(self.data == NEWLINE)

    def starts(self) -> Places:
        """Where each line begins."""
        return np.append(0, self.ends() + 1)[:-1]

    def lengths(self) -> Places:
        """How many bytes each line has, with its line feed."""
        return np.diff(self.ends(), prepend=-1)

    def having(self, places: Mask) -> Mask:
        """Which lines have any of some bytes."""
        return np.logical_or.reduceat(places, self.starts()) if self.lines.size else np.zeros(0, bool)

    def leave_out(self, lines: Mask) -> None:
        """Leave some of the lines out."""
        if lines.any():
            self.data = self.data[np.repeat(~lines, self.lengths())]
            self.lines = self.lines[~lines]

    def part_at_single_blanks(self) -> None:
        """Leave one blank between two others, and none at the ends of lines."""
        after = np.append(self.data[1:], NEWLINE)
        self.data = self.data[(self.data != _BLANK) | ((after != _BLANK) & (after != NEWLINE))]
        before = np.insert(self.data[:-1], 0, NEWLINE)
        self.data = self.data[(self.data != _BLANK) | (before != NEWLINE)]


def _may_say_nothing(block: _Lines) -> Mask:
    """Which lines begin with # or sep=, within quotes or behind a blank too."""
    starts = block.starts()
    for skipped in (_BLANK, QUOTE):
        starts = starts + (block.data[starts] == skipped)
    first = block.data[starts]
    fourth = block.data[np.minimum(starts + 3, block.data.size - 1)]
    told = ((first | _TO_SMALL) == _SMALL_S) & (fourth == _EQUALS)
    return np.asarray((first == _HASH) | (first == _BLANK) | told)


def _leave_out_odd_quotes(block: _Lines, separator: int) -> None:
    """Leave out the lines in which quotes are not around whole cells."""
    quotes = block.data == QUOTE
    if not quotes.any():
        return
    block.leave_out(np.add.reduceat(quotes, block.starts(), dtype=np.intp) % 2 == 1)
    quotes, inside = block.data == QUOTE, _inside(block.data)
    beside = (block.data == separator) | (block.data == NEWLINE)
    before, after = np.append(True, beside)[:-1], np.append(beside, True)[1:]
    block.leave_out(block.having(quotes & ~np.where(inside, before, after)))


def _inside(data: Bytes) -> Mask:
    """Which bytes lie within quotes, from each that opens to before the one that closes."""
    return np.asarray(np.logical_xor.accumulate(data == QUOTE))


def _marks(data: Bytes, separator: int) -> Places:
    """Where the separators and line feeds are that end cells."""
    marks = (data == separator) | (data == NEWLINE)
    return np.flatnonzero(marks & ~_inside(data) if (data == QUOTE).any() else marks)


def _bring_to_width(block: _Lines, separator: int, width: int) -> None:
    """Add separators to lines with fewer cells, take some from the ends of those with more, and leave out those whose
    surplus cells hold anything."""
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
    """How many cells each line has beyond the width; less than 0 where it lacks some."""
    ends = block.data[_marks(block.data, separator)] == NEWLINE
    return np.diff(np.flatnonzero(ends), prepend=-1) - width


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


@dataclass(frozen=True)
class RowStyle:
    """How rows are written: `width` cells, of which `columns` hold numbers.

    `is_template`: as csv_template.py has them, where such a cell may be empty, and lines that begin with # or sep= may
    say nothing.
    """

    separator: str
    decimal: str
    columns: Sequence[int]
    width: int
    is_template: bool = False


class PlainRows:
    """The plain rows among some lines.

    `numbers` has the values of each column of numbers, nan where a cell is empty; `filled` (rows, columns) says where
    none is.
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
        """The rows that follow each other without another line between: which line the first is, from 0, which row it
        is, and the row behind the last."""
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
    """The lines with nothing in any cell, or with none or a byte of no number in a column of numbers."""
    filled = cells.lengths > 1
    wrong = _in_columns(cells, style.columns) & cells.having(~_OF_NUMBERS[style.decimal][cells.data])
    digits = cells.having((cells.data > ord('"')) & (cells.data != ord("-")))  # np.fromstring reads a blank as -1
    wrong |= _in_columns(cells, style.columns) & filled & ~digits
    if not style.is_template:
        wrong |= _in_columns(cells, style.columns) & ~filled
    return np.asarray(wrong.any(axis=1) | ~filled.any(axis=1))


def _numbers(cells: CellBytes, style: RowStyle) -> Floats | None:
    """The numbers in all cells that hold some, row by row; None where one cannot be read."""
    wanted = _in_columns(cells, style.columns) & (cells.lengths > 1)
    data = cells.of(wanted)
    joined = data[data != QUOTE].tobytes().replace(text.MINUS.encode(), b"-").replace(style.decimal.encode(), b".")
    count = np.count_nonzero(wanted)
    try:
        # A line feed ends each number, and blanks may stand around it.
        found = np.fromstring(joined.replace(b"\n", b",")[:-1], sep=",") if count else np.empty(0)
    except ValueError:
        return None
    return found if found.size == count else None


def _unreadable(cells: CellBytes, style: RowStyle) -> Mask:
    """The lines in which a cell of a column of numbers holds something else."""
    filled = cells.lengths[:, list(style.columns)] > 1
    readable = [text.number(cell, style.decimal) is not None for cell in _texts(cells, style.columns)]
    return np.asarray((filled & ~np.reshape(readable, filled.shape)).any(axis=1))


def _by_column(values: Floats, filled: Mask) -> list[Floats]:
    """The numbers of each column, in memory of its own."""
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
    """Where the rows begin and how they are written; `columns` are those that hold numbers, of `width` in all."""

    start: int
    separator: str
    decimal: str
    columns: tuple[int, ...]
    width: int

    def cells(self, line: str) -> list[str]:
        """The cells of a line; none where there is one at most, or quotes do not close."""
        return split(line, self.separator)

    def row(self, line: str) -> list[float] | None:
        """The numbers of a row, one for each of `columns`; None where the line is none."""
        cells = self.cells(line)
        if not max(self.columns) < len(cells) <= self.width:
            return None
        numbers = [text.number(cells[column], self.decimal) for column in self.columns]
        return None if None in numbers else [number for number in numbers if number is not None]


def split(line: str, separator: str) -> list[str]:
    """The cells of a line, without empty ones at its end; none where there is one at most, or quotes do not close."""
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
    """How many cells a line has room for, those at its end too that are empty."""
    return len(split(line, separator)) if separator == BLANKS else line.count(separator) + 1


def uncommented(line: str) -> str:
    """The line without the mark that begins a comment."""
    return _COMMENT.sub("", line, count=1) if is_comment(line) else line


def is_comment(line: str) -> bool:
    """Whether a line begins with a mark of comments: #, %, // or !."""
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
    """How many numbers the line with most of them holds, however it is separated, and its index."""
    counts = [max(_count(line, *style) for style in _STYLES) for line in lines]
    most = max(counts)
    return most, counts.index(most)


def _count(line: str, separator: str, decimal: str) -> int:
    cells = split(line, separator) or [line]
    return sum(text.number(cell, decimal) is not None for cell in cells)


def _columns(line: str, separator: str, decimal: str) -> tuple[int, ...]:
    """Which cells of a line are numbers; none where fewer than two are."""
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
    """What is wrong with a line among the rows."""
    where = "" if len(table.columns) == table.width else f" in {table.width} columns"
    expected = f"must be a row of {len(table.columns)} numbers{where}, as above it; found {line[:60]!r}"
    return FileError(file, f"line {index + 1}", expected)
