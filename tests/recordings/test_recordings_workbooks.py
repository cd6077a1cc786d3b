"""Workbooks (.xlsx) are read as the CSV that each sheet would be saved as."""

import io
import re
import zipfile
from collections.abc import Callable, Sequence
from datetime import datetime
from typing import Any

import openpyxl
import pytest

from tests.recordings.test_recordings_cells import ABOVE, HEADINGS, PLAIN, ROWS, changed, read
from tests.support.campaign_documents import SKIN
from tests.support.cases import first
from tests.support.instrument_files import CHARGE, FORCE
from underskin.errors import FileError
from underskin.recordings import read_file, rig_description
from underskin.recordings.campaign import to_dict

pytestmark = pytest.mark.usefixtures("understood_here")

Sheet = Sequence[Sequence[Any]]


def workbook(sheets: dict[str, Sheet]) -> bytes:
    """A workbook of sheets, as openpyxl writes it: formulas have no values."""
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    data = io.BytesIO()
    book.save(data)
    return data.getvalue()


def cells(text: str) -> list[list[Any]]:
    """A CSV as the cells that a spreadsheet makes of it: numbers where they are, nothing where nothing is."""
    return [[_cell(cell) for cell in line.split(",")] for line in text.splitlines()]


def _cell(cell: str) -> Any:
    try:
        return float(cell) if "." in cell else int(cell)
    except ValueError:
        return cell or None


def with_parts(data: bytes, change: Callable[[str, bytes], bytes], **more: bytes) -> bytes:
    """The archive with each of its parts changed, and with more."""
    target = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as source, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as out:
        for name in source.namelist():
            out.writestr(name, change(name, source.read(name)))
        for name, part in more.items():
            out.writestr(name, part)
    return target.getvalue()


def with_values(data: bytes, value: str) -> bytes:
    """The workbook after a spreadsheet program has kept a value with every formula."""

    def kept(_name: str, part: bytes) -> bytes:
        return re.sub(rb"</f><v ?/?>(</v>)?", b"</f><v>" + value.encode() + b"</v>", part)

    return with_parts(data, kept)


def archive(**parts: bytes) -> bytes:
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as out:
        for name, part in parts.items():
            out.writestr(name, part)
    return target.getvalue()


def refusal(data: bytes) -> FileError:
    with pytest.raises(FileError) as refused:
        read_file(data, "palm.xlsx")
    assert refused.value.file == "palm.xlsx"
    return refused.value


def test_a_campaign_in_a_workbook_is_that_of_the_csv() -> None:
    reading = read_file(workbook({"May": cells(PLAIN), "Notes": [["by mb"]]}), "palm.xlsx")
    assert reading.problems == []
    assert to_dict(reading.campaign) == to_dict(read(PLAIN).campaign)
    assert reading.warnings == ["sheet 'Notes' is no campaign, and is left out"]


def test_what_is_wrong_on_a_sheet_is_named_as_in_the_csv() -> None:
    error = refusal(workbook({"May": cells(changed("preload_n", "prelaod_n"))}))
    assert (error.place, "did you mean preload_n?" in error.reason) == ("sheet 'May', line 9, column 4", True)


def test_the_skin_on_one_sheet_and_the_table_on_the_next_are_one_campaign() -> None:
    table = cells(HEADINGS + ROWS)
    data = workbook({"Skin": cells(ABOVE), "Notes": [["warm day"]], "May": table})
    reading = read_file(data, "palm.xlsx")
    assert to_dict(reading.campaign) == to_dict(read(PLAIN).campaign)
    assert reading.warnings == ["sheet 'Notes' is no campaign, and is left out"]
    error = refusal(workbook({"Skin": cells(ABOVE), "May": [*table, ["r9", "s01", *["x"] * 9]]}))
    assert error.place.startswith("sheet 'Skin' with sheet 'May' under it, line ")
    error = refusal(workbook({"Skin": cells(ABOVE), "May": table, "June": table}))
    assert "the table is missing" in error.reason


def test_formulas_count_by_the_value_that_was_kept() -> None:
    rows = cells(changed("skin.thickness_mm,2.5", "skin.thickness_mm,=5/2"))
    plain = workbook({"May": rows})
    error = refusal(plain)
    line = next(number for number, row in enumerate(rows, start=1) if row[0] == "skin.thickness_mm")
    assert error.place == f"sheet 'May', cell B{line}"
    assert "holds a formula without a value" in error.reason
    reading = read_file(with_values(plain, "2.25"), "palm.xlsx")
    assert reading.campaign.skin.thickness_mm == 2.25


