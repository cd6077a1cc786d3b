"""Lines of text parted into cells, by the bytes of all of them at once.

A line is taken if `text.cells` would part it alike: it has no more cells than the table has columns, and its quotes
hold whole cells. Others are left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underskin.units import Mask

Bytes = NDArray[np.uint8]
Places = NDArray[np.intp]

BLANKS = " "
QUOTE, NEWLINE = b'"\n'
_BLANK, _COMMENT, _EQUALS = b" #="
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
    return np.asarray((first == _COMMENT) | (first == _BLANK) | told)


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
