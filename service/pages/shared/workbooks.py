"""The numbers of pages as workbooks (XLSX), next to every CSV: the same table with typed cells."""

import functools
import inspect
import io
import math
from collections.abc import Awaitable, Callable, Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np
from fastapi import APIRouter, Response
from fastapi.routing import APIRoute

from service import heavy_answers
from service.pages.shared.figures import CsvAnswer, attachment
from service.problems import Refusal

CSV, XLSX = ".csv", ".xlsx"
_TYPE = "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet"
_FIRST_YEAR = 1900
_STANDARD = "Standard uncertainty. The ± and 95 % of the pages are about twice as much."
_MOST_CELLS = 250_000  # takes some 2.5 s of this process


def add_to(router: APIRouter) -> None:
    """Answer `NAME.xlsx` for every `NAME.csv`."""
    for route in list(router.routes):
        if isinstance(route, APIRoute) and route.path.endswith(CSV):
            endpoint = _as_workbook(inspect.unwrap(route.endpoint))
            name = route.path.removeprefix(router.prefix).removesuffix(CSV)
            router.add_api_route(name + XLSX, endpoint)


def _as_workbook(endpoint: Callable[..., Any]) -> Callable[..., Awaitable[Response]]:
    """An endpoint that waits for turns of its own has had them before the workbook is made of its table."""

    @functools.wraps(endpoint)
    async def made(*arguments: Any, **values: Any) -> Response:
        if inspect.iscoroutinefunction(endpoint):
            return await heavy_answers.in_turn(functools.partial(_of_table, await endpoint(*arguments, **values)))
        return await heavy_answers.in_turn(lambda: _of_table(endpoint(*arguments, **values)))

    return made


def _of_table(table: CsvAnswer) -> Response:
    return attachment(f"{table.name}{XLSX}", workbook(table.columns), _TYPE)


def workbook(columns: Mapping[str, Sequence[Any]]) -> bytes:
    """Columns as a workbook of one sheet, times as dates in UTC, with notes at headings that need one; raises Refusal
    where it has too many cells."""
    from openpyxl import Workbook
    from openpyxl.cell import WriteOnlyCell
    from openpyxl.comments import Comment

    times = [name == "time" or name.endswith("_at") for name in columns]
    rows = [tuple(columns), *zip(*columns.values(), strict=True)]
    cells = len(rows) * len(columns)
    if cells > _MOST_CELLS:
        raise Refusal(413, f"A workbook may have up to {_MOST_CELLS:,} cells, and these are {cells:,}: take the CSV.")
    book = Workbook(write_only=True)
    sheet = book.create_sheet("numbers")
    for number, row in enumerate(rows):
        values = [_moment(value) if number and time else _value(value) for value, time in zip(row, times, strict=True)]
        written = [WriteOnlyCell(sheet, value) for value in values]
        for cell in written:
            if isinstance(cell.value, str):
                cell.data_type = "s"  # no text is a formula
        if number == 0:
            for cell, name, time in zip(written, columns, times, strict=True):
                if time or "_uncertainty" in name:
                    cell.comment = Comment("UTC" if time else _STANDARD, "underskin")
        sheet.append(written)
    file = io.BytesIO()
    book.save(file)
    return file.getvalue()


def _moment(value: Any) -> datetime | float | str | None:
    """A time as a workbook has it: in UTC, without its zone; a text where it is none, or before workbooks' times."""
    try:
        when = datetime.fromisoformat(str(value))
        in_utc = when.astimezone(UTC).replace(tzinfo=None)
    except (ValueError, OverflowError):
        return _value(value)
    return in_utc if when.tzinfo is not None and in_utc.year >= _FIRST_YEAR else _value(value)


def _value(value: Any) -> float | str | None:
    """A cell: a finite number, nothing, or a text, also one that reads like a number."""
    if isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool):
        return float(value) if math.isfinite(value) else None
    return None if value is None or value == "" else str(value)
