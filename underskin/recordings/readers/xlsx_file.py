"""Workbooks (.xlsx, .xlsm): each visible sheet as text, a line a row, cells separated by tabs, read like CSV.

One sheet may be the campaign of csv_template.py, or its head, with the table on another sheet. Otherwise each sheet
with a table of numbers is a block named after the sheet, read by csv_file.py; others are left out with a warning.
Formulas count by their stored value; cells that are merged down a column count in every row with numbers that they
span; no macro or link is followed. Dates are in the lab's time zone. A workbook is a
ZIP archive of XML: its unpacked size is limited, and XML that declares entities is rejected.
"""

import re
import warnings
import zipfile
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from datetime import date, datetime, time
from typing import Any, BinaryIO

import openpyxl
from openpyxl.utils import column_index_from_string

from underskin.errors import FileError, damage_said
from underskin.recordings.channels import Contents, Document, together
from underskin.recordings.readers import csv_file, csv_template, text
from underskin.recordings.readers.parsing_limits import EXPANSION, ParsingLimits
from underskin.recordings.readers.text import time_zone

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
_FORMULA = re.compile(rb"<(\w+:)?f[\s/>]")
_DECLARATION = re.compile(rb"<!(DOCTYPE|ENTITY)|<\0!\0(D\0O\0C|E\0N\0T)|\0<\0!\0(D\0O\0C|E\0N\0T)")
_MERGED = re.compile(rb'<(?:\w+:)?mergeCell\s+ref="([A-Z]{1,3})(\d{1,7}):\1(\d{1,7})"')  # down one column
_BLOCK, _OVERLAP = 1 << 20, 64
_BLANKS = re.compile(r"\s+")


