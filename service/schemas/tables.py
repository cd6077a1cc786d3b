"""The tables that answer, and the hash that names each."""

from typing import Any

from pydantic import BaseModel, Field

from underskin.surrogate.hdf5_format import SIGMA_SCHEMA


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
