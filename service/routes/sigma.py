"""σ: one point (GET) or columns of points (POST)."""

from typing import Annotated

from fastapi import APIRouter, Query, Response
from orjson import dumps, loads

from service.dependencies import Table
from service.middleware.asgi_middleware import HotRoute, are_numbers
from service.routes.columns_endpoint import OTHER_ANSWERS, Accept, add_columns_route, respond
from service.schemas.sigma import OneSigma, SigmaAnswer, SigmaColumns, SigmaQuery
from service.usecases.tables import sigma
from underskin.surrogate.sigma_table import SigmaTable

router = APIRouter(prefix="/v1")


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
    "/sigma",
    operation_id="sigma_one",
    tags=["sigma"],
    summary="σ at one point",
    responses={200: {"model": OneSigma, "content": OTHER_ANSWERS}},
)
async def sigma_one(
    point: Annotated[SigmaQuery, Query()], table: Table, accept: Accept = "application/json"
) -> Response:
    """One point; Accept chooses CSV or .npz, of one row."""
    return respond(sigma(table, None, SigmaColumns(**point.model_dump())), accept, one=True)


EXAMPLE = {"a_over_h": [0.3, 0.6], "rt_over_h": 0.6, "load_parameter": [0.0, 0.01]}

add_columns_route(router, "/sigma", "σ at many points", SigmaColumns, EXAMPLE, sigma, SigmaAnswer)
