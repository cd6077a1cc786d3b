"""What the model predicts for a skin: FRF, and what leads to it."""

from typing import Any

from fastapi import APIRouter, Request, Response

from service.dependencies import StoreToRead, Table
from service.routes.columns_endpoint import Accept, columns_body, columns_route
from service.schemas.columns_answer import Columns
from service.schemas.frf import FrfAnswer, FrfColumns
from service.usecases.frf import frf
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter(prefix="/v1", tags=["frf"])

EXAMPLE = {
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16.0,
    "sensor_radius_mm": 1.5,
    "indenter_radius_mm": 4.0,
    "preload_n": 1.0,
    "d33_pc_per_n": 14.0,
}

_ANSWER: dict[int | str, dict[str, Any]] = {200: {"model": FrfAnswer, "content": {"text/csv": {}}}}


@router.post(
    "/frf",
    operation_id="frf_columns",
    summary="FRF of a skin under a sphere",
    responses=_ANSWER,
    openapi_extra=columns_body(FrfColumns, EXAMPLE),
)
async def frf_columns(
    request: Request, table: Table, store: StoreToRead, accept: Accept = "application/json"
) -> Response:
    """In columns: a list has an entry a row, a single number holds for all rows. Accept: text/csv gives CSV."""

    def work(table: SigmaTable, columns: FrfColumns) -> Columns:
        return frf(table, store, columns)

    return await columns_route(FrfColumns, work)(request, table, accept)
