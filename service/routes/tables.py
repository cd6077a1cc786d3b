"""The tables that answer, and the hash that names each."""

from fastapi import APIRouter, Request

from service.dependencies import Table
from service.schemas.tables import Tables
from service.usecases import tables as usecase

router = APIRouter(prefix="/v1", tags=["tables"])


@router.get("/tables", operation_id="tables", summary="The tables in use")
async def tables(request: Request, table: Table) -> Tables:
    """The tables that answers are computed from: of σ, of influence, and of the solved contact."""
    return usecase.tables(table, request.app.state.settings.tables)
