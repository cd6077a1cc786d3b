"""Workbooks (.xlsx, .xlsm): each visible sheet as text (workbook_sheets.py), read like CSV.

One sheet may be the campaign of csv_template.py, or its head, with the table on another sheet. Otherwise each sheet
with a table of numbers is a block named after the sheet, read by csv_file.py; others are left out with a warning.
"""

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any, BinaryIO

from underskin.errors import FileError
from underskin.recordings.channels import Contents, Document, together
from underskin.recordings.readers import csv_file, csv_template
from underskin.recordings.readers.workbook_sheets import texts_of


def read(stream: BinaryIO, file: str) -> Contents | Document:
    """The campaign or the channels of a workbook; raises FileError that names sheet and line."""
    sheets, notes = texts_of(stream, file)
    if not sheets:
        raise FileError(file, "", "; ".join(["has no sheet with anything in it", *notes]))
    campaigns = [name for name, text in sheets.items() if csv_template.is_template(text)]
    if len(campaigns) > 1:
        several = f"holds a campaign on each of the sheets {_listed(campaigns)}: save each as a workbook"
        raise FileError(file, "", several)
    found = _campaign(campaigns[0], sheets, file) if campaigns else _tables(sheets, file)
    return replace(found, warnings=(*found.warnings, *notes))


def sheet_text(stream: BinaryIO, sheet: str | None = None) -> dict[str, Any]:
    """The `text` of a visible non-empty sheet with cells separated by tabs: the named or the only one; raises
    FileError."""
    sheets, _ = texts_of(stream, "")
    wanted = [name for name in sheets if sheet in (None, name)]
    if len(wanted) != 1:
        available = f"those with anything in them: {_listed(sheets)}" if sheets else "none has anything in it"
        one = "one sheet with columns, or be sent with the name of one" if sheet is None else f"a sheet {sheet!r}"
        raise FileError("", "", f"must have {one}; {available}")
    return {"text": sheets[wanted[0]]}


def _listed(names: Collection[str]) -> str:
    return ", ".join(map(repr, names))


def _campaign(name: str, sheets: dict[str, str], file: str) -> Document:
    """The campaign of a sheet, with the table of the only other sheet that has one where it has none itself."""
    place, written = f"sheet {name!r}", sheets.pop(name)
    tables = [other for other, below in sheets.items() if csv_template.has_table(below.partition("\n")[0])]
    if len(tables) == 1 and not csv_template.has_table(written):
        place, written = f"{place} with sheet {tables[0]!r} under it", f"{written}\n\n{sheets.pop(tables[0])}"
    try:
        document = csv_template.of_text(written, file, place)
    except FileError as error:
        raise _at(place, error) from None
    others = [f"sheet {name!r} is no campaign, and is left out" for name in sheets]
    return replace(document, warnings=(*document.warnings, *others))


def _at(place: str, error: FileError) -> FileError:
    return FileError(error.file, ", ".join(filter(None, (place, error.place))), error.reason, code=error.code)


def _tables(sheets: Mapping[str, str], file: str) -> Contents:
    """The tables of all sheets; raises FileError where none holds one."""
    tables: dict[str, Contents] = {}
    errors: list[FileError] = []
    for name, sheet in sheets.items():
        try:
            tables[name] = csv_file.of_text(sheet, file)
        except FileError as error:
            errors.append(_at(f"sheet {name!r}", error))
            if not isinstance(error, csv_file.NoTable):
                raise errors[-1] from None
    if not tables:
        raise FileError(file, "", "; ".join(f"{error.place} {error.reason}" for error in errors))
    held = together(tables, "sheet {!r}", "sheet {!r}: {}")
    of_only = next(iter(tables.values())).properties if len(tables) == 1 else {}
    omitted = [f"{error.place} is left out: it {error.reason}" for error in errors]
    return replace(held, properties={**held.properties, **of_only}, warnings=(*held.warnings, *omitted))
