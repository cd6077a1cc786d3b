"""What is computed from the tables and not kept: σ at one point (GET) or in columns of points (POST); what the model
predicts for a skin, its FRF and d33 of each sensor from its measured FRF; the stress under a sphere; the charge of an
array under loads; a skin before it is built. And the tables, with the hash that names each."""

from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from orjson import dumps, loads

from service.dependencies import Table
from service.middleware.asgi_middleware import HotRoute, are_numbers
from service.problems import validated
from service.routes.columns_endpoint import (
    OTHER_ANSWERS,
    Accept,
    add_columns_route,
    answer_json,
    described_body,
    respond,
)
from service.schemas.design import DesignAnswer, DesignRequest
from service.schemas.field import FieldAnswer, FieldQuery
from service.schemas.pressed_skin import D33Answer, D33Columns, FrfAnswer, FrfColumns
from service.schemas.sigma import OneSigma, SigmaAnswer, SigmaColumns, SigmaQuery
from service.schemas.stress import StressAnswer, StressRequest
from service.schemas.tables import Tables
from service.usecases import tables as usecase
from service.usecases.design import design_answer, design_of
from service.usecases.pressed_skin import d33, frf
from service.usecases.tables import field_answer, influence_table, sigma
from underskin.array_stress.request import read_request
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter(prefix="/v1")

SIGMA_EXAMPLE = {"a_over_h": [0.3, 0.6], "rt_over_h": 0.6, "load_parameter": [0.0, 0.01]}
_SKIN_EXAMPLE = {"thickness_mm": 2.5, "youngs_modulus_mpa": 16.0, "sensor_radius_mm": 1.5}
_PRESSED_EXAMPLE = {**_SKIN_EXAMPLE, "indenter_radius_mm": 4.0, "preload_n": 1.0}
FRF_EXAMPLE = {**_PRESSED_EXAMPLE, "d33_pc_per_n": 14.0}
D33_EXAMPLE = {**_PRESSED_EXAMPLE, "frf_pc_per_n": [6.8, 6.9], "frf_uncertainty_pc_per_n": 0.1}
FIELD_EXAMPLE = {**_PRESSED_EXAMPLE, "r_points": 7, "depth_points": 3}
DESIGN_EXAMPLE = {**_PRESSED_EXAMPLE, "pitch_mm": 4.0, "d33_pc_per_n": 14.0}
STRESS_EXAMPLE = {
    **_SKIN_EXAMPLE,
    "d33_pc_per_n": 14.0,
    "sensors": [{"id": "s01", "x_mm": 0.0, "y_mm": 0.0}, {"id": "s02", "x_mm": 8.0, "y_mm": 0.0}],
    "contacts": [
        {"x_mm": 0.5, "y_mm": 0.0, "indenter_radius_mm": 4.0, "normal_force_n": 1.0},
        {"x_mm": 7.0, "y_mm": 1.0, "indenter_radius_mm": 4.0, "normal_force_n": 2.0, "tangential_force_n": [0.5, 0.0]},
    ],
}


def hot_route(table: SigmaTable) -> HotRoute:
    """The plain case of `sigma_one`: the layer, inside the domain."""

    def one(query: bytes) -> bytes | None:
        try:
            parts = [part.partition(b"=") for part in query.split(b"&")]
            point = {name.decode(): loads(value) for name, _, value in parts}
            plain = len(point) == len(parts) and are_numbers(point.values())
            values = table.at(**point) if plain else None
        except (ValueError, TypeError):
            return None
        if values is None:
            return None
        return dumps({**origin, "sigma": values[0], "rel_error": values[1], "limit": None, "status": "ok"})

    origin = {"model": "layer", "table_sha256": table.sha256}
    return one


@router.get(
    "/sigma", tags=["sigma"], summary="σ at one point", responses={200: {"model": OneSigma, "content": OTHER_ANSWERS}}
)
async def sigma_one(
    point: Annotated[SigmaQuery, Query()], table: Table, accept: Accept = "application/json"
) -> Response:
    """One point; Accept chooses CSV or .npz, of one row."""
    return respond(sigma(table, None, SigmaColumns(**point.model_dump())), accept, one=True)


add_columns_route(router, "/sigma", "σ at many points", SigmaColumns, SIGMA_EXAMPLE, sigma, SigmaAnswer)
add_columns_route(router, "/frf", "FRF of a skin under a sphere", FrfColumns, FRF_EXAMPLE, frf, FrfAnswer)
add_columns_route(router, "/d33", "d33 from measured FRF", D33Columns, D33_EXAMPLE, d33, D33Answer)


@router.post(
    "/stress",
    tags=["stress"],
    summary="Charge on every sensor of an array",
    responses={200: {"model": StressAnswer, "content": OTHER_ANSWERS}},
    openapi_extra=described_body(StressRequest.__name__, STRESS_EXAMPLE),
)
async def stress(request: Request, accept: Accept = "application/json") -> Response:
    """Linear superposition over all loads: off-centre, several, sheared, ν < 0.5, a yielding glue line."""

    def answer(document: Any) -> Response:
        stress_request = read_request(document)
        return respond(usecase.stress(influence_table(request.app.state.settings.tables), stress_request), accept)

    return await answer_json(request, answer)


@router.get("/field", tags=["field"], summary="The stress under a sphere", responses={200: {"model": FieldAnswer}})
def field(query: Annotated[FieldQuery, Query()], table: Table) -> Response:
    """σ_zz in a section through the layer under a sphere; its last row is the base, where the sensors are.

    The surface bears the pressure of the contact: Hertz', or the layer's own. The base is that of the table; between
    them the stress is exact for small strain. `section_error` bounds what finite strain may change under Hertz'.
    """
    return Response(field_answer(table, query).model_dump_json(), media_type="application/json")


@router.post(
    "/design",
    tags=["design"],
    summary="A skin before it is built",
    responses={200: {"model": DesignAnswer}},
    openapi_extra=described_body(DesignRequest.__name__, DESIGN_EXAMPLE),
)
async def design(request: Request, table: Table) -> Response:
    """How much of a load reaches a sensor, how finely the array tells where it is, and how far apart two loads must be.

    Loads add, as on a linear layer.
    """

    def answer(document: Any) -> Response:
        demand = validated(DesignRequest, document)
        answer = design_answer(table, demand, design_of(table, demand))
        return Response(answer.model_dump_json(), media_type="application/json")

    return await answer_json(request, answer)


@router.get("/tables", tags=["tables"], summary="The tables in use")
async def tables(request: Request, table: Table) -> Tables:
    """The tables that answers are computed from: of σ, of influence, and of the solved contact."""
    return usecase.tables(table, request.app.state.settings.tables)
