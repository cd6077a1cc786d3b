"""Where the numbers of a text table are: separator, decimal mark, which columns hold numbers.

A row holds a number in every column of numbers; other columns hold text. The separator and the decimal mark are those
with the longest run of rows, among equals those with the fewest columns of text.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

from underskin.errors import FileError
from underskin.recordings.readers import text
from underskin.recordings.readers.cell_bytes import BLANKS

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
