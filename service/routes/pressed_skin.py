"""What the model predicts for a skin, its FRF and what leads to it; and d33 of each sensor from its measured FRF."""

from fastapi import APIRouter

from service.routes.columns_endpoint import add_columns_route
from service.schemas.pressed_skin import D33Answer, D33Columns, FrfAnswer, FrfColumns
from service.usecases.pressed_skin import d33, frf

router = APIRouter(prefix="/v1")

FRF_EXAMPLE = {
    "thickness_mm": 2.5,
    "youngs_modulus_mpa": 16.0,
    "sensor_radius_mm": 1.5,
    "indenter_radius_mm": 4.0,
    "preload_n": 1.0,
    "d33_pc_per_n": 14.0,
}
D33_EXAMPLE = {**FRF_EXAMPLE, "frf_pc_per_n": [6.8, 6.9], "frf_uncertainty_pc_per_n": 0.1}
del D33_EXAMPLE["d33_pc_per_n"]

add_columns_route(router, "/frf", "FRF of a skin under a sphere", FrfColumns, FRF_EXAMPLE, frf, FrfAnswer)
add_columns_route(router, "/d33", "d33 from measured FRF", D33Columns, D33_EXAMPLE, d33, D33Answer)
