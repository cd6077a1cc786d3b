"""Files to be saved: the numbers of a figure or table as CSV and as a workbook (XLSX), and others."""

import inspect
import io
import math
import re
import unicodedata
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from functools import partial
from typing import Any, TypeVar
from urllib.parse import quote

import numpy as np
from fastapi import APIRouter, Response
from starlette.types import Receive, Scope, Send

from service.heavy_answers import computed_in_turn, in_turn
from service.pages.shared.figures import columns_of
from service.problems import Refusal
from underskin.prediction.columns import to_spreadsheet

_CSV, _XLSX = ".csv", ".xlsx"
_TYPE = "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet"
_NOT_IN_NAMES = re.compile(r"[^\w.+-]+")
_LONGEST_PART = 60  # characters, of a name
_FIRST_YEAR = 1900
_STANDARD = "Standard uncertainty. The ± and 95 % of the pages are about twice as much."
_MOST_CELLS = 250_000  # takes some 2.5 s of this process

_Endpoint = TypeVar("_Endpoint", bound=Callable[..., Any])


class Numbers(Response):
    """Columns as a file to be saved: as a workbook where the address ends so, else as CSV."""

    def __init__(self, name: str, columns: Mapping[str, Sequence[Any]]) -> None:
        text = to_spreadsheet(columns)
        super().__init__(text, headers=_saved(f"{name}{_CSV}"), media_type="text/csv; charset=utf-8")
        self._name, self._columns = name, columns

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """The answer; raises Refusal where a workbook would have too many cells."""
        if scope["path"].endswith(_XLSX):
            book = await in_turn(partial(workbook, self._columns))
            await attachment(f"{self._name}{_XLSX}", book, _TYPE)(scope, receive, send)
        else:
            await super().__call__(scope, receive, send)


def downloadable(router: APIRouter, path: str) -> Callable[[_Endpoint], _Endpoint]:
    """Routes to the numbers that an endpoint returns, at `path` with either ending; a few at a time."""

    def add(endpoint: _Endpoint) -> _Endpoint:
        answer = endpoint if inspect.iscoroutinefunction(endpoint) else computed_in_turn(endpoint)
        for ending in (_CSV, _XLSX):
            router.add_api_route(path + ending, answer)
        return endpoint

    return add


def numbers_of_rows(name: str, names: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> Numbers:
    """Rows as a file of these columns; without a value where a row lacks it."""
    return Numbers(name, dict(zip(names, columns_of(rows, *names), strict=True)))


def attachment(file: str, content: str | bytes, media_type: str, **headers: str) -> Response:
    """A file to be saved."""
    return Response(content, headers=_saved(file) | headers, media_type=media_type)


def _saved(file: str) -> dict[str, str]:
    """Headers of a file to be saved; a name beyond ASCII also as RFC 6266 has it."""
    plain = unicodedata.normalize("NFKD", file).encode("ascii", "ignore").decode()
    disposition = f'attachment; filename="{plain}"' + ("" if plain == file else f"; filename*=UTF-8''{quote(file)}")
    return {"Content-Disposition": disposition, "X-Content-Type-Options": "nosniff"}


def file_name(*parts: str) -> str:
    """A file name made of skin, campaign and so on, without characters that file systems reject."""
    plain = (_NOT_IN_NAMES.sub("-", part)[:_LONGEST_PART].strip("-.") for part in parts)
    return "-".join(part for part in plain if part)


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
