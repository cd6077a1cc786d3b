"""The tables that answer, and the hash that names each."""

from fastapi import APIRouter, Request

from service.dependencies import Table
from service.schemas.tables import Tables
from service.usecases import tables as usecase

router = APIRouter(prefix="/v1", tags=["tables"])


@router.get("/tables", operation_id="tables", summary="The tables in use")
async def tables(request: Request, table: Table) -> Tables:
    """The tables of σ and influence that answers are computed from, and the contact table, which is reference data."""
    return usecase.tables(table, request.app.state.settings.tables)
