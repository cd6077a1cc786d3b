"""The plain rows of a block of lines: those whose columns of numbers hold numbers, all read at once.

What else a line may be (blank, a comment, a row with something wrong in it) is left to whoever reads single lines.
Cells are what `text.cells` gives, and numbers what `text.number` reads.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from underskin.recordings.readers import cell_bytes, text
from underskin.recordings.readers.cell_bytes import QUOTE, CellBytes
from underskin.units import Floats, Mask


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
        cells = cell_bytes.part(lines, style.separator, style.width, is_template=style.is_template)
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
