"""The stress in the layer under a sphere, for one skin and force."""

from typing import Annotated

from fastapi import APIRouter, Query, Response

from service.dependencies import Table
from service.schemas.field import FieldAnswer, FieldQuery
from service.usecases.tables import field_answer

router = APIRouter(prefix="/v1", tags=["field"])

EXAMPLE = {
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16.0,
    "sensor_radius_mm": 1.5,
    "indenter_radius_mm": 4.0,
    "preload_n": 1.0,
    "r_points": 7,
    "depth_points": 3,
}


@router.get(
    "/field", operation_id="field", summary="The stress under a sphere", responses={200: {"model": FieldAnswer}}
)
def field(query: Annotated[FieldQuery, Query()], table: Table) -> Response:
    """σ_zz in a section through the layer under a sphere; its last row is the base, where the sensors are.

    The surface bears the pressure of the contact: Hertz', or the layer's own. The base is that of the table; between
    them the stress is exact for small strain. `section_error` bounds what finite strain may change under Hertz'.
    """
    return Response(field_answer(table, query).model_dump_json(), media_type="application/json")
