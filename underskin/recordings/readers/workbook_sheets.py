"""The sheets of a workbook (.xlsx, .xlsm) as texts, a line a row, cells separated by tabs.

Formulas count by their stored value; cells that are merged down a column count in every row with numbers that they
span; no macro or link is followed. Dates are in the lab's time zone. A workbook is a ZIP archive of XML: its unpacked
size is limited, and XML that declares entities is rejected.
"""

import re
import warnings
import zipfile
from collections.abc import Collection, Iterator, Sequence
from datetime import date, datetime, time
from typing import Any, BinaryIO

import openpyxl
from openpyxl.utils import column_index_from_string

from underskin.errors import FileError, damage_said
from underskin.recordings.readers import text
from underskin.recordings.readers.parsing_limits import EXPANSION, ParsingLimits

SEPARATOR = "\t"
_WORKBOOK = "xl/workbook.xml"
_OTHERS = {
    "xl/workbook.bin": "is a binary workbook (.xlsb): save it as .xlsx or CSV",
    "content.xml": "is an OpenDocument file: save the table as .xlsx or CSV",
    "header.properties": "is a JPK force file: in JPK DP, export the curves as text (.txt)",
    "word/document.xml": "is a Word document: save the table as .xlsx or CSV",
    "ppt/presentation.xml": "is a presentation: save the table as .xlsx or CSV",
}
_SHEETS = re.compile(r"xl/worksheets/[^/]+\.xml")
_DECLARATION = re.compile(rb"<!(DOCTYPE|ENTITY)|<\0!\0(D\0O\0C|E\0N\0T)|\0<\0!\0(D\0O\0C|E\0N\0T)")
_MERGED = re.compile(rb'<(?:\w+:)?mergeCell\s+ref="([A-Z]{1,3})(\d{1,7}):\1(\d{1,7})"')  # down one column
_NO_VALUE = re.compile(  # a formula without a stored value, which a text formula may have as an empty text
    rb'<(?:\w+:)?c\s(?![^<>]*\bt="str")(?>[^<>]*?\br="(?P<cell>[A-Z]+\d+)")[^<>]*+>\s*<(?:\w+:)?f(?:\s[^<>]*)?(?:/>|>[^<]*</[^<>]*>)\s*'
    rb"(?:<(?:\w+:)?v\s*/>|<(?:\w+:)?v>\s*</[^<>]*>)?\s*</(?:\w+:)?c>"
)
_BLANKS = re.compile(r"\s+")
_Merged = Collection[tuple[int, int, int]]  # column, from 0, first and last row of cells merged down a column


def texts_of(stream: BinaryIO, file: str) -> tuple[dict[str, str], list[str]]:
    """The text of each visible sheet that has any cell, and notes; raises FileError that names sheet and cell, where
    the file is no workbook, is damaged, or unpacks to more than the settings allow."""
    texts: dict[str, str] = {}
    notes: dict[str, None] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about unread parts
        with damage_said(file, "", lambda error: f"is a damaged workbook or ZIP archive: {error}"):
            with zipfile.ZipFile(stream) as archive:
                parts = _inspected(archive, stream.seek(0, 2), file)
            book = openpyxl.load_workbook(stream, read_only=True, data_only=True, keep_links=False)
        for sheet in book.worksheets:
            place = f"sheet {sheet.title!r}"
            if sheet.sheet_state != "visible":
                notes[f"{place} is hidden, and is left out"] = None
                continue
            merged, unvalued = parts.get(sheet._worksheet_path.lstrip("/"), ((), ""))
            if unvalued:
                reason = "holds a formula without a value: open the workbook in a spreadsheet program and save it"
                raise FileError(file, f"{place}, cell {unvalued}", reason)
            with damage_said(file, place, lambda error: f"is damaged: {error}"):
                sheet.reset_dimensions()  # what is declared may be wrong
                filled = _filled(sheet.iter_rows(values_only=True), merged)
                rows = [SEPARATOR.join(_text(cell, notes) for cell in row).rstrip(SEPARATOR) for row in filled]
            width = max((row.count(SEPARATOR) for row in rows), default=0)
            while rows and not rows[-1].strip():
                rows.pop()
            if rows:
                texts[sheet.title] = "\n".join(row + SEPARATOR * (width - row.count(SEPARATOR)) for row in rows)
    return texts, list(notes)


def _inspected(archive: zipfile.ZipFile, size: int, file: str) -> dict[str, tuple[_Merged, str]]:
    """The merged cells of each sheet, and its first formula without a value; every part is unpacked once, before it is
    parsed."""
    names = archive.namelist()
    if _WORKBOOK not in names:
        descriptions = (what for name, what in _OTHERS.items() if name in names)
        raise FileError(file, "", next(descriptions, "is a ZIP archive: send the files in it"))
    remaining = most = ParsingLimits.from_environment().content_bytes(size)
    sheets: dict[str, tuple[_Merged, str]] = {}
    for name in names:
        with archive.open(name) as part:
            data = part.read(remaining + 1)
        remaining -= len(data)
        if remaining < 0:
            reason = f"it unfolds to more than {most / 1e6:.0f} MB, too much for a file of its size"
            raise FileError(file, name, f"{reason} ({EXPANSION})")
        if _DECLARATION.search(data):
            raise FileError(file, name, "declares a document type or entities, as no workbook does")
        if _SHEETS.fullmatch(name):
            unvalued = _NO_VALUE.search(data)
            spans = {
                (column_index_from_string(column.decode()) - 1, int(first), int(last))
                for column, first, last in _MERGED.findall(data)
            }
            sheets[name] = spans, unvalued["cell"].decode() if unvalued else ""
    return sheets


def _text(value: Any, notes: dict[str, None]) -> str:
    """A cell as the CSV would have it; a note on local times is added."""
    match value:
        case None:
            return ""
        case bool():
            return str(value).lower()
        case int() | float():
            return repr(value)
        case datetime():
            zone = text.time_zone()
            notes[f"times in cells are taken to be in the zone {zone} (UNDERSKIN_TIME_ZONE)"] = None
            return value.replace(microsecond=0, tzinfo=zone).isoformat()
        case date() | time():
            return value.isoformat()
    written = _BLANKS.sub(" ", str(value)).strip()
    if "," in written and not text.is_grouped(written) and text.number(written, ",") is not None:
        return written.replace(",", ".")  # as numbers are written here
    return f'"{written.replace(chr(34), chr(34) * 2)}"' if '"' in written else written


def _filled(rows: Iterator[Sequence[Any]], merged: _Merged) -> Iterator[Sequence[Any]]:
    """The rows, where a merged cell counts in every row with numbers that it spans: a heading over two rows does not
    count twice."""
    begins: dict[int, list[tuple[int, int]]] = {}
    for column, first, last in merged:
        begins.setdefault(first, []).append((column, last))
    spanning: dict[int, tuple[int, Any]] = {}
    for number, row in enumerate(rows, 1):
        cells = [*row, *[None] * (max([*spanning, -1]) + 1 - len(row))]
        if spanning and any(isinstance(cell, int | float) for cell in cells):
            for column, (last, value) in spanning.items():
                if number <= last and cells[column] is None:
                    cells[column] = value
        for column, last in begins.get(number, ()):
            spanning[column] = last, cells[column] if column < len(cells) else None
        yield cells