def test_a_date_in_a_cell_is_in_the_zone_of_the_lab(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("UNDERSKIN_TIME_ZONE", "Europe/Rome")
    rows = cells(ABOVE + HEADINGS.replace("\n", ",recorded_at\n") + ROWS)
    first = next(row for row in rows if row and row[0] == "r1")
    first.append(datetime(2025, 12, 24, 9, 30))  # noqa: DTZ001 (cells have none)
    reading = read_file(workbook({"May": rows}), "palm.xlsx")
    assert reading.campaign.recordings[0].recorded_at == "2025-12-24T09:30:00+01:00"
    assert reading.warnings == ["times in cells are taken to be in the zone Europe/Rome (UNDERSKIN_TIME_ZONE)"]


def series(preload: float) -> Sheet:
    numbers = zip(FORCE, CHARGE, strict=True)
    return [["Preload [N]", preload], ["Force\n[N]", "Charge [pC]"], *map(list, numbers)]


def test_each_sheet_with_a_table_is_a_recording_by_its_name() -> None:
    data = workbook({"s01": series(1.0), "about": [["Operator", "mb"]], "s02": series(2.5)})
    rig = rig_description.from_dict(
        {
            "schema": "rig/1",
            "name": "shaker",
            "skin": SKIN,
            "recording": {
                "sensor": {"property": "block"},
                "indenter_radius_mm": 4,
                "dynamic_force_n": 0.09,
                "preload_n": {"property": "Preload [N]"},
                "sample_rate_hz": 1000,
            },
            "channels": {"force_n": {"channel": "Force [N]"}, "charge_pc": {"channel": "Charge [pC]"}},
        }
    )
    reading = read_file(data, "monday.xlsx", rig)
    assert reading.problems == []
    told = [(entry["id"], entry["sensor"], entry["preload_n"]) for entry in to_dict(reading.campaign)["recordings"]]
    assert told == [("monday s01", "s01", 1.0), ("monday s02", "s02", 2.5)]
    assert to_dict(reading.campaign)["recordings"][1]["force_n"] == pytest.approx(FORCE)
    assert any("sheet 'about' is left out: it holds no table" in warning for warning in reading.warnings)


BOMB = b"<a>" + b" " * 30_000_000


def test_a_workbook_that_unfolds_too_far_is_refused_before_it_is_understood(monkeypatch: pytest.MonkeyPatch) -> None:
    data = with_parts(workbook({"May": cells(PLAIN)}), lambda _, part: part, **{"xl/media/image1.xml": BOMB})
    assert len(data) < 1_000_000
    error = refusal(data)
    assert error.place == "xl/media/image1.xml"
    assert re.search(r"unfolds to more than \d+ MB, .* \(UNDERSKIN_READING_EXPANSION\)", error.reason)
    monkeypatch.setenv("UNDERSKIN_READING_EXPANSION", "1000")
    assert read_file(data, "palm.xlsx").campaign.recordings


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_declared_entities_are_refused(encoding: str) -> None:
    laughs = '<!DOCTYPE a [<!ENTITY b "ha"><!ENTITY c "&b;&b;">]>'

    def declared(name: str, part: bytes) -> bytes:
        if name != "xl/worksheets/sheet1.xml":
            return part
        return f'<?xml version="1.0" encoding="{encoding}"?>{laughs}{part.decode()}'.encode(encoding)

    error = refusal(with_parts(workbook({"May": cells(PLAIN)}), declared))
    assert error.place == "xl/worksheets/sheet1.xml"
    assert "declares a document type or entities" in error.reason


NOT_READ = ("docProps/app.xml", "_rels/.rels", "xl/theme/theme1.xml")


def parts() -> list[str]:
    with zipfile.ZipFile(io.BytesIO(workbook({"May": cells(PLAIN)}))) as whole:
        return [name for name in whole.namelist() if name not in NOT_READ]


@pytest.mark.parametrize("part", first(3, parts()))
def test_xml_that_is_cut_in_a_sound_archive_is_refused(part: str) -> None:
    def half(name: str, content: bytes) -> bytes:
        return content[: len(content) // 2] if name == part else content

    refusal(with_parts(workbook({"May": cells(PLAIN)}), half))


def test_a_damaged_workbook_is_named_as_such() -> None:
    data = workbook({"May": cells(PLAIN)})
    assert "damaged workbook" in refusal(data[: len(data) // 2]).reason
    cut = with_parts(data, lambda name, part: part[:300] if name == "xl/worksheets/sheet1.xml" else part)
    assert refusal(cut).place == "sheet 'May'"


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (archive(**{"word/document.xml": b"<a/>"}), "is a Word document"),
        (archive(**{"xl/workbook.bin": b"x"}), "is a binary workbook"),
        (archive(**{"mimetype": b"x", "content.xml": b"<a/>"}), "is an OpenDocument file"),
        (archive(**{"monday.csv": b"1,2"}), "is a ZIP archive: send the files in it"),
        (b"\xd0\xcf\x11\xe0" + bytes(600), "an old Office document, or one with a password"),
    ],
    ids=["docx", "xlsb", "ods", "zip", "xls"],
)
def test_what_is_no_workbook_is_named(data: bytes, reason: str) -> None:
    assert reason in refusal(data).reason
