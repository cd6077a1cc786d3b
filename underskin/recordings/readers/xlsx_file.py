"""Workbooks (.xlsx, .xlsm): each sheet is read as the CSV that it would be saved as.

One sheet may be the campaign of csv_template.py, or what stands above its table, and another the table. Otherwise each
sheet with a table of numbers is a block by the sheet's name, as csv_file.py reads it; others are left out, with a
warning.
"""

from dataclasses import replace
from io import BytesIO
from typing import Any, BinaryIO

from underskin.errors import FileError
from underskin.recordings.channels import Contents, Document
from underskin.recordings.readers import csv_file, csv_template
from underskin.recordings.readers.workbook_sheets import WorkbookSheets


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
    """The `text` of a visible sheet with anything in it, cells separated by tabs: that of a name, or the only one;
    raises FileError."""
    sheets = dict(WorkbookSheets(stream, "").texts())
    wanted = list(sheets) if sheet is None else [name for name in sheets if name == sheet]
    if len(wanted) != 1:
        found = f"those with anything in them: {_listed(list(sheets))}" if sheets else "none has anything in it"
        must = "one sheet with columns, or be sent with the name of one" if sheet is None else f"a sheet {sheet!r}"
        raise FileError("", "", f"must have {must}; {found}")
    return {"text": sheets[wanted[0]]}


def _listed(names: list[str]) -> str:
    return ", ".join(map(repr, names))


def _with_table(name: str, sheets: dict[str, str]) -> tuple[str, str]:
    """Takes a campaign off the sheets, with the table on the next sheet where its own has none: where it stands, in
    words, and its text."""
    text = sheets.pop(name)
    tables = [other for other, below in sheets.items() if csv_template.has_table(below.partition("\n")[0])]
    if csv_template.has_table(text) or len(tables) != 1:
        return f"sheet {name!r}", text
    (table,) = tables
    return f"sheet {name!r} with sheet {table!r} under it", f"{text}\n\n{sheets.pop(table)}"


def _campaign(place: str, text: str, file: str) -> Document:
    try:
        return csv_template.read(BytesIO(text.encode()), file, place)
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
    for name, text in sheets.items():
        try:
            tables[name] = csv_file.read(BytesIO(text.encode()), file)
        except csv_file.NoTable as error:
            errors.append(_on_sheet(name, error))
        except FileError as error:
            raise _on_sheet(name, error) from None
    if not tables:
        raise FileError(file, "", "; ".join(f"{error.place} {error.reason}" for error in errors))
    blocks = tuple(
        replace(block, name=f"{name} {block.name}".strip()) for name, table in tables.items() for block in table.blocks
    )
    properties = {key: value for name, table in tables.items() for key, value in _about(name, table, len(tables))}
    told = [f"sheet {name!r}: {warning}" for name, table in tables.items() for warning in table.warnings]
    left = [f"{error.place} is left out: it {error.reason}" for error in errors]
    layout = "; ".join(f"sheet {name!r}: {table.layout}" for name, table in tables.items())
    return Contents(blocks, properties, (*told, *left), layout)


def _about(name: str, table: Contents, sheets: int) -> list[tuple[str, str | float]]:
    """What a sheet says about itself, by its name, that of its only part too; of an only sheet also without."""
    parts = [f"{name} {block.name}".strip() for block in table.blocks]
    numbered = tuple(f"{block.name}." for block in table.blocks if block.name)
    about = []
    for key, value in table.properties.items():
        if numbered and key.startswith(numbered):
            about.append((f"{name} {key}", value))
            continue
        about += [(f"{part}.{key}", value) for part in parts]
        if sheets == 1:
            about.append((key, value))
    return about
