"""What the model predicts for a skin: FRF, and what leads to it."""

from fastapi import APIRouter

from service.routes.columns_endpoint import add_columns_route
from service.schemas.frf import FrfAnswer, FrfColumns
from service.usecases.frf import frf

router = APIRouter(prefix="/v1", tags=["frf"])

EXAMPLE = {
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16.0,
    "sensor_radius_mm": 1.5,
    "indenter_radius_mm": 4.0,
    "preload_n": 1.0,
    "d33_pc_per_n": 14.0,
}

add_columns_route(router, "/frf", "FRF of a skin under a sphere", FrfColumns, EXAMPLE, frf, FrfAnswer)
