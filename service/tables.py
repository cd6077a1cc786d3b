"""The tables that ship, and the hash that names each."""

from typing import Any

import numpy as np
from fastapi import APIRouter, Request
from pydantic import BaseModel, Field

from service.dependencies import Table
from service.more_tables import contact_table, influence_table
from underskin.surrogate.contact_table import ContactTable
from underskin.surrogate.hdf5_format import SIGMA_SCHEMA
from underskin.surrogate.influence_table import InfluenceTable
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter(prefix="/v1", tags=["tables"])


class TableAxis(BaseModel):
    """One axis of a table."""

    name: str = Field(description="The field that runs along it.", examples=["a_over_h"])
    low: float = Field(description="Lowest value inside, limit included [-].")
    high: float = Field(description="Highest value inside, limit included [-].")
    nodes: int = Field(description="How many nodes the table has along it.")


class TableEntry(BaseModel):
    """One table."""

    name: str = Field(description="Which quantity it holds.", examples=["sigma"])
    table_schema: str = Field(description="Format of the file.", examples=[SIGMA_SCHEMA])
    table_sha256: str = Field(description="SHA-256 of its datasets; every answer names it.")
    axes: list[TableAxis] = Field(description="Its domain.")
    about: dict[str, Any] = Field(description="How it was made: mesh, solver, versions.")


class Tables(BaseModel):
    """All tables."""

    tables: list[TableEntry] = Field(description="One entry a table.")


@router.get("/tables", operation_id="tables", summary="The tables in use")
async def tables(request: Request, table: Table) -> Tables:
    """The tables of σ and influence that answers are computed from, and the contact table, which is reference data."""
    folder = request.app.state.settings.tables
    return Tables(tables=[_entry(table), _entry(influence_table(folder)), _entry(contact_table(folder))])


def _entry(table: SigmaTable | InfluenceTable | ContactTable) -> TableEntry:
    axes = [
        TableAxis(name=name, low=low, high=high, nodes=len(nodes))
        for (name, (low, high)), nodes in zip(table.domain.items(), table.axes, strict=True)
    ]
    about = {name: np.asarray(value).tolist() for name, value in table.attributes.items() if name not in _NAMED}
    schema = str(table.attributes["schema"])
    name = str(table.attributes["quantity"])
    return TableEntry(name=name, table_schema=schema, table_sha256=table.sha256, axes=axes, about=about)


_NAMED = {"schema", "data_sha256", "default"}
