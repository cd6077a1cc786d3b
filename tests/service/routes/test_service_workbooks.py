"""Columns from workbooks: the same answers and errors as the CSV of the sheet, under the limits of files."""

import csv
import io
from typing import Any

import httpx
import openpyxl
import pytest

from service.routes.columns_body import XLSM, XLSX
from tests.service.routes.test_service_columns import SKIN
from tests.support.cases import first

POINTS: list[list[Any]] = [["a_over_h", "rt_over_h"], [0.3, 0.6], [0.5, 0.6], [99.0, 0.6]]
MEASURED: list[list[Any]] = [
    ["id", *SKIN, "preload_n", "frf_pc_per_n"],
    ["p1", *SKIN.values(), 1.0, 6.8],
    ["p2", *SKIN.values(), 2.0, 7.4],
]


def workbook(sheets: dict[str, list[list[Any]]]) -> bytes:
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    data = io.BytesIO()
    book.save(data)
    return data.getvalue()


def as_csv(rows: list[list[Any]]) -> str:
    text = io.StringIO()
    csv.writer(text).writerows(rows)
    return text.getvalue()


def send(http: httpx.Client, path: str, content: bytes | str, kind: str, accept: str = "text/csv") -> httpx.Response:
    return http.post(path, content=content, headers={"Content-Type": kind, "Accept": accept})


@pytest.mark.parametrize(("path", "rows", "kind"), [("/v1/sigma", POINTS, XLSX), ("/v1/d33", MEASURED, XLSM)])
def test_a_sheet_is_answered_as_its_csv(http: httpx.Client, path: str, rows: list[list[Any]], kind: str) -> None:
    of_csv = send(http, path, as_csv(rows), "text/csv")
    assert of_csv.status_code == 200, of_csv.text
    assert send(http, path, workbook({"Only": rows}), kind).text == of_csv.text
    several = workbook({"Notes": [["measured by", "mb"]], "Day 2": rows})
    assert send(http, f"{path}?sheet=Day 2", several, kind).text == of_csv.text


def test_of_several_sheets_one_must_be_named(http: httpx.Client) -> None:
    several = workbook({"Notes": [["measured by", "mb"]], "Day 2": POINTS})
    for path in ("/v1/sigma", "/v1/sigma?sheet=Day 3"):
        answer = send(http, path, several, XLSX)
        assert answer.status_code == 400
        assert "those with anything in them: 'Notes', 'Day 2'" in answer.json()["detail"]
    answer = send(http, "/v1/sigma?sheet=Day 2", as_csv(POINTS), "text/csv")
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, "sheet")


def test_what_is_wrong_in_a_cell_is_said_as_of_csv(http: httpx.Client) -> None:
    wrong: list[list[list[Any]]] = [[*POINTS[:2], ["much", 0.6]], [["a_over_h", "b_over_h"], [0.3, 1.5]]]
    for rows in wrong:
        of_csv = send(http, "/v1/sigma", as_csv(rows), "text/csv")
        of_sheet = send(http, "/v1/sigma", workbook({"Only": rows}), XLSX)
        assert of_csv.status_code == of_sheet.status_code == 422
        assert of_sheet.json()["errors"] == of_csv.json()["errors"]
    twice: list[list[Any]] = [["a_over_h", "a_over_h"], [0.3, 1.0]]
    of_csv = send(http, "/v1/sigma", as_csv(twice), "text/csv")
    of_sheet = send(http, "/v1/sigma", workbook({"Only": twice}), XLSX)
    assert of_csv.status_code == of_sheet.status_code == 400
    assert of_sheet.json()["detail"] == of_csv.json()["detail"].replace("CSV", "workbook")


def test_what_is_no_workbook_is_refused(http: httpx.Client) -> None:
    for content in first(1, (b"PK\x03\x04" + bytes(60), b"a_over_h\n1\n", b"")):
        answer = send(http, "/v1/sigma", content, XLSX)
        assert answer.status_code == 400
        assert "damaged" in answer.json()["detail"]
