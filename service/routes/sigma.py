"""σ: one point (GET) or columns of points (POST)."""

from typing import Annotated, Any, Literal

import numpy as np
from fastapi import APIRouter, Query, Response
from orjson import dumps, loads
from pydantic import BaseModel, ConfigDict, Field

from service.dependencies import Table, columns_body, columns_route
from service.middleware.asgi_middleware import HotRoute, are_numbers
from service.schemas.columns import ColumnsRequest, NonNegative, Status, rows
from service.schemas.columns_answer import Accept, AnswerInColumns, Columns, respond
from underskin.physics import half_space
from underskin.surrogate.sigma_table import SigmaTable
from underskin.units import non_negative

router = APIRouter(prefix="/v1", tags=["sigma"])

Model = Literal["layer", "half_space"]

_A = "Contact radius over skin thickness, a/h [-]."
_RHO = "Sensor radius over skin thickness, rT/h [-]; 0 is a point sensor."
_LOAD = "L = F/(R² E) [-], which stands for finite strain; 0 is the linear layer. The half space does not use it."
_MODEL = "`layer`: incompressible, bonded to a rigid base, finite strain. `half_space`: Boussinesq, linear."


class SigmaColumns(ColumnsRequest):
    """Points in columns; a single number holds for all rows."""

    a_over_h: NonNegative = Field(description=_A)
    rt_over_h: NonNegative = Field(description=_RHO)
    load_parameter: NonNegative = Field(default=0.0, description=_LOAD)
    model: Model = Field(default="layer", description=_MODEL)


class SigmaAnswer(AnswerInColumns):
    """σ in columns."""

    sigma: list[float | None] = Field(description="σ [-]: charge = d33 (3/2) (rT/h)² σ F.")
    rel_error: list[float | None] = Field(description="Bound on σ's relative error [-].")


def answer(table: SigmaTable, request: SigmaColumns) -> Columns:
    """σ for each row."""
    names = ("a_over_h", "rt_over_h", "load_parameter")
    columns = {name: non_negative(name, request.column(name)) for name in names}
    count = rows(columns)
    layer = request.model == "layer"
    a, rho, load = np.broadcast_arrays(*columns.values())
    found = table.sigma(a, rho, load) if layer else half_space.sigma_in_domain(a, rho)
    return Columns(
        rows=count,
        model=request.model,
        table_sha256=table.sha256 if layer else None,
        inside=found.inside,
        columns={"sigma": found.sigma, "rel_error": found.rel_error},
    )


class SigmaQuery(BaseModel):
    """One point."""

    model_config = ConfigDict(extra="forbid")

    a_over_h: float = Field(ge=0, allow_inf_nan=False, description=_A, examples=[0.3])
    rt_over_h: float = Field(ge=0, allow_inf_nan=False, description=_RHO, examples=[0.6])
    load_parameter: float = Field(default=0.0, ge=0, allow_inf_nan=False, description=_LOAD, examples=[0.01])
    model: Model = Field(default="layer", description=_MODEL)


class OneSigma(BaseModel):
    """σ at one point."""

    model: str = Field(description="The model that answered.")
    table_sha256: str | None = Field(description="SHA-256 of the table that was read; null where none was.")
    sigma: float | None = Field(description="σ [-]: charge = d33 (3/2) (rT/h)² σ F; null outside the domain.")
    rel_error: float | None = Field(description="Bound on σ's relative error [-].")
    status: Status = Field(description="`ok`, or `out_of_domain`.")


def hot_route(table: SigmaTable) -> HotRoute:
    """The plain case of `sigma_one`: the layer, inside the domain."""

    def one(query: bytes) -> bytes | None:
        try:
            parts = [part.partition(b"=") for part in query.split(b"&")]
            point = {name.decode(): loads(value) for name, _, value in parts}
            plain = len(point) == len(parts) and are_numbers(point.values())
            found = table.at(**point) if plain else None
        except (ValueError, TypeError):
            return None
        if found is None:
            return None
        sigma, rel_error = found
        return dumps({**origin, "sigma": sigma, "rel_error": rel_error, "status": "ok"})

    origin = {"model": "layer", "table_sha256": table.sha256}
    return one


@router.get(
    "/sigma",
    operation_id="sigma_one",
    summary="σ at one point",
    responses={200: {"model": OneSigma, "content": {"text/csv": {}}}},
)
async def sigma_one(
    point: Annotated[SigmaQuery, Query()], table: Table, accept: Accept = "application/json"
) -> Response:
    """One point; Accept: text/csv gives one row."""
    found = answer(table, SigmaColumns(**point.model_dump()))
    return respond(found, accept, one=True)


EXAMPLE = {"a_over_h": [0.3, 0.6], "rt_over_h": 0.6, "load_parameter": [0.0, 0.01]}

_ANSWER: dict[int | str, dict[str, Any]] = {200: {"model": SigmaAnswer, "content": {"text/csv": {}}}}

router.post(
    "/sigma",
    operation_id="sigma_columns",
    summary="σ at many points",
    responses=_ANSWER,
    openapi_extra=columns_body(SigmaColumns, EXAMPLE),
)(columns_route(SigmaColumns, answer))
