"""The numbers of pages as workbooks (XLSX), beside every CSV: the same table, its numbers as numbers."""

import csv
import functools
import io
from collections.abc import Callable
from typing import Any

from fastapi import APIRouter, Response
from fastapi.routing import APIRoute

from service.problems import Refusal

CSV, XLSX = ".csv", ".xlsx"
_TYPE = "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet"
_MOST_ROWS = 1_000_000  # a sheet of a workbook has 1,048,576


def add_to(router: APIRouter) -> None:
    """Answer `NAME.xlsx` wherever `NAME.csv` is answered."""
    for route in list(router.routes):
        if isinstance(route, APIRoute) and route.path.endswith(CSV):
            endpoint = _as_workbook(route.endpoint)
            own = route.path.removeprefix(router.prefix).removesuffix(CSV)
            router.add_api_route(own + XLSX, endpoint)


def _as_workbook(endpoint: Callable[..., Response]) -> Callable[..., Response]:
    @functools.wraps(endpoint)
    def answer(*arguments: Any, **values: Any) -> Response:
        table = endpoint(*arguments, **values)
        file = table.headers["Content-Disposition"].replace(f'{CSV}"', f'{XLSX}"')
        headers = {"Content-Disposition": file, "X-Content-Type-Options": "nosniff"}
        return Response(workbook(bytes(table.body).decode()), headers=headers, media_type=_TYPE)

    return answer


def workbook(table: str) -> bytes:
    """A CSV text as a workbook of one sheet; raises Refusal where a sheet has too few rows for it."""
    from openpyxl import Workbook
    from openpyxl.cell import WriteOnlyCell

    rows = list(csv.reader(io.StringIO(table)))
    if len(rows) > _MOST_ROWS:
        raise Refusal(413, f"A sheet of a workbook holds {_MOST_ROWS} rows, and these are {len(rows)}: take the CSV.")
    book = Workbook(write_only=True)
    sheet = book.create_sheet("numbers")
    for row in rows:
        cells = [WriteOnlyCell(sheet, value) for value in map(_value, row)]
        for cell in cells:
            if isinstance(cell.value, str):
                cell.data_type = "s"  # no text is a formula
        sheet.append(cells)
    file = io.BytesIO()
    book.save(file)
    return file.getvalue()


def _value(cell: str) -> float | str | None:
    """A cell of the CSV: a number, nothing, or a text without the mark that keeps spreadsheets from computing it."""
    if cell in ("", "NaN"):
        return None
    try:
        return float(cell)
    except ValueError:
        return cell[1:] if cell.startswith("'") else cell
