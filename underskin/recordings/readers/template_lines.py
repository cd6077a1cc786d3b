"""The lines of the CSV template as rows of cells, which may be gone through any number of times."""

import re
from collections.abc import Iterator, Sequence

from underskin.errors import FileError
from underskin.recordings.campaign import SCHEMA
from underskin.recordings.readers import text
from underskin.recordings.readers.plain_rows import PlainRows, RowStyle
from underskin.recordings.readers.text_blocks import BlockText

_FIRST_LINE = 2000
_TO_SPREADSHEETS = re.compile(r"sep=\S?\s*", re.IGNORECASE)
_SEPARATORS = ("\t", ";", ",")


def separator_of(start: str) -> str | None:
    """The separator of a template that begins so; None where this is none."""
    first = next((line for line in text.lines(start[:_FIRST_LINE]) if not _says_nothing(line)), "")
    return next((mark for mark in _SEPARATORS if _first_cells(first, mark) == ["schema", SCHEMA]), None)


def _first_cells(line: str, separator: str) -> list[str]:
    try:
        return [cell.lower() for cell in text.cells(line, separator)[:2]]
    except ValueError:
        return []


def _says_nothing(line: str) -> bool:
    """Whether a line is blank, a comment, or tells a spreadsheet its separator."""
    bare = line.strip().strip('"')
    return not bare or bare.startswith("#") or _TO_SPREADSHEETS.fullmatch(bare) is not None


def is_note(row: Sequence[str]) -> bool:
    """Whether a row may be a note: it begins with its first cell, and none holds a number."""
    return bool(row[0]) and not any(text.is_grouped(cell) or _is_number(cell) for cell in row)


def note_told(number: int, row: Sequence[str]) -> str:
    """That a note on a line, counted from 1, is left out, in words."""
    return f"line {number} under the table, {', '.join(filter(None, row))!r}, is left out"


def _is_number(cell: str) -> bool:
    return any(text.number(cell, mark) is not None for mark in ".,")


class TemplateLines:
    """The lines, and the cells of each; a line that says nothing has one empty cell."""

    def __init__(self, source: BlockText, separator: str, file: str) -> None:
        self._source = source
        self.separator = separator
        self._file = file

    def __iter__(self) -> Iterator[list[str]]:
        for index, line in enumerate(self._source.lines()):
            yield self.cells(index, line)

    def cells(self, index: int, line: str) -> list[str]:
        """The cells of the line at an index, from 0; raises FileError where its quotes do not close."""
        try:
            cells = text.cells(line, self.separator)
        except ValueError as error:
            if not _says_nothing(line):
                raise FileError(self._file, f"line {index + 1}", str(error)) from None
            cells = [""]
        # An id may begin with #, as numbers of presses do: then numbers follow it.
        counts = any(map(_is_number, cells[1:]))
        return cells if counts or not _says_nothing(line) else [""]

    def holding(self, mark: str) -> Iterator[list[str]]:
        """The cells of the lines that hold a mark."""
        first = 0
        for block in self._source.blocks():
            lines = block.split("\n")
            if mark in block:
                for index, line in enumerate(lines, start=first):
                    if mark in line:
                        yield self.cells(index, line)
            first += len(lines)

    def blocks(self, start: int, end: int | None = None) -> Iterator[tuple[int, list[str]]]:
        """The lines from one index to another, some at a time, with the index of the first of them."""
        first = 0
        for block in self._source.blocks():
            lines = block.split("\n")
            some = lines[max(0, start - first) : None if end is None else max(0, end - first)]
            if some:
                yield max(start, first), some
            first += len(lines)

    def under(self, places: Sequence[int], width: int, start: int, end: int) -> Iterator[list[str]]:
        """The cells at some of `width` places, of each line from one index to another."""
        style = RowStyle(self.separator, ".", (), width, is_template=True)
        for first, lines in self.blocks(start, end):
            rows = PlainRows(lines, style)
            taken = 0
            for line, row, behind in rows.runs():
                yield from self._under(places, first + taken, lines[taken:line])
                columns = [[cell.strip() for cell in rows.texts(place, row, behind)] for place in places]
                yield from map(list, zip(*columns, strict=True))
                taken = line + behind - row
            yield from self._under(places, first + taken, lines[taken:])

    def _under(self, places: Sequence[int], first: int, lines: Sequence[str]) -> Iterator[list[str]]:
        for index, line in enumerate(lines, start=first):
            cells = self.cells(index, line)
            yield [cells[place] if place < len(cells) else "" for place in places]
