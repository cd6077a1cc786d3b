"""d33 from single measured values of the FRF, for whom a file of recordings would be too much."""

import math
from collections.abc import Mapping
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response

from service.dependencies import Store, Table
from service.pages.array.description import refused
from service.pages.measured.adopted_model import ByModel, by_model
from service.pages.shared import same_request
from service.pages.shared.figures import csv_answer
from service.pages.shared.forms import number, numbers
from service.pages.shared.html import page
from service.pages.shared.skin_values import FIELDS as SKIN_FIELDS
from service.pages.shared.skin_values import UNITS, shown
from service.problems import parsed
from service.schemas.columns import Columns
from service.schemas.pressed_skin import D33Columns
from service.store import Database
from service.usecases.pressed_skin import d33
from underskin.errors import InvalidInput, UnderskinError, conflicting, required, wrong_type
from underskin.prediction.domain_checks import RowConditions, beyond
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter(prefix="/d33")

FIELDS = tuple(field for field in SKIN_FIELDS if field[0] != "d33_pc_per_n")
_LONGEST = 20_000  # characters of the rows
_WITHOUT_UNCERTAINTY = 3  # numbers of a row
_ROWS = "4 1 7.06 0.1\n4 3 7.45 0.1"
_ORDER = ("indenter_radius_mm", "preload_n", "frf_pc_per_n", "frf_uncertainty_pc_per_n")
_WORDS = {"frf_pc_per_n": "FRF", "d33_pc_per_n": "d33"}  # that findings are about
_ANSWERED = ("d33_pc_per_n", "d33_uncertainty_pc_per_n", "contact_radius_mm", "sigma", "mean_stress_mpa")

RowsText = Annotated[str, Query(max_length=_LONGEST)]


@router.get("")
def view(request: Request, store: Store, table: Table, skin: str | None = None, rows: RowsText = _ROWS) -> Response:
    """With the skin and the rows of the address, or else the paper's prototype under a sphere."""
    values, taken = shown(store, table, request.query_params, skin, FIELDS)
    error: str | None = None
    document: dict[str, Any] = {}
    answer: Columns | None = None
    adopted: ByModel | None = None
    try:
        document = _document(values, request.query_params, rows)
        answer = _answered(table, store, document)
        adopted = by_model(store, table, skin, request.query_params, document)
    except UnderskinError as problem:
        error = _said(problem)
    asked = document if adopted is None or adopted.document is None else adopted.document
    return page(
        request,
        "measured.html",
        skin_id=skin,
        fields=FIELDS,
        values=values,
        taken=taken,
        units_checked=UNITS in request.query_params,
        rows=rows,
        error=error,
        findings=[] if answer is None else answer.shared["findings"],
        words=_WORDS,
        columns=None if answer is None else _columns(document, answer, adopted),
        adopted=adopted,
        outside=[] if answer is None else reasons(document, answer, table),
        query=request.url.query,
        same=same_request.post(request, "/v1/d33", asked, f"client.d33(**{asked!r})"),
    )


@router.get("/rows.csv")
def rows_csv(request: Request, store: Store, table: Table, skin: str | None = None, rows: RowsText = _ROWS) -> Response:
    """What was measured and what it says, a row a measurement."""
    values, _ = shown(store, table, request.query_params, skin, FIELDS)
    document = _document(values, request.query_params, rows)
    adopted = by_model(store, table, skin, request.query_params, document)
    return csv_answer("d33", _columns(document, _answered(table, store, document), adopted))


def _said(error: UnderskinError) -> str:
    row = "" if not isinstance(error, InvalidInput) or error.index is None else f"row {error.index + 1}, "
    return row + refused(error)


def _answered(table: SigmaTable, store: Database, document: dict[str, Any]) -> Columns:
    return d33(table, store, parsed(D33Columns, document))


def _columns(document: Mapping[str, Any], answer: Columns, adopted: ByModel | None) -> dict[str, list[Any]]:
    """What was sent and what is answered, a row a measurement."""
    sent = {name: document.get(name, [math.nan] * answer.rows) for name in _ORDER}
    answered = {name: answer.full(name).tolist() for name in _ANSWERED}
    beside = {} if adopted is None else adopted.columns()
    return {**sent, **answered, **beside, "status": list(answer.status())}


def _document(values: Mapping[str, str], given: Mapping[str, str], rows: str) -> dict[str, Any]:
    """The request of `POST /v1/d33`; raises InvalidInput."""
    parts = [_row(place, line) for place, line in enumerate(rows.splitlines(), 1) if line.strip()]
    if not parts:
        raise required("measurements", "fill in at least one row: R F FRF, in mm, N and pC/N")
    if len({len(part) for part in parts}) != 1:
        bare = [str(number) for number, part in enumerate(parts, 1) if len(part) == _WITHOUT_UNCERTAINTY]
        must = f"give an uncertainty (the fourth number) in every row or in none: row {', '.join(bare[:5])} has none"
        raise conflicting("measurements", None, must)
    document: dict[str, Any] = {name: number(name, values[name]) for name, *_ in FIELDS}
    document |= dict(zip(_ORDER, (list(column) for column in zip(*parts, strict=True)), strict=False))
    return {**document, UNITS: True} if UNITS in given else document


def _row(place: int, line: str) -> list[float]:
    parts = numbers(f"row {place}", line)
    if len(parts) not in (_WITHOUT_UNCERTAINTY, len(_ORDER)):
        raise wrong_type(f"row {place}", line[:80], "must be R F FRF, or R F FRF and its uncertainty (mm, N, pC/N)")
    return parts


def reasons(document: Mapping[str, Any], answer: Columns, table: SigmaTable) -> list[str]:
    """Of each row outside the table, which value is and what is allowed; `document`: the request of the answer."""
    numbers = [answer.full(name) for name in ("a_over_h", "rt_over_h", "load_parameter")]
    status = answer.status()
    skin = document["youngs_modulus_mpa"], document["poisson_ratio"]
    return [
        f"row {row + 1}, " + beyond(RowConditions(force, radius, *skin), [float(part[row]) for part in numbers], table)
        for row, (force, radius) in enumerate(zip(document["preload_n"], document["indenter_radius_mm"], strict=True))
        if status[row] != "ok"
    ]
