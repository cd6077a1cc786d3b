"""The numbers of pages as workbooks (XLSX), beside every CSV: the same table, its numbers as numbers."""

import functools
import io
import math
from collections.abc import Callable, Mapping, Sequence
from numbers import Real
from typing import Any

from fastapi import APIRouter, Response
from fastapi.routing import APIRoute

from service.pages.shared.figures import CsvFile, attachment
from service.problems import Refusal

CSV, XLSX = ".csv", ".xlsx"
_TYPE = "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet"
_MOST_CELLS = 250_000  # takes some 2.5 s of this process


def add_to(router: APIRouter) -> None:
    """Answer `NAME.xlsx` wherever `NAME.csv` is answered."""
    for route in list(router.routes):
        if isinstance(route, APIRoute) and route.path.endswith(CSV):
            endpoint = _as_workbook(route.endpoint)
            own = route.path.removeprefix(router.prefix).removesuffix(CSV)
            router.add_api_route(own + XLSX, endpoint)


def _as_workbook(endpoint: Callable[..., CsvFile]) -> Callable[..., Response]:
    @functools.wraps(endpoint)
    def answer(*arguments: Any, **values: Any) -> Response:
        table = endpoint(*arguments, **values)
        return attachment(f"{table.name}{XLSX}", workbook(table.columns), _TYPE)

    return answer


def workbook(columns: Mapping[str, Sequence[Any]]) -> bytes:
    """Columns as a workbook of one sheet, texts as they are; raises Refusal where there are too many cells."""
    from openpyxl import Workbook
    from openpyxl.cell import WriteOnlyCell

    cells = sum(map(len, columns.values()))
    if cells > _MOST_CELLS:
        raise Refusal(413, f"A workbook may have up to {_MOST_CELLS:,} cells, and these are {cells:,}: take the CSV.")
    book = Workbook(write_only=True)
    sheet = book.create_sheet("numbers")

    def cell(value: Any) -> Any:
        if value is None or value != value:
            return None
        if isinstance(value, Real) and math.isfinite(value):
            return value
        text = WriteOnlyCell(sheet, str(value))
        text.data_type = "s"  # no text is a formula
        return text

    for row in (columns, *zip(*columns.values(), strict=True)):
        sheet.append([cell(value) for value in row])
    file = io.BytesIO()
    book.save(file)
    return file.getvalue()