class WorkbookSheets:
    """The visible sheets of an open workbook; `notes`: warnings for the user.

    Raises FileError where it is none, is damaged, or unpacks to more than the settings allow.
    """

    def __init__(self, stream: BinaryIO, file: str) -> None:
        self._file = file
        self._zone = time_zone()
        self.notes: list[str] = []
        self._merged: dict[str, set[tuple[int, int, int]]] = {}  # of each part: column, first and last row
        with damage_said(file, "", lambda error: f"is a damaged workbook or ZIP archive: {error}"):
            with zipfile.ZipFile(stream) as archive:
                has_formulas = self._inspected(archive, stream.seek(0, 2))
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # about unread parts
                self._books = [self._opened(stream, values=True)]
                if has_formulas:
                    self._books.append(self._opened(stream, values=False))

    @staticmethod
    def _opened(stream: BinaryIO, *, values: bool) -> Any:
        return openpyxl.load_workbook(stream, read_only=True, data_only=values, keep_links=False)

    def _inspected(self, archive: zipfile.ZipFile, size: int) -> bool:
        """Whether any sheet has a formula; every part is unpacked once, before it is parsed."""
        names = archive.namelist()
        if _WORKBOOK not in names:
            descriptions = (what for name, what in _OTHERS.items() if name in names)
            raise FileError(self._file, "", next(descriptions, "is a ZIP archive: send the files in it"))
        remaining = most = ParsingLimits.from_environment().content_bytes(size)
        formulas = False
        for name in names:
            with archive.open(name) as part:
                end = b""
                while data := part.read(_BLOCK):
                    remaining -= len(data)
                    if remaining < 0:
                        reason = f"it unfolds to more than {most / 1e6:.0f} MB, too much for a file of its size"
                        raise FileError(self._file, name, f"{reason} ({EXPANSION})")
                    seen, end = end + data, data[-_OVERLAP:]
                    if _DECLARATION.search(seen):
                        raise FileError(self._file, name, "declares a document type or entities, as no workbook does")
                    if _SHEETS.fullmatch(name):
                        formulas = formulas or bool(_FORMULA.search(seen))
                        self._merged.setdefault(name, set()).update(map(_span, _MERGED.finditer(seen)))
        return formulas

    def texts(self) -> Iterator[tuple[str, str]]:
        """Each visible sheet that has any cell: its name and its text; raises FileError that names sheet and cell."""
        for index, sheet in enumerate(self._books[0].worksheets):
            if sheet.sheet_state != "visible":
                self.notes.append(f"sheet {sheet.title!r} is hidden, and is left out")
                continue
            with (
                warnings.catch_warnings(),
                damage_said(self._file, f"sheet {sheet.title!r}", lambda error: f"is damaged: {error}"),
            ):
                warnings.simplefilter("ignore")
                sheets = [book.worksheets[index] for book in self._books]
                merged = self._merged.get(sheet._worksheet_path.lstrip("/"), set())
                filled = _filled(self._rows(sheets), merged) if merged else self._rows(sheets)
                rows = [SEPARATOR.join(map(self._text, row)).rstrip(SEPARATOR) for row in filled]
            width = max((row.count(SEPARATOR) for row in rows), default=0)
            lines = [row + SEPARATOR * (width - row.count(SEPARATOR)) for row in rows]
            while lines and not lines[-1].strip():
                lines.pop()
            if lines:
                yield sheet.title, "\n".join(lines)

    def _rows(self, sheets: Sequence[Any]) -> Iterator[Sequence[Any]]:
        """The values of each row of a sheet; `sheets`: the sheet with values and, if there are any, with formulas."""
        for sheet in sheets:
            sheet.reset_dimensions()  # what is declared may be wrong
        if len(sheets) == 1:
            yield from sheets[0].iter_rows(values_only=True)
            return
        for row, written in zip(*(sheet.iter_rows() for sheet in sheets), strict=True):
            for cell, as_written in zip(row, written, strict=True):
                # A text formula may have an empty text as its value.
                if cell.value is None and as_written.data_type == "f" and cell.data_type != "str":
                    reason = "holds a formula without a value: open the workbook in a spreadsheet program and save it"
                    raise FileError(self._file, f"sheet {cell.parent.title!r}, cell {cell.coordinate}", reason)
            yield [cell.value for cell in row]

    def _text(self, value: Any) -> str:
        """A cell as the CSV would have it."""
        match value:
            case None:
                return ""
            case bool():
                return str(value).lower()
            case int() | float():
                return repr(value)
            case datetime():
                return self._zoned(value)
            case date() | time():
                return value.isoformat()
        written = _BLANKS.sub(" ", str(value)).strip()
        if "," in written and not text.is_grouped(written) and text.number(written, ",") is not None:
            return written.replace(",", ".")  # as numbers are written here
        return f'"{written.replace(chr(34), chr(34) * 2)}"' if '"' in written else written

    def _zoned(self, moment: datetime) -> str:
        note = f"times in cells are taken to be in the zone {self._zone} (UNDERSKIN_TIME_ZONE)"
        if note not in self.notes:
            self.notes.append(note)
        return moment.replace(microsecond=0, tzinfo=self._zone).isoformat()


def _span(merged: re.Match[bytes]) -> tuple[int, int, int]:
    """Column, from 0, first and last row of cells that are merged down a column."""
    column, first, last = merged.groups()
    return column_index_from_string(column.decode()) - 1, int(first), int(last)


def _filled(rows: Iterator[Sequence[Any]], merged: Collection[tuple[int, int, int]]) -> Iterator[Sequence[Any]]:
    """The rows, where a merged cell counts in every row with numbers that it spans: a heading over two rows does not
    count twice."""
    begins: dict[int, list[tuple[int, int]]] = {}
    for column, first, last in merged:
        begins.setdefault(first, []).append((column, last))
    spanning: dict[int, tuple[int, Any]] = {}
    for number, row in enumerate(rows, 1):
        cells = [*row, *[None] * (max([*spanning, -1]) + 1 - len(row))]
        if any(isinstance(cell, int | float) for cell in cells):
            for column, (last, value) in spanning.items():
                if number <= last and cells[column] is None:
                    cells[column] = value
        for column, last in begins.get(number, ()):
            spanning[column] = last, cells[column] if column < len(cells) else None
        yield cells


