"""Charge on every sensor of an array under several contacts or a pressure map."""

from typing import Any

from fastapi import APIRouter, Request, Response

from service.routes.columns_endpoint import OTHER_ANSWERS, Accept, answer_json, described_body, respond
from service.schemas.stress import StressAnswer, StressRequest
from service.usecases import tables as usecase
from service.usecases.tables import influence_table
from underskin.array_stress.request import read_request

router = APIRouter(prefix="/v1", tags=["stress"])


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

_ANSWER: dict[int | str, dict[str, Any]] = {200: {"model": StressAnswer, "content": OTHER_ANSWERS}}


@router.post(
    "/stress",
    operation_id="stress",
    summary="Charge on every sensor of an array",
    responses=_ANSWER,
    openapi_extra=described_body(StressRequest.__name__, EXAMPLE),
)
async def stress(request: Request, accept: Accept = "application/json") -> Response:
    """Linear superposition over all loads: off-centre, several, sheared, ν < 0.5, a yielding glue line."""

    def answer(document: Any) -> Response:
        stress_request = read_request(document)
        return respond(usecase.stress(influence_table(request.app.state.settings.tables), stress_request), accept)

    return await answer_json(request, answer)
