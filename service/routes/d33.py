"""d33 of each sensor from its measured FRF."""

from typing import Any

from fastapi import APIRouter, Request, Response

from service.dependencies import StoreToRead, Table
from service.routes.columns_endpoint import Accept, columns_body, columns_route
from service.routes.frf import EXAMPLE as FRF_EXAMPLE
from service.schemas.columns_answer import Columns
from service.schemas.d33 import D33Answer, D33Columns
from service.usecases.d33 import d33
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter(prefix="/v1", tags=["d33"])

EXAMPLE = {**FRF_EXAMPLE, "frf_pc_per_n": [6.8, 6.9], "frf_uncertainty_pc_per_n": 0.1}
del EXAMPLE["d33_pc_per_n"]

_ANSWER: dict[int | str, dict[str, Any]] = {200: {"model": D33Answer, "content": {"text/csv": {}}}}


@router.post(
    "/d33",
    operation_id="d33_columns",
    summary="d33 from measured FRF",
    responses=_ANSWER,
    openapi_extra=columns_body(D33Columns, EXAMPLE),
)
async def d33_columns(
    request: Request, table: Table, store: StoreToRead, accept: Accept = "application/json"
) -> Response:
    """In columns: a list has an entry a row, a single number holds for all rows. Accept: text/csv gives CSV."""

    def work(table: SigmaTable, columns: D33Columns) -> Columns:
        return d33(table, store, columns)

    return await columns_route(D33Columns, work)(request, table, accept)