def read(stream: BinaryIO, file: str) -> Contents | Document:
    """The campaign or the channels of a workbook; raises FileError that names sheet and line."""
    book = WorkbookSheets(stream, file)
    sheets = dict(book.texts())
    if not sheets:
        raise FileError(file, "", "; ".join(["has no sheet with anything in it", *book.notes]))
    campaigns = [name for name, text in sheets.items() if csv_template.is_template(text)]
    if len(campaigns) > 1:
        raise FileError(
            file, "", f"holds a campaign on each of the sheets {_listed(campaigns)}: save each as a workbook"
        )
    if campaigns:
        document = _campaign(*_with_table(campaigns[0], sheets), file)
        others = [f"sheet {name!r} is no campaign, and is left out" for name in sheets]
        return replace(document, warnings=(*document.warnings, *others, *book.notes))
    contents = _tables(sheets, file)
    return replace(contents, warnings=(*contents.warnings, *book.notes))


def sheet_text(stream: BinaryIO, sheet: str | None = None) -> dict[str, Any]:
    """The `text` of a visible non-empty sheet with cells separated by tabs: the named or the only one; raises
    FileError."""
    sheets = dict(WorkbookSheets(stream, "").texts())
    wanted = list(sheets) if sheet is None else [name for name in sheets if name == sheet]
    if len(wanted) != 1:
        available = f"those with anything in them: {_listed(list(sheets))}" if sheets else "none has anything in it"
        requirement = (
            "one sheet with columns, or be sent with the name of one" if sheet is None else f"a sheet {sheet!r}"
        )
        raise FileError("", "", f"must have {requirement}; {available}")
    return {"text": sheets[wanted[0]]}


def _listed(names: list[str]) -> str:
    return ", ".join(map(repr, names))


def _with_table(name: str, sheets: dict[str, str]) -> tuple[str, str]:
    """Remove the campaign's sheet from `sheets`, with the only sheet that has a table where it has none: its place in
    words, and its text."""
    text = sheets.pop(name)
    tables = [other for other, below in sheets.items() if csv_template.has_table(below.partition("\n")[0])]
    if csv_template.has_table(text) or len(tables) != 1:
        return f"sheet {name!r}", text
    (table,) = tables
    return f"sheet {name!r} with sheet {table!r} under it", f"{text}\n\n{sheets.pop(table)}"


def _campaign(place: str, text: str, file: str) -> Document:
    try:
        return csv_template.of_text(text, file, place)
    except FileError as error:
        raise _at(place, error) from None


def _on_sheet(name: str, error: FileError) -> FileError:
    return _at(f"sheet {name!r}", error)


def _at(place: str, error: FileError) -> FileError:
    return FileError(error.file, ", ".join(filter(None, (place, error.place))), error.reason, code=error.code)


def _tables(sheets: dict[str, str], file: str) -> Contents:
    """The tables of all sheets; raises FileError where none holds one."""
    tables: dict[str, Contents] = {}
    errors: list[FileError] = []
    for name, sheet in sheets.items():
        try:
            tables[name] = csv_file.of_text(sheet, file)
        except csv_file.NoTable as error:
            errors.append(_on_sheet(name, error))
        except FileError as error:
            raise _on_sheet(name, error) from None
    if not tables:
        raise FileError(file, "", "; ".join(f"{error.place} {error.reason}" for error in errors))
    held = together(tables, "sheet {!r}", "sheet {!r}: {}")
    of_only = next(iter(tables.values())).properties if len(tables) == 1 else {}
    omitted = [f"{error.place} is left out: it {error.reason}" for error in errors]
    return replace(held, properties={**held.properties, **of_only}, warnings=(*held.warnings, *omitted))
