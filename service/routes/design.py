"""A skin before it is built: transmission, spatial resolution, two-point separation."""

from typing import Any

from fastapi import APIRouter, Request, Response

from service.dependencies import Table
from service.problems import validated
from service.routes.columns_endpoint import answer_json, described_body
from service.schemas.design import DesignAnswer, DesignRequest
from service.usecases.design import design_answer, design_of

router = APIRouter(prefix="/v1", tags=["design"])

EXAMPLE = {
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16.0,
    "sensor_radius_mm": 1.5,
    "indenter_radius_mm": 4.0,
    "preload_n": 1.0,
    "pitch_mm": 4.0,
    "d33_pc_per_n": 14.0,
}


@router.post(
    "/design",
    operation_id="design",
    summary="A skin before it is built",
    responses={200: {"model": DesignAnswer}},
    openapi_extra=described_body(DesignRequest.__name__, EXAMPLE),
)
async def post(request: Request, table: Table) -> Response:
    """How much of a load reaches a sensor, how finely the array tells where it is, and how far apart two loads must be.

    Loads add, as on a linear layer.
    """

    def answer(document: Any) -> Response:
        demand = validated(DesignRequest, document)
        answer = design_answer(table, demand, design_of(table, demand))
        return Response(answer.model_dump_json(), media_type="application/json")

    return await answer_json(request, answer)
