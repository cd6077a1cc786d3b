"""Charge on every sensor of an array under several contacts or a pressure map."""

from typing import Any

import numpy as np
from fastapi import APIRouter, Request, Response

from service.answers import Accept, Columns, respond
from service.columns import json_document
from service.dependencies import in_thread
from service.more_tables import influence_table
from service.stress_models import StressAnswer
from underskin.array_stress.answer import answer
from underskin.array_stress.request import StressRequest, read_request
from underskin.surrogate.influence_table import InfluenceTable

router = APIRouter(prefix="/v1", tags=["stress"])


def columns(table: InfluenceTable, request: StressRequest) -> Columns:
    """Charge and stress on each sensor."""
    found = answer(table, request)
    return Columns(
        rows=len(found.sensors),
        model="linear_layer",
        table_sha256=table.sha256,
        inside=found.inside,
        shared={
            "reach_mm": found.reach_mm,
            "contact_radius_mm": found.contact_radius_mm,
            "findings": [finding.in_columns() for finding in found.findings],
        },
        names={"sensor": found.sensors},
        columns=found.columns,
    )


EXAMPLE = {
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16.0,
    "sensor_radius_mm": 1.5,
    "d33_pc_per_n": 14.0,
    "sensors": [{"id": "s01", "x_mm": 0.0, "y_mm": 0.0}, {"id": "s02", "x_mm": 8.0, "y_mm": 0.0}],
    "contacts": [
        {"x_mm": 0.5, "y_mm": 0.0, "indenter_radius_mm": 4.0, "normal_force_n": 1.0},
        {"x_mm": 7.0, "y_mm": 1.0, "indenter_radius_mm": 4.0, "normal_force_n": 2.0, "tangential_force_n": [0.5, 0.0]},
    ],
}

_SCHEMA = {"$ref": "#/components/schemas/StressRequest"}
_ANSWER: dict[int | str, dict[str, Any]] = {200: {"model": StressAnswer, "content": {"text/csv": {}}}}


@router.post(
    "/stress",
    operation_id="stress",
    summary="Charge on every sensor of an array",
    responses=_ANSWER,
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {"application/json": {"schema": _SCHEMA, "example": EXAMPLE}},
        }
    },
)
async def stress(request: Request, accept: Accept = "application/json") -> Response:
    """Linear superposition over all loads: off-centre, several, sheared, ν < 0.5, a yielding glue line."""
    body = await request.body()
    content_type = request.headers.get("content-type", "")

    def work() -> Response:
        asked = read_request(json_document(body, content_type))
        with np.errstate(all="ignore"):  # what overflows is out of reach
            return respond(columns(influence_table(request.app.state.settings.tables), asked), accept)

    return await in_thread(work)
